//! Point-wise changes of tone: levels, remapping, thresholds and gradient maps.

use crate::ground::math::{self, lerp, max, saturate, smooth};
use crate::ground::simd;
use shibo_macros::choice;

/// out = f(input), eight at a time.
#[inline(always)]
pub(crate) fn map(input: &[f32], out: &mut [f32], f: impl Fn(f32) -> f32) {
    for (out, x) in out.iter_mut().zip(input) {
        *out = f(*x);
    }
}

/// Parameters of [`levels`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// The input for black and white; equal or reversed numbers are allowed (a step, an inversion).
    pub input: [f32; 2],
    /// The exponent is 1/gamma: values above 1 brighten the midtones. > 0.
    pub gamma: f32,
    /// The output for black and white.
    pub output: [f32; 2],
}

/// Maps the input range to 0..1 and clamps it, applies gamma, and maps it to the output range.
pub fn levels(input: &[f32], out: &mut [f32], spec: &Levels) {
    let [low, high] = spec.input;
    let scale = inverse(high - low);
    let (exponent, [black, white]) = (1.0 / spec.gamma, spec.output);
    simd::dispatch(
        #[inline(always)]
        || {
            if spec.gamma == 1.0 {
                map(input, out, |x| lerp(black, white, saturate((x - low) * scale)));
            } else {
                map(input, out, |x| lerp(black, white, math::pow(saturate((x - low) * scale), exponent)));
            }
        },
    );
}

/// 1/x; for 0 and nearby numbers a number so large that the result is a step.
pub(super) fn inverse(x: f32) -> f32 {
    if x.abs() < 1e-30 { 1e30 } else { 1.0 / x }
}

/// Multiplies all values by `factor`.
pub fn scale(plane: &mut [f32], factor: f32) {
    simd::dispatch(
        #[inline(always)]
        || {
            for x in plane {
                *x *= factor;
            }
        },
    );
}

/// Maps the range `from` linearly to the range `to`, clamped to it if `limit`.
pub fn remap(input: &[f32], out: &mut [f32], from: [f32; 2], to: [f32; 2], limit: bool) {
    let scale = inverse(from[1] - from[0]);
    simd::dispatch(
        #[inline(always)]
        || {
            if limit {
                map(input, out, |x| lerp(to[0], to[1], saturate((x - from[0]) * scale)));
            } else {
                map(input, out, |x| lerp(to[0], to[1], (x - from[0]) * scale));
            }
        },
    );
}

/// 1 - x.
pub fn invert(input: &[f32], out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || map(input, out, |x| 1.0 - x),
    );
}

/// 0 below and 1 above `level`, with a smooth step of width `softness`; 0 is a hard edge.
pub fn threshold(input: &[f32], out: &mut [f32], level: f32, softness: f32) {
    simd::dispatch(
        #[inline(always)]
        || {
            if softness > 0.0 {
                map(input, out, |x| smooth((x - level) / softness + 0.5));
            } else {
                map(input, out, |x| if x > level { 1.0 } else { 0.0 });
            }
        },
    );
}

/// 0 at `edges[0]`, 1 at `edges[1]`, and a cubic step between; reversed edges give a falling step.
pub fn smoothstep(input: &[f32], out: &mut [f32], edges: [f32; 2]) {
    let scale = inverse(edges[1] - edges[0]);
    simd::dispatch(
        #[inline(always)]
        || map(input, out, |x| smooth((x - edges[0]) * scale)),
    );
}

/// The interpolation of colours between stops.
#[choice]
pub enum Interpolation {
    /// Straight lines.
    #[default]
    Linear,
    /// Smooth, with zero slope at the stops.
    Smooth,
    /// The colour of the previous stop, with hard edges.
    Constant,
}

/// A colour gradient, computed without a table: exact at the stops and without banding.
#[derive(Clone, Debug)]
pub struct Gradient {
    first: [f32; 3],
    /// Position, reciprocal length and change of colour of each section.
    sections: Vec<(f32, f32, [f32; 3])>,
    interpolation: Interpolation,
    oklab: bool,
}

impl Gradient {
    /// `stops` are positions (ascending) and linear-light colours; `oklab` interpolates in that space (perceptually
    /// uniform) rather than in linear light.
    pub fn new(stops: &[(f32, [f32; 3])], interpolation: Interpolation, oklab: bool) -> Self {
        let color = |c: [f32; 3]| if oklab { linear_to_oklab(c) } else { c };
        let sections = stops.windows(2).map(|s| {
            let (from, to) = (color(s[0].1), color(s[1].1));
            let change = [0, 1, 2].map(|k| to[k] - from[k]);
            if interpolation == Interpolation::Constant {
                (s[1].0, 0.0, change)
            } else {
                (s[0].0, inverse(s[1].0 - s[0].0), change)
            }
        });
        Self {
            first: stops.first().map_or([0.0; 3], |s| color(s.1)),
            sections: sections.collect(),
            interpolation,
            oklab,
        }
    }

    /// Maps `input` to linear-light planes.
    pub fn apply(&self, input: &[f32], out: [&mut [f32]; 3]) {
        simd::dispatch(
            #[inline(always)]
            || match (self.interpolation, self.oklab) {
                (Interpolation::Linear, false) => self.fill::<0, false>(input, out),
                (Interpolation::Linear, true) => self.fill::<0, true>(input, out),
                (Interpolation::Smooth, false) => self.fill::<1, false>(input, out),
                (Interpolation::Smooth, true) => self.fill::<1, true>(input, out),
                (Interpolation::Constant, false) => self.fill::<2, false>(input, out),
                (Interpolation::Constant, true) => self.fill::<2, true>(input, out),
            },
        );
    }

    #[inline(always)]
    fn fill<const MODE: u8, const OKLAB: bool>(&self, input: &[f32], out: [&mut [f32]; 3]) {
        const BLOCK: usize = 64;
        let [red, green, blue] = out;
        let planes = red.chunks_mut(BLOCK).zip(green.chunks_mut(BLOCK)).zip(blue.chunks_mut(BLOCK));
        for (input, ((red, green), blue)) in input.chunks(BLOCK).zip(planes) {
            let n = input.len();
            let mut x = [0.0; BLOCK];
            x[..n].copy_from_slice(input);
            let mut c = self.first.map(|c| [c; BLOCK]);
            for (start, scale, change) in &self.sections {
                for k in 0..BLOCK {
                    let t = match MODE {
                        0 => saturate((x[k] - start) * scale),
                        1 => smooth((x[k] - start) * scale),
                        _ => {
                            if x[k] >= *start {
                                1.0
                            } else {
                                0.0
                            }
                        }
                    };
                    for (c, change) in c.iter_mut().zip(change) {
                        c[k] += change * t;
                    }
                }
            }
            if OKLAB {
                let [l, a, b] = &mut c;
                for ((l, a), b) in l.iter_mut().zip(a).zip(b) {
                    [*l, *a, *b] = oklab_to_linear([*l, *a, *b]);
                }
            }
            red.copy_from_slice(&c[0][..n]);
            green.copy_from_slice(&c[1][..n]);
            blue.copy_from_slice(&c[2][..n]);
        }
    }
}

/// Linear light (Rec. 709 primaries) to Oklab (B. Ottosson, 2020).
#[inline]
pub fn linear_to_oklab([r, g, b]: [f32; 3]) -> [f32; 3] {
    let l = libm::cbrtf(0.412_221_46 * r + 0.536_332_55 * g + 0.051_445_995 * b);
    let m = libm::cbrtf(0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b);
    let s = libm::cbrtf(0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b);
    [
        0.210_454_26 * l + 0.793_617_8 * m - 0.004_072_047 * s,
        1.977_998_5 * l - 2.428_592_2 * m + 0.450_593_7 * s,
        0.025_904_037 * l + 0.782_771_77 * m - 0.808_675_77 * s,
    ]
}

/// Oklab to linear light; components outside the gamut are clamped to 0.
#[inline(always)]
pub fn oklab_to_linear([l, a, b]: [f32; 3]) -> [f32; 3] {
    let cube = |x: f32| x * x * x;
    let (x, y, z) = (
        cube(l + 0.396_337_78 * a + 0.215_803_76 * b),
        cube(l - 0.105_561_346 * a - 0.063_854_17 * b),
        cube(l - 0.089_484_18 * a - 1.291_485_5 * b),
    );
    [
        max(4.076_741_7 * x - 3.307_711_6 * y + 0.230_969_94 * z, 0.0),
        max(-1.268_438 * x + 2.609_757_4 * y - 0.341_319_4 * z, 0.0),
        max(-0.004_196_086_3 * x - 0.703_418_6 * y + 1.707_614_7 * z, 0.0),
    ]
}

/// Linear light to the sRGB encoding.
pub fn encode_srgb(input: &[f32], out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || map(input, out, math::srgb_encode),
    );
}

/// The sRGB encoding to linear light.
pub fn decode_srgb(input: &[f32], out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || map(input, out, math::srgb_decode),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramps_hit_their_stops() {
        let stops = [(0.0, [0.1, 0.2, 0.3]), (0.4, [0.9, 0.5, 0.0]), (1.0, [0.3, 0.3, 0.8])];
        for interpolation in [Interpolation::Linear, Interpolation::Smooth, Interpolation::Constant] {
            for oklab in [false, true] {
                let gradient = Gradient::new(&stops, interpolation, oklab);
                let [mut r, mut g, mut b] = [[9.0; 5]; 3];
                gradient.apply(&[-1.0, 0.0, 0.4, 1.0, 7.0], [&mut r, &mut g, &mut b]);
                for (k, stop) in [0, 0, 1, 2, 2].into_iter().enumerate() {
                    let want = stops[stop].1;
                    for (got, want) in [r[k], g[k], b[k]].into_iter().zip(want) {
                        assert!((got - want).abs() < 2e-4, "{interpolation:?} {oklab} {k} {got} {want}");
                    }
                }
            }
        }
    }

    #[test]
    fn levels_and_steps() {
        let x = [0.0, 0.2, 0.5, 0.8, 1.0];
        let mut out = [0.0; 5];
        levels(&x, &mut out, &Levels { input: [0.2, 0.8], gamma: 2.0, output: [1.0, 0.0] });
        assert!((out[2] - (1.0 - 0.5f32.sqrt())).abs() < 1e-6 && out[0] == 1.0 && out[4] == 0.0);
        remap(&x, &mut out, [0.0, 0.5], [1.0, 3.0], false);
        assert_eq!(out[4], 5.0);
        threshold(&x, &mut out, 0.5, 0.0);
        assert_eq!(out, [0.0, 0.0, 0.0, 1.0, 1.0]);
    }
}
