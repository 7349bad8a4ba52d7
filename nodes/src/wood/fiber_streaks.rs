//! [`FiberStreaks`]: fine streaks of fibres, slow drifts of tone, and streaks of pigment.
//!
//! Beyond the source. Cost: about 30 ns a point.
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::noise::noise3::{Noise3, visible};
use shibo_kernel::wood::solids::Code;
use shibo_node::{Color, Context, Fact, In, Node, Output, Outputs, SolidColor, SolidVector, node};
use shibo_value::{Patch, Planes, Solid, Stop, Type};

/// Draws fibres into the colour of wood: streaks from 0.05 to 1.3 mm wide, drifts of tone over many centimetres, and
/// streaks of pigment.
///
/// Dark fibres are not grey: more of the same pigment makes wood darker and warmer. `tint` sets this hue.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(stops: [(0, "#75543b"), (0.4, "#795840"), (0.93, "#62442f"), (1, "#6e4e37")]),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "fiber": FiberSpace(time: "time", tree: "tree"),
/// "streaked": FiberStreaks(color: "wood", fiber: "fiber", fine: 0.1, coarse: 0.1, streak: 0.55, streak_color: "#4a3226"),
/// "example": CutPlane(solid: "streaked", preset: FlatSawn, distance: 30),
/// ```
#[node]
pub struct FiberStreaks {
    /// The colour to draw on.
    pub color: In<SolidColor>,
    /// Coordinates along the fibres: the output `place` of `FiberSpace`.
    pub fiber: In<SolidVector>,
    /// Differences of tone between single fibres.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.08)]
    pub fine: f64,
    /// Differences of tone between bundles of fibres.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.06)]
    pub coarse: f64,
    /// Drift of tone over the board.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.06)]
    pub drift: f64,
    /// Strength of streaks of pigment.
    #[schemars(range(min = 0, max = 1))]
    pub streak: f64,
    /// The colour of pigment.
    #[default(Color::srgb([0x4a, 0x32, 0x26]))]
    pub streak_color: Color,
    /// The hue of fibres as they become darker, mostly that of late wood; if not given, they only become darker.
    pub tint: Option<Color>,
    /// Depth of fibres in the surface.
    #[schemars(range(min = 0, max = 1), extend("unit" = "mm"))]
    #[default(0.006)]
    pub depth: f64,
    /// Another seed gives other streaks of the same kind.
    pub seed: u64,
}

/// Layers of streaks: width and length in mm, and relative strength.
const FINE: [(f32, f32, f32); 4] = [(0.16, 7.0, 0.75), (0.34, 16.0, 0.65), (0.06, 2.5, 0.8), (0.1, 4.5, 0.8)];
const COARSE: [(f32, f32, f32); 2] = [(0.9, 42.0, 0.7), (2.4, 110.0, 0.7)];

/// Scales `fine` to the standard deviation of tone between fibres as measured in pictures of wood (1 to 4 waves per
/// mm).
const FINE_GAIN: f32 = 5.0;

/// Adds a layer of streaks.
#[inline(always)]
fn add(at: [&[f32]; 3], pixel: f32, noise: Noise3, layer: (f32, f32, f32), to: &mut [f32], fade: bool) {
    let (width, length, strength) = layer;
    let seen = if fade { visible(width * 2.0, pixel) } else { 1.0 } * strength;
    if seen > 0.0 {
        let scale = [1.0 / width, 1.0 / width, 1.0 / length];
        noise.each(at, scale, 0.0, to, |to, v| to + seen * v);
    }
}

/// The exponents of tone for red, green and blue: Beer's law for a pigment of this colour, with the luminance kept.
fn powers(tint: Option<Color>) -> Option<[f32; 3]> {
    let absorbed = tint?.0.map(|c| -math::log2(c.clamp(0.004, 0.98)));
    let mean = 0.2126 * absorbed[0] + 0.7152 * absorbed[1] + 0.0722 * absorbed[2];
    Some(absorbed.map(|a| a / mean))
}

struct Streaks {
    noise: [Noise3; 10],
    fine: f32,
    coarse: f32,
    drift: f32,
    streak: f32,
}

impl Streaks {
    /// The relief of fibres (±1), the tone (a factor), and the amount of pigment.
    fn fill(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]) {
        let [x, y, z] = [0, 1, 2].map(|c| inputs[0].plane(c));
        let [relief, tone, pigment] = out else { return };
        relief.fill(0.0);
        tone.fill(0.0);
        pigment.fill(0.0);
        dispatch(
            #[inline(always)]
            || {
                let at = [x, y, z];
                for (layer, n) in FINE.into_iter().zip([0, 1, 8, 9]) {
                    add(at, patch.pixel, self.noise[n], layer, relief, true);
                }
                for (layer, noise) in COARSE.into_iter().zip(&self.noise[2..]) {
                    add(at, patch.pixel, *noise, layer, tone, true);
                }
                if self.streak > 0.0 {
                    add(at, patch.pixel, self.noise[4], (3.4, 260.0, 1.0), pigment, false);
                    add(at, patch.pixel, self.noise[5], (11.0, 420.0, 1.1), pigment, false);
                    pigment.iter_mut().for_each(|p| *p = self.streak * math::smooth((*p - 0.02) * 1.9));
                }
                // Dark streaks are stronger than light ones.
                for (tone, relief) in tone.iter_mut().zip(relief.iter()) {
                    let all = FINE_GAIN * self.fine * relief + 2.2 * self.coarse * *tone;
                    *tone = if all < 0.0 { 1.35 * all } else { 0.75 * all };
                }
                if self.drift > 0.0 {
                    let strength = self.drift * 1.8;
                    add(at, patch.pixel, self.noise[6], (19.0, 300.0, strength), tone, false);
                    add(at, patch.pixel, self.noise[7], (50.0, 160.0, strength * 0.7), tone, false);
                }
                tone.iter_mut().for_each(|t| *t = math::exp(*t));
            },
        );
    }
}

impl Node for FiberStreaks {
    const VERSION: u32 = 3;
    const OUTPUTS: &'static [Output] = &[
        Output::new("color", Type::SolidColor, "The colour with its streaks."),
        Output::new("height", Type::Solid, "The relief of the fibres.").in_unit("mm"),
        Output::new("tone", Type::Solid, "By how much fibres make wood lighter or darker, around 1."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (color, fiber) = (cx.get(&self.color)?, cx.get(&self.fiber)?);
        let hash = Hash::new(cx.seed(self.seed));
        let streaks = Streaks {
            noise: std::array::from_fn(|i| Noise3::new(hash, i as u64)),
            fine: narrow(self.fine),
            coarse: narrow(self.coarse),
            drift: narrow(self.drift),
            streak: narrow(self.streak),
        };
        let code = Code::of_inputs(move |patch, inputs, out| streaks.fill(patch, inputs, out)).kept();
        let all = Solid::new(Type::SolidVector, vec![fiber], code);
        let all = cx.shared("all", all);
        let (dye, powers) = (self.streak_color.0, powers(self.tint));
        let paint = Code::of_inputs(move |_, inputs, out| {
            let (tone, pigment) = (inputs[1].plane(1), inputs[1].plane(2));
            for (c, plane) in out.iter_mut().enumerate() {
                for (((out, color), tone), pigment) in plane.iter_mut().zip(inputs[0].plane(c)).zip(tone).zip(pigment) {
                    // Pigment shows its colour, with some of the contrast of the rings.
                    *out = math::lerp(*color, dye[c] * 0.55 + 0.45 * *color, *pigment);
                    if powers.is_none() {
                        *out *= *tone;
                    }
                }
                if let Some(powers) = powers {
                    let power = powers[c];
                    dispatch(
                        #[inline(always)]
                        || plane.iter_mut().zip(tone).for_each(|(out, tone)| *out *= math::pow(*tone, power)),
                    );
                }
            }
        });
        let depth = narrow(self.depth);
        let relief = Code::of_inputs(move |_, inputs, out| {
            out[0].iter_mut().zip(inputs[0].plane(0)).for_each(|(out, r)| *out = depth * r);
        });
        Ok(Outputs::one(paint.solid(Type::SolidColor, vec![color, all.clone()]))
            .with("height", relief.solid(Type::Solid, vec![all.clone()]))
            .with("tone", all.channel(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tint_turns_dark_fibres_to_its_hue_and_keeps_their_lightness() {
        assert_eq!(powers(None), None);
        let grey = powers(Some(Color([0.2; 3]))).unwrap();
        assert!(grey.iter().all(|p| (p - 1.0).abs() < 1e-5), "{grey:?}");
        let brown = powers(Some(Color([0.25, 0.1, 0.03]))).unwrap();
        let dark = brown.map(|p| 0.8_f32.powf(p));
        assert!(dark[0] > dark[1] && dark[1] > dark[2], "{dark:?}");
        let light = 0.2126 * dark[0] + 0.7152 * dark[1] + 0.0722 * dark[2];
        assert!((light - 0.8).abs() < 0.02, "{light}");
        // No colour causes a division by zero.
        assert!(powers(Some(Color([1.0; 3]))).unwrap().iter().all(|p| p.is_finite()));
    }
}
