//! Parameters shared by all nodes that stamp: the variation from stamp to stamp.

/// Declares a node that stamps: its own fields in four places, with the shared fields between them.
macro_rules! varied {
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $($(#[$m1:meta])* $f1:ident: $t1:ty,)*
            [steering]
            $($(#[$m2:meta])* $f2:ident: $t2:ty,)*
            [sizes]
            $($(#[$m3:meta])* $f3:ident: $t3:ty,)*
            [share]
            $($(#[$m4:meta])* $f4:ident: $t4:ty,)*
            [order]
            $($(#[$m5:meta])* $f5:ident: $t5:ty,)*
            [seed]
        }
    ) => {
        $(#[$meta])*
        #[shibo_node::node]
        pub struct $name {
            $($(#[$m1])* pub $f1: $t1,)*
            /// The share of stamps that are drawn, 0..1, read at the place of each stamp.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            pub density: Option<In<Gray>>,
            /// Factor on the size of stamps, 0..1, read at the place of each stamp.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            pub scale_by: Option<In<Gray>>,
            /// Direction of the x axis of stamps: degrees from +x towards +y, or vectors; `turn` is added.
            pub direction: Option<In<Direction>>,
            $($(#[$m2])* pub $f2: $t2,)*
            /// Width and height of a stamp of scale 1.
            #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
            #[default(Xy::new(4.0, 4.0))]
            pub size: Xy,
            /// Smallest and largest factor on the size; each stamp draws one at random.
            #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
            #[default(Range::new(1.0, 1.0))]
            pub scale: Range,
            /// Smallest and largest rotation, from +x towards +y; each stamp draws one at random.
            #[schemars(extend("minimum" = -3600.0, "maximum" = 3600.0, "unit" = "°"))]
            pub turn: Range,
            $($(#[$m3])* pub $f3: $t3,)*
            /// The share of stamps that are drawn.
            #[schemars(range(min = 0, max = 1))]
            #[default(1.0)]
            pub share: f64,
            $($(#[$m4])* pub $f4: $t4,)*
            /// The order in which stamps are drawn.
            #[default(Order::Rows)]
            pub order: Order,
            $($(#[$m5])* pub $f5: $t5,)*
            /// Another seed gives other random values.
            pub seed: u64,
        }

        impl $name {
            /// The size of `size` or of another stamp in mm.
            fn size_of(&self, other: Option<Xy>) -> DVec2 {
                let size = other.unwrap_or(self.size);
                DVec2::new(size.x, size.y)
            }

            /// The stamps to choose from: the main one, and `others`.
            fn choices(&self) -> Vec<Choice> {
                let others = self.others.iter().map(|other| Choice { size: self.size_of(other.size), weight: other.weight });
                [Choice { size: self.size_of(None), weight: 1.0 }].into_iter().chain(others).collect()
            }

            /// The variation of stamps; `value` is the range of factors on the values.
            fn plan(&self, value: Range) -> StampPlan<'_> {
                StampPlan {
                    choices: self.choices(),
                    scale: self.scale,
                    turn: self.turn,
                    value,
                    share: self.share,
                    order: self.order,
                    density: &self.density,
                    scale_by: &self.scale_by,
                    direction: &self.direction,
                }
            }
        }
    };
}

pub(super) use varied;
