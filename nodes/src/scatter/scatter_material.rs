//! [`ScatterMaterial`]: whole materials stamped on points.
//!
//! All channels are drawn by the kernel of [`TileSampler`](super::TileSampler), from the same stamps and with the same
//! heights, so the same stamp shows in all of them. A tile that no stamp touches is a copy of the ground. With `Over`,
//! ground under opaque stamps is not computed. Cost: that of `Scatter` for each channel.
use super::plan::{Choice, Order, StampPlan};
use super::sown::{Ground, Sown, StampFields, StampQuantity};
use super::tile_sampler::too_large;
use super::varied::varied;
use crate::normals::normals;
use crate::values::each;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::scatter::paint::{Content, Overlap};
use shibo_node::{
    CanvasFacts, Context, Direction, Fact, Gray, In, MaterialInputs, Node, Output, Outputs, Range, Xy, choice, node,
};
use shibo_value::diagnostics::Problem;
use shibo_value::{Channel, ChannelSet, Field, Material, Points, Stop, Type};
use std::sync::Arc;

/// How the heights of stamps are combined with those of the ground and of each other.
#[choice]
pub enum ScatterHeights {
    /// The higher one shows, in all channels: stamps sink into the ground and into each other.
    #[default]
    Max,
    /// Heights add up; in the other channels the highest stamp shows.
    Add,
    /// The stamp that is drawn last shows, whatever lies below it.
    Over,
}

varied! {
    /// Stamps a material on points, all channels at once, over another material: pebbles in sand, studs in leather,
    /// leaves on soil.
    ///
    /// The whole canvas of the material becomes one stamp of `size` mm. Its `opacity`, or `shape`, cuts out the stamp.
    /// Normals are made from the heights of the result; the coat is flat on stamps. Angles of anisotropy turn with the
    /// stamps. `others` adds materials with sizes of their own, which are drawn in turn at random.
    ///
    /// ```ron
    /// "form": Shape(form: Ellipse, size: (39, 31)),
    /// "outside": Invert(input: "form.mask"),
    /// "dome": Pillow(input: "outside", radius: 14),
    /// "speckle": Fractal(size: 6, octaves: 6),
    /// "tone": GradientMap(input: "speckle", stops: [(0.3, "#3f3a35"), (0.7, "#8d8375")]),
    /// "pebble": Material(base_color: "tone", roughness: 0.4, height: "dome", opacity: "form.mask"),
    /// "waves": Fractal(size: 6, octaves: 8, gain: 0.6),
    /// "sand": Material(base_color: "#c2a678", roughness: 0.95, height: "waves"),
    /// "points": PoissonPoints(pitch: 4.5),
    /// "both": ScatterMaterial(
    ///   material: "pebble", ground: "sand", points: "points", size: 8, scale: (0.4, 1), turn: (0, 360), height_scale: (0.7, 1.6),
    /// ),
    /// "example": Relief(material: "both"),
    /// ```
    ///
    /// Elsewhere: Substance Designer *Shape Splatter* with *Shape Splatter Blend*, *Material Scatter*; Houdini *Copy to
    /// Points*; Blender *Instance on Points*.
    pub struct ScatterMaterial {
        /// Material to stamp; its whole canvas becomes a stamp.
        material: In<Material>,
        /// Material of the ground; defaults replace channels that it lacks.
        ground: Option<In<Material>>,
        /// Positions of the stamps.
        points: In<Points>,
        /// Opacity of the stamp, 0..1, over the same canvas. If not given, the opacity of the material, or a full
        /// rectangle without one.
        #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
        shape: Option<In<Gray>>,
        /// Further materials to stamp, each with its own size. Every place draws one of all at random, by their weights.
        others: Vec<OtherMaterial>,
        [steering]
        [sizes]
        /// Smallest and largest factor on the heights; each stamp draws one at random.
        #[schemars(extend("minimum" = -1e4, "maximum" = 1e4))]
        #[default(Range::new(1.0, 1.0))]
        height_scale: Range,
        /// By how much stamps are raised before `height_scale`; negative values sink them into the ground.
        #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
        offset: f64,
        [share]
        /// How heights are combined, and which stamp shows.
        #[default(ScatterHeights::Max)]
        heights: ScatterHeights,
        [order]
        [seed]
    }
}

/// Another material of [`ScatterMaterial`].
#[node]
pub struct OtherMaterial {
    /// Material to stamp; its whole canvas becomes a stamp.
    pub material: In<Material>,
    /// Opacity of the stamp, 0..1, over the same canvas. If not given, the opacity of the material, or a full rectangle
    /// without one.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub shape: Option<In<Gray>>,
    /// Width and height of the stamp at scale 1; `size` of the node if not given.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    pub size: Option<Xy>,
    /// Frequency of the stamp, relative to the first one, whose weight is 1.
    #[schemars(range(min = 0, max = 1e6))]
    #[default(1.0)]
    pub weight: f64,
}

/// Channels that are not copied from stamps: normals would have to be rotated, and opacity cuts stamps out.
const LEFT: [Channel; 3] = [Channel::Normal, Channel::CoatNormal, Channel::Opacity];

impl Node for ScatterMaterial {
    const OUTPUTS: &'static [Output] = &[
        Output::new("material", Type::Material, "The stamps on the ground, with the channels of both."),
        Output::new("mask", Type::Gray, "How much of the place stamps cover, 0..1, seen or not."),
        Output::new("ids", Type::Ids, "The number of the stamp that is seen, from 1; 0 where there is none."),
        Output::new(
            "local",
            Type::Vec2,
            "The place within that stamp from its middle, along its own axes; 0 where there is none.",
        )
        .in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        too_large(&self.choices(), self.scale, canvas)
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        let ground = if self.ground.is_some() { inputs.at("ground") } else { ChannelSet::NONE };
        let others = (1..=self.others.len()).map(|number| inputs.at(&format!("others.{number}.material")));
        result(others.fold(inputs.at("material"), ChannelSet::union), ground)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let points = cx.get(&self.points)?;
        let mut stamps = vec![(cx.get(&self.material)?, cx.get_opt(&self.shape)?)];
        for other in &self.others {
            stamps.push((cx.get(&other.material)?, cx.get_opt(&other.shape)?));
        }
        let materials: Vec<&Material> = stamps.iter().map(|(material, _)| &**material).collect();
        let ground = cx.get_opt(&self.ground)?;
        let ground = ground.as_deref().cloned().unwrap_or_else(|| Material::new([]));
        let places = points.positions.iter().map(|p| p.as_dvec2());
        let hash = Hash::new(cx.seed(self.seed));
        let plan = self.plan(self.height_scale);
        let set = Arc::new(plan.stamps(cx, places, (hash, f64::from(points.pitch), points.periodic))?);
        let has_height = materials.iter().any(|material| material.get(Channel::Height).is_some());
        let fields = |(material, shape): &(Arc<Material>, Option<Field>)| {
            let height = has_height.then(|| raised(material, self.offset));
            StampFields {
                input: height.clone().unwrap_or_else(|| Channel::Height.default_field()),
                shape: shape.clone().or_else(|| material.get(Channel::Opacity).cloned()),
                height,
            }
        };
        let base = Sown {
            stamps: stamps.iter().map(fields).collect(),
            // Without heights, the last stamp shows.
            overlap: if !has_height || self.heights == ScatterHeights::Over {
                Overlap::Over
            } else {
                Overlap::ByHeight
            },
            set,
            content: Content::Scaled,
            ground: Ground::Flat(0.0),
            size_mm: cx.size_mm(),
        };
        let cover = cx.shared_field("mask", base.field(StampQuantity::Cover, points.periodic));
        let stamped =
            Stamped { base, cover: cover.clone(), sinks: self.heights == ScatterHeights::Max, points: &points };
        let has = |channel: Channel| materials.iter().chain([&&ground]).any(|m| m.get(channel).is_some());
        let height = has(Channel::Height).then(|| {
            let adds = self.heights == ScatterHeights::Add;
            cx.shared_field("height", stamped.channel(Channel::Height, None, &ground, adds))
        });
        let made = Channel::ALL.iter().filter_map(|channel| {
            let field = match (channel, &height) {
                (Channel::Height, height) => height.clone()?,
                (Channel::Normal, Some(height)) => normals(height),
                (channel, _) if !LEFT.contains(channel) && has(*channel) => {
                    let contents = materials.iter().map(|material| material.or_default(*channel)).collect();
                    stamped.channel(*channel, Some(contents), &ground, false)
                }
                (Channel::CoatNormal | Channel::Opacity, _) if ground.get(*channel).is_some() => {
                    stamped.channel(*channel, Some(vec![channel.default_field(); materials.len()]), &ground, false)
                }
                _ => return None,
            };
            Some((*channel, field))
        });
        let made = Material::new(made.collect::<Vec<_>>());
        Ok(Outputs::one(made)
            .with("mask", cover)
            .with("ids", stamped.shown(StampQuantity::Ids, &ground))
            .with("local", stamped.shown(StampQuantity::Local, &ground)))
    }
}

/// The channels of the result for stamps of a material on a ground.
fn result(material: ChannelSet, ground: ChannelSet) -> ChannelSet {
    let kept = |channels: ChannelSet, without: &'static [Channel]| {
        channels.iter().filter(move |channel| !without.contains(channel))
    };
    let both: ChannelSet = kept(material, &LEFT).chain(kept(ground, &LEFT[..1])).collect();
    if both.has(Channel::Height) { both.union([Channel::Normal].into_iter().collect()) } else { both }
}

/// The height of a material, raised.
fn raised(material: &Material, offset: f64) -> Field {
    let (height, offset) = (material.or_default(Channel::Height), narrow(offset));
    if offset == 0.0 {
        return height;
    }
    each(&height, move |height| height + offset)
}

/// Stamps on a ground.
struct Stamped<'a> {
    base: Sown,
    cover: Field,
    /// True if higher ground hides stamps.
    sinks: bool,
    points: &'a Points,
}

impl Stamped<'_> {
    /// A channel of the result; `contents` are those of the stamps, by default their heights.
    fn channel(&self, channel: Channel, contents: Option<Vec<Field>>, ground: &Material, adds: bool) -> Field {
        let values = ground.or_default(channel);
        let tiling = self.points.periodic.and(values.tiling());
        let kind = match channel {
            Channel::Height => Content::Scaled,
            Channel::AnisotropyAngle => Content::Angle,
            _ => Content::Steady,
        };
        let mut stamps = self.base.stamps.clone();
        if let Some(contents) = contents {
            stamps.iter_mut().zip(contents).for_each(|(stamp, content)| stamp.input = content);
        }
        let sown = Sown {
            stamps,
            content: kind,
            overlap: if adds { Overlap::Add } else { self.base.overlap },
            ground: self.ground(values, ground),
            ..self.base.clone()
        };
        sown.field(StampQuantity::Values, tiling)
    }

    /// The number of the stamp that shows, or the place within it.
    fn shown(&self, what: StampQuantity, ground: &Material) -> Field {
        let values = Channel::Height.default_field();
        let tiling = ground.get(Channel::Height).map_or(self.points.periodic, |h| self.points.periodic.and(h.tiling()));
        Sown { ground: self.ground(values, ground), ..self.base.clone() }.field(what, tiling)
    }

    fn ground(&self, values: Field, ground: &Material) -> Ground {
        let height = self.sinks.then(|| ground.or_default(Channel::Height));
        Ground::Field { values, height, cover: self.cover.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{gray, part};
    use crate::testing::{canvas, outputs, port};
    use glam::Vec2;
    use shibo_value::{Tiling, Value};

    fn number(value: f32) -> Field {
        Field::constant(Type::Gray, &[value])
    }

    fn points(places: &[(f32, f32)]) -> Value {
        let positions = places.iter().map(|(x, y)| Vec2::new(*x, *y)).collect();
        let size_mm = DVec2::splat(32.0);
        Points { positions, size_mm, periodic: Tiling::BOTH, pitch: 8.0, ..Points::default() }.into()
    }

    fn node() -> ScatterMaterial {
        ScatterMaterial {
            material: port(0),
            ground: Some(port(1)),
            points: port(2),
            size: Xy::new(8.0, 8.0),
            ..ScatterMaterial::default()
        }
    }

    /// Stamps of height 1, red roughness 0.2; ground at 0.5, and at 2 for x > 16 mm, roughness 0.8.
    fn inputs(places: &[(f32, f32)]) -> [Value; 3] {
        let stamp = Material::new([
            (Channel::Height, number(1.0)),
            (Channel::Roughness, number(0.2)),
            (Channel::AnisotropyAngle, number(10.0)),
        ]);
        let step = Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
            let (x, width) = (out.window.x, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = if (x + k % width).rem_euclid(64) < 32 { 0.5 } else { 2.0 };
            }
            Ok(())
        });
        let ground =
            Material::new([(Channel::Height, step), (Channel::Roughness, number(0.8)), (Channel::Coat, number(1.0))]);
        [stamp.into(), ground.into(), points(places)]
    }

    fn made(node: &ScatterMaterial, inputs: &[Value]) -> Material {
        let made = outputs(node, inputs, &canvas()).unwrap();
        let Some(Value::Material(material)) = made.take("material", true) else { panic!("no material") };
        let of = |value: &Value| match value {
            Value::Material(material) => material.channels().iter().map(|c| c.0).collect(),
            _ => ChannelSet::NONE,
        };
        let known = node.channels(&MaterialInputs::new(&[("material", of(&inputs[0])), ("ground", of(&inputs[1]))]));
        assert_eq!(known.iter().collect::<Vec<_>>(), material.channels().iter().map(|c| c.0).collect::<Vec<_>>());
        (**material).clone()
    }

    /// The value at (x, y) mm.
    fn at(material: &Material, channel: Channel, x: u32, y: u32) -> f32 {
        let tile = part(material.get(channel).unwrap(), &canvas(), 0, 0, 64, 64);
        tile.row(0, 2 * y as usize)[2 * x as usize]
    }

    #[test]
    fn heights_decide_in_all_channels() {
        // Stamps: one on the low ground, one on the high ground, two over each other on the low ground.
        let inputs = inputs(&[(5.0, 5.0), (24.0, 8.0), (6.0, 22.0), (8.0, 24.0)]);
        for (heights, low, high, twice) in [
            (ScatterHeights::Max, (1.0, 0.2), (2.0, 0.8), 1.0),
            (ScatterHeights::Add, (1.5, 0.2), (3.0, 0.2), 2.5),
            (ScatterHeights::Over, (1.0, 0.2), (1.0, 0.2), 1.0),
        ] {
            let made = made(&ScatterMaterial { heights, ..node() }, &inputs);
            let both = |x, y| (at(&made, Channel::Height, x, y), at(&made, Channel::Roughness, x, y));
            assert_eq!((both(5, 5), both(24, 8)), (low, high), "{heights:?}");
            assert_eq!((at(&made, Channel::Height, 7, 23), both(13, 14)), (twice, (0.5, 0.8)), "{heights:?}");
            // The default replaces a coat that stamps lack, and an angle that the ground lacks.
            assert_eq!((at(&made, Channel::Coat, 5, 5), at(&made, Channel::Coat, 13, 14)), (0.0, 1.0));
            assert_eq!(
                (at(&made, Channel::AnisotropyAngle, 5, 5), at(&made, Channel::AnisotropyAngle, 13, 14)),
                (10.0, 0.0)
            );
        }
    }

    #[test]
    fn other_materials_are_drawn_in_their_own_size() {
        let mut all = inputs(&[(8.0, 8.0), (22.0, 22.0)]).to_vec();
        let other = Material::new([(Channel::Height, number(3.0)), (Channel::Coat, number(0.6))]);
        all.push(other.into());
        let others = vec![OtherMaterial {
            material: port(3),
            size: Some(Xy::new(2.0, 2.0)),
            weight: 1e6,
            ..OtherMaterial::default()
        }];
        let made = |heights| {
            let node = ScatterMaterial { others: others.clone(), heights, ..node() };
            let made = outputs(&node, &all, &canvas()).unwrap();
            match made.take("material", true) {
                Some(Value::Material(material)) => (**material).clone(),
                _ => panic!("no material"),
            }
        };
        for heights in [ScatterHeights::Max, ScatterHeights::Over] {
            let made = made(heights);
            let both = |x, y| (at(&made, Channel::Height, x, y), at(&made, Channel::Coat, x, y));
            assert_eq!((both(8, 8), both(22, 22), both(10, 8)), ((3.0, 0.6), (3.0, 0.6), (0.5, 1.0)), "{heights:?}");
            // The default replaces a roughness that the other material lacks.
            assert_eq!(at(&made, Channel::Roughness, 8, 8), 0.5);
        }
    }

    #[test]
    fn stamps_are_raised_turned_and_cut_out() {
        let mut inputs = inputs(&[(8.0, 8.0)]);
        let sunk = ScatterMaterial { offset: -0.75, ..node() };
        assert_eq!(at(&made(&sunk, &inputs), Channel::Roughness, 8, 8), 0.8);
        let raised = ScatterMaterial { offset: 0.25, height_scale: Range::new(2.0, 2.0), ..node() };
        assert_eq!(at(&made(&raised, &inputs), Channel::Height, 8, 8), 2.5);
        let turned = ScatterMaterial { turn: Range::new(90.0, 90.0), ..node() };
        assert!((at(&made(&turned, &inputs), Channel::AnisotropyAngle, 8, 8) - 100.0).abs() < 1e-3);
        let Value::Material(stamp) = &inputs[0] else { panic!() };
        let channels = stamp.channels().iter().cloned().chain([(Channel::Opacity, number(0.0))]);
        inputs[0] = Material::new(channels.collect::<Vec<_>>()).into();
        assert_eq!(at(&made(&node(), &inputs), Channel::Roughness, 8, 8), 0.8);
    }

    #[test]
    fn materials_conform() {
        let field = |heights| ScatterMaterial { heights, turn: Range::new(0.0, 360.0), ..node() };
        let material = Material::new([(Channel::Height, gray()), (Channel::Roughness, gray())]);
        let inputs: [Value; 3] =
            [material.clone().into(), material.into(), points(&[(3.0, 4.0), (15.0, 14.0), (30.0, 9.0)])];
        for heights in [ScatterHeights::Max, ScatterHeights::Add, ScatterHeights::Over] {
            let made = made(&field(heights), &inputs);
            for channel in [Channel::Height, Channel::Roughness] {
                let field = made.get(channel).unwrap();
                let whole = part(field, &canvas(), -7, -5, 80, 70);
                let mut crop = part(field, &canvas(), 9, 11, 33, 21);
                let small = crop.clone();
                crop.copy_from(&whole, 0, 0);
                assert_eq!(small.data(), crop.data(), "{heights:?}");
            }
        }
    }
}
