//! [`WoodRays`]: the rays of hardwoods: flecks on a quarter cut, lines on end grain, spindles on a flat cut.
//!
//! Beyond the source. Cost: about 40 ns a point.
use super::frames::frames;
use super::trees::even;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::wood::rays::{RayStyle, Rays};
use shibo_kernel::wood::solids::{Code, places};
use shibo_kernel::wood::trunk::Trunk;
use shibo_node::{Color, Context, Fact, In, Node, Output, Outputs, SolidColor, SolidVector, node};
use shibo_value::{Solid, Stop, Tree, Type};

/// Draws rays: thin sheets from the pith outwards, which look different on each cut: flecks on a quarter cut, lines on
/// end grain, spindles on a flat cut.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": Tree(skeleton: FitSkeleton(curve: "nodes"), elongation_speed: 260, thickening_speed: 2.3),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(stops: [(0, "#b58e60"), (0.34, "#c9a577"), (0.7, "#c4a070"), (1, "#b08859")]),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "fiber": FiberSpace(time: "time", tree: "tree"),
/// "oak": WoodRays(color: "wood", fiber: "fiber", tree: "tree"),
/// "example": CutPlane(solid: "oak", preset: QuarterSawn, distance: 25, offset: 1),
/// ```
#[node]
pub struct WoodRays {
    /// The colour to draw on.
    pub color: In<SolidColor>,
    /// Coordinates along the fibres: the output `place` of `FiberSpace`.
    pub fiber: In<SolidVector>,
    /// The tree; rays start from its pith. The z axis if not given.
    pub tree: Option<In<Tree>>,
    /// Distance between rays around the stem.
    #[schemars(range(min = 0.05, max = 100), extend("unit" = "mm"))]
    #[default(1.7)]
    pub pitch: f64,
    /// Height of rays along the grain.
    #[schemars(range(min = 0.05, max = 1000), extend("unit" = "mm"))]
    #[default(13.0)]
    pub height: f64,
    /// Thickness of rays.
    #[schemars(range(min = 0.005, max = 10), extend("unit" = "mm"))]
    #[default(0.4)]
    pub width: f64,
    /// Share of places that have a ray.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.85)]
    pub density: f64,
    /// Length of rays outwards.
    #[schemars(range(min = 0.5, max = 1000), extend("unit" = "mm"))]
    #[default(34.0)]
    pub length: f64,
    /// Bend of rays, as a share of the distance between them; it determines the size of flecks.
    #[schemars(range(min = 0, max = 10))]
    #[default(0.62)]
    pub wobble: f64,
    /// The colour of flecks and of lines on end grain.
    #[default(Color::srgb([0xDC, 0xC0, 0x98]))]
    pub ray_color: Color,
    /// Strength of flecks.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.7)]
    pub gain: f64,
    /// Factor on the colour where a flat cut meets rays.
    #[schemars(range(min = 0, max = 2))]
    #[default(0.8)]
    pub flat: f64,
    /// Dependence of the colour and the sharpness of rays on the cut, as in nature: with 0 they are the same on all
    /// cuts, so that faces agree exactly on their shared edges.
    #[schemars(range(min = 0, max = 1))]
    #[default(1.0)]
    pub by_cut: f64,
    /// Another seed gives other rays of the same kind.
    pub seed: u64,
}

/// Share of their own colour that rays show on a cut in any direction if `by_cut` is 0.
const EVERYWHERE: f32 = 0.6;

impl Node for WoodRays {
    const VERSION: u32 = 4;
    const OUTPUTS: &'static [Output] = &[
        Output::new("color", Type::SolidColor, "The colour with its rays."),
        Output::new("mask", Type::Solid, "How much of a point is ray, 0..1."),
        Output::new("fleck", Type::Solid, "The part of it that shines as a fleck: on cuts along rays."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (color, fiber) = (cx.get(&self.color)?, cx.get(&self.fiber)?);
        let trunk = match cx.get_opt(&self.tree)? {
            Some(tree) => Trunk::<f32>::new(&even(&tree.skeleton, "tree")?),
            None => Trunk::new(&[]),
        };
        let style = RayStyle {
            pitch: narrow(self.pitch),
            height: narrow(self.height),
            width: narrow(self.width),
            density: narrow(self.density),
            length: narrow(self.length),
            wobble: narrow(self.wobble),
        };
        let rays = Rays::new(style, Hash::new(cx.seed(self.seed)));
        let (own, gain, by_cut) = (self.ray_color.0, narrow(self.gain), narrow(self.by_cut));
        // The weight of a ray's own colour (a fleck or a line), and the weight of a spindle (on a flat cut).
        let code = Code::of_place(move |patch, inputs, out| {
            let [x, y, z] = [0, 1, 2].map(|c| inputs[0].plane(c));
            let [mask, shine, flat] = out else { return };
            dispatch(
                #[inline(always)]
                || {
                    trunk.runs(
                        &places(patch),
                        #[inline(always)]
                        |from, to, qx, qy| {
                            let points = patch.place[0][from..to].iter().zip(&patch.place[1][from..to]);
                            let axis = qx.iter().zip(qy);
                            let to = shine[from..to].iter_mut().zip(&mut flat[from..to]);
                            for (((x, y), (qx, qy)), (outward_x, outward_y)) in points.zip(axis).zip(to) {
                                let (dx, dy) = (x - qx, y - qy);
                                let inverse = 1.0 / math::max((dx * dx + dy * dy).sqrt(), 1e-4);
                                (*outward_x, *outward_y) = (dx * inverse, dy * inverse);
                            }
                        },
                    );
                    frames(
                        patch,
                        #[inline(always)]
                        |from, to, frame| {
                            let factors = shine[from..to].iter_mut().zip(&mut flat[from..to]);
                            for ((shine, flat), across) in factors.zip(&mut mask[from..to]) {
                                let (x, y) = (*shine, *flat);
                                let n = frame.map_or([-y, x, 0.0], |f| f.normal);
                                let (outward, around) = (n[0] * x + n[1] * y, n[1] * x - n[0] * y);
                                *shine = around * around + 0.8 * n[2] * n[2];
                                *flat = outward * outward;
                                let turned = math::max(1.0 - around * around, 0.0).sqrt();
                                *across = math::lerp(1.0, turned, by_cut);
                            }
                        },
                    );
                },
            );
            rays.fill([x, y, z], patch.pixel, mask);
        });
        let all = Solid::new(Type::SolidVector, vec![fiber], code.with_quads());
        let all = cx.shared("all", all);
        let factor = (narrow(self.flat) - 1.0) * by_cut;
        // Mean strength of rays over all cuts.
        let always = EVERYWHERE * (1.0 - by_cut);
        let paint = Code::of_inputs(move |_, inputs, out| {
            let [mask, shine, flat] = [0, 1, 2].map(|c| inputs[1].plane(c));
            for (c, plane) in out.iter_mut().enumerate() {
                for (i, (out, color)) in plane.iter_mut().zip(inputs[0].plane(c)).enumerate() {
                    let lit = math::lerp(*color, own[c], mask[i] * gain * (shine[i] * by_cut + always));
                    *out = lit * (1.0 + factor * mask[i] * flat[i]);
                }
            }
        });
        let fleck = Code::of_inputs(|_, inputs, out| {
            let (mask, shine) = (inputs[0].plane(0), inputs[0].plane(1));
            out[0].iter_mut().zip(mask.iter().zip(shine)).for_each(|(out, (m, s))| *out = m * math::saturate(*s));
        });
        Ok(Outputs::one(paint.solid(Type::SolidColor, vec![color, all.clone()]))
            .with("mask", all.channel(0))
            .with("fleck", fleck.solid(Type::Solid, vec![all])))
    }
}
