//! The types of wires.
use std::fmt;

macro_rules! types {
    ($($name:ident $color:literal $doc:literal,)*) => {
        /// Type of a wire.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Type { $(#[doc = $doc] $name,)* }

        impl Type {
            /// All types.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            /// The name as users read it.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name),)* }
            }

            /// Its colour in drawings of graphs.
            pub const fn color(self) -> &'static str {
                match self { $(Self::$name => $color,)* }
            }
        }
    };
}

super::objects! { types! {
    Gray        "#7a8290" "One number everywhere on the canvas.",
    Rgb         "#d08a1d" "Scene-linear colour everywhere on the canvas.",
    Normal      "#7f6be0" "A tangent-space normal `n` everywhere on the canvas, kept as `½ + ½n`; y points up unless its node says otherwise.",
    Vec2        "#3f8fd2" "A vector everywhere on the canvas; displacements are in mm.",
    Jacobian    "#3f8fd2" "A 2×2 matrix everywhere on the canvas.",
    Ids         "#b0589c" "A region number everywhere on the canvas: whole, below 2^24.",
    Picture     "#d08a1d" "A picture file placed on the canvas; serves as `Gray` and as `Rgb`.",
    Solid       "#9a6a3f" "One number at every point in space.",
    SolidColor  "#9a6a3f" "Scene-linear colour at every point in space.",
    SolidVector "#9a6a3f" "A vector at every point in space.",
    Material    "#c03a6b" "Named channels of a surface.",
    SolidMaterial "#c03a6b" "Named channels at every point in space.",
} }

impl Type {
    /// Type with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|ty| ty.name() == name)
    }

    /// True if it is evaluated by tiles.
    pub const fn is_field(self) -> bool {
        matches!(self, Self::Gray | Self::Rgb | Self::Normal | Self::Vec2 | Self::Jacobian | Self::Ids)
    }

    /// True if it is a function of a point in space.
    pub const fn is_solid(self) -> bool {
        matches!(self, Self::Solid | Self::SolidColor | Self::SolidVector)
    }

    /// True for materials, on the canvas or in space.
    pub const fn is_material(self) -> bool {
        matches!(self, Self::Material | Self::SolidMaterial)
    }

    /// True if it is evaluated at points in space.
    pub const fn is_in_space(self) -> bool {
        self.is_solid() || matches!(self, Self::SolidMaterial)
    }

    /// Number of channels of a field or a solid; 0 for any other type.
    pub const fn channels(self) -> usize {
        match self {
            Self::Gray | Self::Ids | Self::Solid => 1,
            Self::Rgb | Self::Normal | Self::SolidColor | Self::SolidVector => 3,
            Self::Vec2 => 2,
            Self::Jacobian => 4,
            _ => 0,
        }
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
