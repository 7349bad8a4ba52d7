//! Colour spaces, and adjustments of colours within them.
//!
//! Everything is relative to the white of sRGB (D65). HSV, HSL and YCbCr are defined on sRGB-encoded values, the other
//! spaces on linear light. Hues are degrees, 0..360; 0 for colours without a hue.

use super::tone::{linear_to_oklab, oklab_to_linear};
use crate::ground::math::{atan2_degrees, clamp, cos_degrees, max, min, pow, saturate, sin_degrees, smooth};
use crate::ground::math::{srgb_decode, srgb_encode};
use crate::ground::simd;
use shibo_macros::choice;

/// The meaning of the three numbers of a colour.
#[choice]
pub enum ColorSpace {
    /// Red, green, blue, linear: the colours on wires
    #[default]
    Linear,
    /// Red, green, blue, 0..1, encoded by the sRGB curve: shown as 0..255 in picture editors
    Srgb,
    /// Hue 0..360°, saturation 0..1, value 0..1, of encoded values
    Hsv,
    /// Hue 0..360°, saturation 0..1, lightness 0..1, of encoded values
    Hsl,
    /// Luma 0..1, blue and red difference -½..½, of encoded values (Rec. 709)
    YCbCr,
    /// CIE XYZ; white is (0.9505, 1, 1.0888)
    Xyz,
    /// CIE Lab: lightness 0..100, a green to red, b blue to yellow
    Lab,
    /// CIE Lab as lightness 0..100, chroma, hue 0..360°
    Lch,
    /// Oklab: lightness 0..1, a green to red, b blue to yellow; perceptually uniform
    Oklab,
    /// Oklab as lightness 0..1, chroma, hue 0..360°
    Oklch,
}

impl ColorSpace {
    /// True if the space is defined on encoded values.
    const fn encoded(self) -> bool {
        matches!(self, Self::Srgb | Self::Hsv | Self::Hsl | Self::YCbCr)
    }
}

const BLOCK: usize = 128;
type Block = [[f32; BLOCK]; 3];

#[inline(always)]
fn each(block: &mut Block, f: impl Fn([f32; 3]) -> [f32; 3]) {
    let [a, b, c] = block;
    for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
        [*a, *b, *c] = f([*a, *b, *c]);
    }
}

/// Runs `f` on all values of a block of three planes. Loops over one plane vectorise more reliably.
#[inline(always)]
fn each_value(block: &mut Block, f: impl Fn(f32) -> f32) {
    for plane in block {
        plane.iter_mut().for_each(|v| *v = f(*v));
    }
}

/// Runs `f` on colours, a block at a time.
#[inline(always)]
fn blocks(input: [&[f32]; 3], out: [&mut [f32]; 3], f: impl Fn(&mut Block, usize)) {
    let [r, g, b] = out;
    let mut start = 0;
    for ((r, g), b) in r.chunks_mut(BLOCK).zip(g.chunks_mut(BLOCK)).zip(b.chunks_mut(BLOCK)) {
        let n = r.len();
        let mut block = [[0.0; BLOCK]; 3];
        for (block, input) in block.iter_mut().zip(input) {
            block[..n].copy_from_slice(&input[start..start + n]);
        }
        f(&mut block, start);
        for (out, block) in [r, g, b].into_iter().zip(&block) {
            out.copy_from_slice(&block[..n]);
        }
        start += n;
    }
}

/// Converts colours from one space to another.
///
/// # Panics
/// If the planes differ in length.
pub fn convert(from: ColorSpace, to: ColorSpace, input: [&[f32]; 3], out: [&mut [f32]; 3]) {
    simd::dispatch(
        #[inline(always)]
        || {
            blocks(input, out, |block, _| {
                if from == to {
                    return;
                }
                to_rgb(from, block);
                match (from.encoded(), to.encoded()) {
                    (true, false) => each_value(block, srgb_decode),
                    (false, true) => each_value(block, srgb_encode),
                    _ => {}
                }
                from_rgb(to, block);
            });
        },
    );
}

/// Converts to red, green and blue, encoded like the space.
#[inline(always)]
fn to_rgb(from: ColorSpace, block: &mut Block) {
    match from {
        ColorSpace::Linear | ColorSpace::Srgb => {}
        ColorSpace::Hsv => each(block, hsv_to_rgb),
        ColorSpace::Hsl => each(block, hsl_to_rgb),
        ColorSpace::YCbCr => each(block, ycbcr_to_rgb),
        ColorSpace::Xyz => each(block, xyz_to_linear),
        ColorSpace::Lab => each(block, |c| xyz_to_linear(lab_to_xyz(c))),
        ColorSpace::Lch => each(block, |c| xyz_to_linear(lab_to_xyz(from_polar(c)))),
        ColorSpace::Oklab => each(block, oklab_to_linear),
        ColorSpace::Oklch => each(block, |c| oklab_to_linear(from_polar(c))),
    }
}

#[inline(always)]
fn from_rgb(to: ColorSpace, block: &mut Block) {
    match to {
        ColorSpace::Linear | ColorSpace::Srgb => {}
        ColorSpace::Hsv => each(block, rgb_to_hsv),
        ColorSpace::Hsl => each(block, rgb_to_hsl),
        ColorSpace::YCbCr => each(block, rgb_to_ycbcr),
        ColorSpace::Xyz => each(block, linear_to_xyz),
        ColorSpace::Lab => each(block, |c| xyz_to_lab(linear_to_xyz(c))),
        ColorSpace::Lch => each(block, |c| to_polar(xyz_to_lab(linear_to_xyz(c)))),
        ColorSpace::Oklab => each(block, linear_to_oklab),
        ColorSpace::Oklch => each(block, |c| to_polar(linear_to_oklab(c))),
    }
}

/// `x` modulo `period`.
#[inline(always)]
fn wrapped(x: f32, period: f32) -> f32 {
    let x = clamp(x, -1e6, 1e6);
    let rest = x - period * (x / period).floor();
    if rest >= period { rest - period } else { rest }
}

#[inline(always)]
fn hue([r, g, b]: [f32; 3], high: f32, chroma: f32) -> f32 {
    let part = |d: f32| if chroma > 0.0 { d / chroma } else { 0.0 };
    let red = part(g - b);
    let red = if red < 0.0 { red + 6.0 } else { red };
    let h = if b >= high { 4.0 + part(r - g) } else { 0.0 };
    let h = if g >= high { 2.0 + part(b - r) } else { h };
    let h = if r >= high { red } else { h };
    if chroma > 0.0 { 60.0 * h } else { 0.0 }
}

/// Hue in degrees, saturation and value; negative components count as 0.
#[inline(always)]
pub fn rgb_to_hsv(color: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = color.map(|c| max(c, 0.0));
    let (high, low) = (max(r, max(g, b)), min(r, min(g, b)));
    let chroma = high - low;
    let saturation = if high > 0.0 { chroma / high } else { 0.0 };
    [hue([r, g, b], high, chroma), saturation, high]
}

/// The inverse of [`rgb_to_hsv`]. The hue may be any angle.
#[inline(always)]
pub fn hsv_to_rgb([hue, saturation, value]: [f32; 3]) -> [f32; 3] {
    let sixth = wrapped(hue, 360.0) * (1.0 / 60.0);
    let chroma = value * saturation;
    let part = |n: f32| {
        let k = n + sixth;
        let k = if k >= 6.0 { k - 6.0 } else { k };
        value - chroma * max(0.0, min(1.0, min(k, 4.0 - k)))
    };
    [part(5.0), part(3.0), part(1.0)]
}

#[inline(always)]
fn rgb_to_hsl(color: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = color.map(|c| max(c, 0.0));
    let (high, low) = (max(r, max(g, b)), min(r, min(g, b)));
    let (chroma, lightness) = (high - low, 0.5 * (high + low));
    let room = 1.0 - (2.0 * lightness - 1.0).abs();
    let saturation = if room > 1e-6 { chroma / room } else { 0.0 };
    [hue([r, g, b], high, chroma), saturation, lightness]
}

#[inline(always)]
fn hsl_to_rgb([hue, saturation, lightness]: [f32; 3]) -> [f32; 3] {
    let chroma = saturation * max(1.0 - (2.0 * lightness - 1.0).abs(), 0.0);
    let value = lightness + 0.5 * chroma;
    hsv_to_rgb([hue, if value > 0.0 { chroma / value } else { 0.0 }, value])
}

#[inline(always)]
fn rgb_to_ycbcr([r, g, b]: [f32; 3]) -> [f32; 3] {
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    [y, (b - y) * (1.0 / 1.8556), (r - y) * (1.0 / 1.5748)]
}

#[inline(always)]
fn ycbcr_to_rgb([y, cb, cr]: [f32; 3]) -> [f32; 3] {
    let (r, b) = (y + 1.5748 * cr, y + 1.8556 * cb);
    [r, (y - 0.2126 * r - 0.0722 * b) * (1.0 / 0.7152), b]
}

/// White in XYZ.
const WHITE: [f32; 3] = [0.950_47, 1.0, 1.088_83];

#[inline(always)]
fn linear_to_xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b,
        0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b,
        0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b,
    ]
}

#[inline(always)]
fn xyz_to_linear([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ]
}

/// Value at which the cube root of Lab becomes a line, and the slope of that line.
const EPSILON: f32 = 216.0 / 24389.0;
const KAPPA: f32 = 24389.0 / 27.0;

#[inline(always)]
fn xyz_to_lab(xyz: [f32; 3]) -> [f32; 3] {
    let f = |t: f32| if t > EPSILON { pow(t, 1.0 / 3.0) } else { (KAPPA * t + 16.0) * (1.0 / 116.0) };
    let [x, y, z] = [f(xyz[0] / WHITE[0]), f(xyz[1] / WHITE[1]), f(xyz[2] / WHITE[2])];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

#[inline(always)]
fn lab_to_xyz([l, a, b]: [f32; 3]) -> [f32; 3] {
    let y = (l + 16.0) * (1.0 / 116.0);
    let f = |t: f32| if t * t * t > EPSILON { t * t * t } else { (116.0 * t - 16.0) * (1.0 / KAPPA) };
    [WHITE[0] * f(y + a * (1.0 / 500.0)), WHITE[1] * f(y), WHITE[2] * f(y - b * (1.0 / 200.0))]
}

#[inline(always)]
fn to_polar([l, a, b]: [f32; 3]) -> [f32; 3] {
    let angle = atan2_degrees(b, a);
    [l, (a * a + b * b).sqrt(), if angle < 0.0 { angle + 360.0 } else { angle }]
}

#[inline(always)]
fn from_polar([l, chroma, hue]: [f32; 3]) -> [f32; 3] {
    [l, chroma * cos_degrees(hue), chroma * sin_degrees(hue)]
}

/// Turns the hue of linear colours by `turn` degrees and multiplies saturation and value, on encoded values. Saturation
/// is limited to 1.
///
/// # Panics
/// If the planes differ in length.
pub fn adjust_hsv(input: [&[f32]; 3], [turn, saturation, value]: [&[f32]; 3], out: [&mut [f32]; 3]) {
    simd::dispatch(
        #[inline(always)]
        || {
            blocks(input, out, |block, start| {
                let n = BLOCK.min(turn.len() - start);
                let part = |plane: &[f32]| {
                    let mut part = [0.0; BLOCK];
                    part[..n].copy_from_slice(&plane[start..start + n]);
                    part
                };
                let (turn, saturation, value) = (part(turn), part(saturation), part(value));
                each_value(block, srgb_encode);
                each(block, rgb_to_hsv);
                let [h, s, v] = &mut *block;
                for k in 0..BLOCK {
                    h[k] += turn[k];
                    s[k] = saturate(s[k] * saturation[k]);
                    v[k] = max(v[k] * value[k], 0.0);
                }
                each(block, hsv_to_rgb);
                each_value(block, srgb_decode);
            });
        },
    );
}

/// Parameters of [`replace`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replace {
    /// The colour to replace, linear.
    pub from: [f32; 3],
    /// The new colour, linear.
    pub to: [f32; 3],
    /// Distance in Oklab up to which a colour is replaced completely.
    pub tolerance: f32,
    /// The additional distance beyond which a colour is unchanged.
    pub softness: f32,
    /// True to keep the difference of a colour from `from`.
    pub keep_shading: bool,
}

/// The replaced fraction of each colour, 0..1.
///
/// # Panics
/// If the planes differ in length.
pub fn likeness(input: [&[f32]; 3], spec: &Replace, out: &mut [f32]) {
    let from = linear_to_oklab(spec.from);
    let [r, g, b] = input;
    for (k, out) in out.iter_mut().enumerate() {
        *out = weight(linear_to_oklab([r[k], g[k], b[k]]), from, spec);
    }
}

#[inline(always)]
fn weight(color: [f32; 3], from: [f32; 3], spec: &Replace) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|k| color[k] - from[k]);
    let beyond = (x * x + y * y + z * z).sqrt() - spec.tolerance;
    if spec.softness > 0.0 { 1.0 - smooth(beyond / spec.softness) } else { f32::from(u8::from(beyond <= 0.0)) }
}

/// Replaces colours similar to one colour by another.
///
/// # Panics
/// If the planes differ in length.
pub fn replace(input: [&[f32]; 3], spec: &Replace, out: [&mut [f32]; 3]) {
    let (from, to) = (linear_to_oklab(spec.from), linear_to_oklab(spec.to));
    blocks(input, out, |block, _| {
        each(block, |color| {
            let lab = linear_to_oklab(color);
            let w = weight(lab, from, spec);
            let goal = if spec.keep_shading { from.map(|c| -c) } else { lab.map(|c| -c) };
            // Unchanged colours keep their exact bits.
            if w == 0.0 { color } else { oklab_to_linear([0, 1, 2].map(|k| lab[k] + (to[k] + goal[k]) * w)) }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(from: ColorSpace, to: ColorSpace, color: [f32; 3]) -> [f32; 3] {
        let [mut a, mut b, mut c] = [[0.0]; 3];
        convert(from, to, [&[color[0]], &[color[1]], &[color[2]]], [&mut a, &mut b, &mut c]);
        [a[0], b[0], c[0]]
    }

    fn close(a: [f32; 3], b: [f32; 3], within: f32) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= within)
    }

    #[test]
    fn known_colours() {
        use ColorSpace as C;
        // The primaries of sRGB, with values from tables of colour science.
        assert!(close(one(C::Linear, C::Lab, [1.0, 0.0, 0.0]), [53.24, 80.09, 67.20], 0.02));
        assert!(close(one(C::Linear, C::Lab, [0.0, 0.0, 1.0]), [32.30, 79.19, -107.86], 0.02));
        assert!(close(one(C::Linear, C::Lab, [1.0; 3]), [100.0, 0.0, 0.0], 0.01));
        assert!(close(one(C::Linear, C::Oklab, [1.0, 0.0, 0.0]), [0.62796, 0.22486, 0.12585], 1e-4));
        assert!(close(one(C::Srgb, C::Linear, [0.5; 3]), [0.21404; 3], 1e-5));
        assert!(close(one(C::Srgb, C::Hsv, [0.0, 0.5, 1.0]), [210.0, 1.0, 1.0], 1e-4));
        assert!(close(one(C::Srgb, C::Hsl, [0.75, 0.25, 0.25]), [0.0, 0.5, 0.5], 1e-5));
        assert!(close(one(C::Hsv, C::Srgb, [300.0, 0.5, 0.8]), [0.8, 0.4, 0.8], 1e-6));
        assert!(close(one(C::Hsv, C::Srgb, [-60.0, 1.0, 1.0]), [1.0, 0.0, 1.0], 1e-6));
        assert!(close(one(C::Srgb, C::YCbCr, [1.0, 0.0, 0.0]), [0.2126, -0.114_572, 0.5], 1e-5));
        assert!(close(one(C::Linear, C::Lch, [0.0, 0.0, 1.0]), [32.30, 133.81, 306.28], 0.02));
        assert!(close(one(C::Linear, C::Xyz, [1.0; 3]), [0.95047, 1.0, 1.08883], 1e-5));
    }

    #[test]
    fn conversions_round_trip() {
        use ColorSpace as C;
        let spaces = [C::Linear, C::Srgb, C::Hsv, C::Hsl, C::YCbCr, C::Xyz, C::Lab, C::Lch, C::Oklab, C::Oklch];
        let colors = [[0.2, 0.5, 0.1], [0.9, 0.02, 0.6], [0.0; 3], [1.0; 3], [0.3, 0.3, 0.3], [0.0, 1.0, 1.0]];
        for space in spaces {
            for color in colors {
                let back = one(space, C::Linear, one(C::Linear, space, color));
                assert!(close(back, color, 2e-4), "{space:?}: {color:?} came back as {back:?}");
            }
        }
        assert_eq!(one(C::Lab, C::Lab, [7.0, -3.0, 2.0]), [7.0, -3.0, 2.0]);
    }

    #[test]
    fn hue_turns_and_factors_multiply() {
        let adjust = |color: [f32; 3], change: [f32; 3]| {
            let [mut a, mut b, mut c] = [[0.0]; 3];
            adjust_hsv(
                [&[color[0]], &[color[1]], &[color[2]]],
                [&[change[0]], &[change[1]], &[change[2]]],
                [&mut a, &mut b, &mut c],
            );
            [a[0], b[0], c[0]]
        };
        assert!(close(adjust([1.0, 0.0, 0.0], [120.0, 1.0, 1.0]), [0.0, 1.0, 0.0], 1e-5));
        assert!(close(adjust([1.0, 0.0, 0.0], [-480.0, 1.0, 1.0]), [0.0, 0.0, 1.0], 1e-5));
        assert!(close(adjust([1.0, 0.0, 0.0], [0.0, 0.0, 0.5]), [0.214_04; 3], 1e-5));
        assert!(close(adjust([0.3, 0.6, 0.1], [0.0, 1.0, 1.0]), [0.3, 0.6, 0.1], 1e-5));
    }
}
