//! Layers of materials: visibility of the upper layer, and blending of the channels of two layers.
//!
//! A weight of 0 shows the base, 1 the top layer. Heights are in mm, normals are stored as ½ + ½n.

use super::combine_normals::{NormalBlend, combine};
use crate::ground::math::{atan2_degrees, cos_degrees, lerp, max, saturate, sin_degrees, smooth};
use crate::ground::simd::{self, inlined};
use shibo_macros::choice;

/// Blending of two layers by their heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByHeight {
    /// Height difference over which one layer fades into the other, mm; 0 is a sharp edge.
    pub contrast: f32,
    /// Added to the top layer's height, mm.
    pub offset: f32,
    /// Height difference that the mask can outweigh, mm.
    pub range: f32,
}

impl ByHeight {
    /// `smoothstep(-c/2, c/2, top + offset - base + (2·mask - 1)·(range + c/2))` with c = `contrast`; 0 where the mask
    /// is 0, 1 where it is 1.
    #[inline(always)]
    fn weight(&self, mask: f32, base: f32, top: f32) -> f32 {
        let mask = saturate(mask);
        let half = 0.5 * self.contrast;
        let above = top + self.offset - base + (2.0 * mask - 1.0) * (self.range + half);
        let sharp = if above >= 0.0 { 1.0 } else { 0.0 };
        let soft = smooth(saturate((above + half) / max(self.contrast, f32::MIN_POSITIVE)));
        let weight = if self.contrast > 0.0 { soft } else { sharp };
        if mask <= 0.0 {
            0.0
        } else if mask >= 1.0 {
            1.0
        } else {
            weight
        }
    }

    /// The weight of the top layer, from its `mask` and both heights.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn weights(&self, mask: &[f32], base: &[f32], top: &[f32], out: &mut [f32]) {
        assert!(mask.len() == out.len() && base.len() == out.len() && top.len() == out.len());
        simd::dispatch(
            #[inline(always)]
            || {
                for (out, (mask, (base, top))) in out.iter_mut().zip(mask.iter().zip(base.iter().zip(top))) {
                    *out = self.weight(*mask, *base, *top);
                }
            },
        );
    }
}

/// The smallest and the largest value; `(∞, -∞)` if there are none.
pub fn bounds(values: &[f32]) -> (f32, f32) {
    simd::dispatch(
        #[inline(always)]
        || {
            let (mut low, mut high) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
            let chunks = values.chunks_exact(8);
            let rest = chunks.remainder();
            for chunk in chunks {
                for i in 0..8 {
                    low[i] = if chunk[i] < low[i] { chunk[i] } else { low[i] };
                    high[i] = if chunk[i] > high[i] { chunk[i] } else { high[i] };
                }
            }
            let low = rest.iter().chain(&low).fold(f32::INFINITY, |a, b| a.min(*b));
            let high = rest.iter().chain(&high).fold(f32::NEG_INFINITY, |a, b| a.max(*b));
            (low, high)
        },
    )
}

/// `lerp(base, top, weight)`, exactly `base` and `top` at both ends.
#[inline(always)]
fn mix(base: f32, top: f32, weight: f32) -> f32 {
    let between = lerp(base, top, weight);
    if weight >= 1.0 { top } else { between }
}

/// Blends values by a weight.
///
/// # Panics
/// If the slices differ in length.
pub fn mix_values(weight: &[f32], base: &[f32], top: &[f32], out: &mut [f32]) {
    mix_heights(HeightMode::Replace, 0.0, weight, base, top, out);
}

/// Height of two layers where the upper one shows.
#[choice]
pub enum HeightMode {
    /// The upper height: one object set into another
    #[default]
    Replace,
    /// The sum of both: a coat, cloth over a form
    Add,
    /// The larger of both: one object that sticks out of another
    Max,
}

/// Blends heights by a weight: `lerp(base, f, weight)`, where f is `top + offset`, the sum or the larger of both.
///
/// # Panics
/// If the slices differ in length.
pub fn mix_heights(how: HeightMode, offset: f32, weight: &[f32], base: &[f32], top: &[f32], out: &mut [f32]) {
    assert!(weight.len() == out.len() && base.len() == out.len() && top.len() == out.len());
    let layers = Layers { weight, base, top, offset };
    simd::dispatch(
        #[inline(always)]
        || match how {
            HeightMode::Replace => layers.mix(
                out,
                inlined(
                    #[inline(always)]
                    |_, top| top,
                ),
            ),
            HeightMode::Add => layers.mix(
                out,
                inlined(
                    #[inline(always)]
                    |base, top| base + top,
                ),
            ),
            HeightMode::Max => layers.mix(out, max),
        },
    );
}

struct Layers<'a> {
    weight: &'a [f32],
    base: &'a [f32],
    top: &'a [f32],
    offset: f32,
}

impl Layers<'_> {
    #[inline(always)]
    fn mix(&self, out: &mut [f32], f: impl Fn(f32, f32) -> f32) {
        for (out, (weight, (base, top))) in out.iter_mut().zip(self.weight.iter().zip(self.base.iter().zip(self.top))) {
            *out = mix(*base, f(*base, top + self.offset), *weight);
        }
    }
}

/// Occlusion of added heights: the product, as far as the top layer shows.
///
/// # Panics
/// If the slices differ in length.
pub fn multiply(weight: &[f32], base: &[f32], top: &[f32], out: &mut [f32]) {
    assert!(weight.len() == out.len() && base.len() == out.len() && top.len() == out.len());
    for (out, (weight, (base, top))) in out.iter_mut().zip(weight.iter().zip(base.iter().zip(top))) {
        *out = lerp(*base, base * top, *weight);
    }
}

/// Planes of x, y and z.
pub type Planes<'a> = [&'a [f32]; 3];

/// Normals of two layers, with slopes blended by a weight.
///
/// # Panics
/// If a slice is shorter than `weight`.
pub fn mix_normals(weight: &[f32], base: Planes<'_>, top: Planes<'_>, out: [&mut [f32]; 3]) {
    let [x, y, z] = out;
    simd::dispatch(
        #[inline(always)]
        || mix_normals_of(weight, base, top, x, y, z),
    );
}

/// [`mix_normals`] as one loop. Separate arguments show the compiler that all lengths are equal and that no slices
/// overlap. A closure would lose this, and the loop would not be vectorised.
#[inline(always)]
fn mix_normals_of(weight: &[f32], base: Planes<'_>, top: Planes<'_>, x: &mut [f32], y: &mut [f32], z: &mut [f32]) {
    let n = weight.len();
    let ([bx, by, bz], [tx, ty, tz]) = (base.map(|plane| &plane[..n]), top.map(|plane| &plane[..n]));
    let [x, y, z] = [x, y, z].map(|plane| &mut plane[..n]);
    for i in 0..n {
        let w = weight[i];
        let (base, top) = ([bx[i], by[i], bz[i]], [tx[i], ty[i], tz[i]]);
        let (b, t) = (leaning(base), leaning(top));
        // Blend the slopes x/z and y/z, all multiplied by both z.
        let (mx, my) = (lerp(b[0] * t[2], t[0] * b[2], w), lerp(b[1] * t[2], t[1] * b[2], w));
        let mz = b[2] * t[2];
        let half = 0.5 / (mx * mx + my * my + mz * mz).sqrt();
        x[i] = between(base[0], top[0], 0.5 + mx * half, w);
        y[i] = between(base[1], top[1], 0.5 + my * half, w);
        z[i] = between(base[2], top[2], 0.5 + mz * half, w);
    }
}

/// `mixed`, but exactly `base` at weight 0 and `top` at weight 1.
#[inline(always)]
fn between(base: f32, top: f32, mixed: f32, weight: f32) -> f32 {
    let mixed = if weight >= 1.0 { top } else { mixed };
    if weight <= 0.0 { base } else { mixed }
}

/// Smallest z of a normal, for the steepest slope represented: 89.9°.
const LEAST_Z: f32 = 0.001_75;

/// A stored normal's coordinates; z is clamped to that of the steepest slope.
#[inline(always)]
fn leaning(stored: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = stored.map(|v| 2.0 * v - 1.0);
    [x, y, max(z, LEAST_Z)]
}

/// x and y of a stored normal per unit of z.
#[inline(always)]
fn slopes(planes: Planes<'_>, i: usize) -> [f32; 2] {
    let [x, y, z] = leaning(planes.map(|plane| plane[i]));
    let per = 1.0 / z;
    [x * per, y * per]
}

#[inline(always)]
fn of_slopes(x: f32, y: f32) -> [f32; 3] {
    let z = 1.0 / (1.0 + x * x + y * y).sqrt();
    [x * z, y * z, z]
}

/// Multiplies the slopes of normals by `by`, in x and in y.
///
/// # Panics
/// If a slice is shorter than the first plane of `out`.
pub fn scale_slopes(by: [f32; 2], normals: Planes<'_>, out: [&mut [f32]; 3]) {
    let [x, y, z] = out;
    for i in 0..x.len() {
        let [a, b] = slopes(normals, i);
        let normal = of_slopes(a * by[0], b * by[1]);
        (x[i], y[i], z[i]) = (0.5 + 0.5 * normal[0], 0.5 + 0.5 * normal[1], 0.5 + 0.5 * normal[2]);
    }
}

/// The top layer's normals, with slopes scaled by the weight, reoriented to those of the base: detail over a shape.
///
/// # Panics
/// If a slice is shorter than `weight`.
pub fn detail_normals(weight: &[f32], base: Planes<'_>, top: Planes<'_>, mut out: [&mut [f32]; 3]) {
    combine(NormalBlend::Reoriented, base, top, weight, out.each_mut().map(|plane| &mut **plane));
    for (out, base) in out.iter_mut().zip(base) {
        for ((out, base), weight) in out.iter_mut().zip(base).zip(weight) {
            *out = if *weight <= 0.0 { *base } else { *out };
        }
    }
}

/// An axis without sign, such as a grain: its strength and its angle in degrees, as planes.
#[derive(Clone, Copy, Debug)]
pub struct Grain<'a> {
    /// Strength, 0..1.
    pub strength: &'a [f32],
    /// Degrees from +x towards +y.
    pub angle: &'a [f32],
}

impl Grain<'_> {
    /// Strength times the unit vector of twice the angle, so that 0° and 180° are equal.
    #[inline(always)]
    fn doubled(&self, i: usize) -> [f32; 2] {
        let (angle, strength) = (2.0 * self.angle[i], self.strength[i]);
        [strength * cos_degrees(angle), strength * sin_degrees(angle)]
    }
}

/// Blends the anisotropies of two layers by a weight: strengths, or with `angles` the angles from -90 to 90. Exact
/// where one layer shows alone.
///
/// # Panics
/// If a slice is shorter than `out`.
pub fn mix_grain(angles: bool, weight: &[f32], base: Grain<'_>, top: Grain<'_>, out: &mut [f32]) {
    let (below, above) = if angles { (base.angle, top.angle) } else { (base.strength, top.strength) };
    for (i, out) in out.iter_mut().enumerate() {
        let w = weight[i];
        *out = if w <= 0.0 {
            below[i]
        } else if w >= 1.0 {
            above[i]
        } else {
            let (b, t) = (base.doubled(i), top.doubled(i));
            let (x, y) = (lerp(b[0], t[0], w), lerp(b[1], t[1], w));
            if angles { 0.5 * atan2_degrees(y, x) } else { (x * x + y * y).sqrt() }
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BY: ByHeight = ByHeight { contrast: 0.2, offset: 0.0, range: 1.0 };

    #[test]
    fn shows_higher_layer_unless_mask_decides() {
        // At mask ½ only heights count. smoothstep(-0.1, 0.1, d): d = 0 is ½; d = 0.05 is t = 0.75, 3t² - 2t³ =
        // 0.84375.
        let cases = [
            (0.5, 0.0, 0.0, 0.5),
            (0.5, 0.0, 0.05, 0.84375),
            (0.5, 0.05, 0.0, 0.15625),
            (0.5, 0.3, 0.0, 0.0),
            (0.5, 0.0, 0.3, 1.0),
            // Mask 0.75 lifts the top layer by 0.5 · (1 + 0.1) = 0.55.
            (0.75, 0.55, 0.0, 0.5),
            (0.75, 0.6, 0.0, 0.15625),
            // At any heights, even beyond the range.
            (0.0, -9.0, 9.0, 0.0),
            (1.0, 9.0, -9.0, 1.0),
            (-3.0, 0.0, 1.0, 0.0),
            (7.0, 1.0, 0.0, 1.0),
        ];
        for (mask, base, top, expected) in cases {
            let mut out = [f32::NAN];
            BY.weights(&[mask], &[base], &[top], &mut out);
            assert!((out[0] - expected).abs() < 1e-5, "{mask} {base} {top}: {} not {expected}", out[0]);
        }
        let sharp = ByHeight { contrast: 0.0, ..BY };
        for (base, top, expected) in [(0.0, 1e-6, 1.0), (1e-6, 0.0, 0.0), (0.0, 0.0, 1.0)] {
            let mut out = [f32::NAN];
            sharp.weights(&[0.5], &[base], &[top], &mut out);
            assert_eq!(out[0], expected);
        }
    }

    #[test]
    fn blends_heights_by_mode() {
        let mix = |how, weight: f32| {
            let mut out = [0.0];
            mix_heights(how, 0.5, &[weight], &[2.0], &[1.0], &mut out);
            out[0]
        };
        assert_eq!([0.0, 0.5, 1.0].map(|w| mix(HeightMode::Replace, w)), [2.0, 1.75, 1.5]);
        assert_eq!([0.0, 0.5, 1.0].map(|w| mix(HeightMode::Add, w)), [2.0, 2.75, 3.5]);
        assert_eq!([0.0, 0.5, 1.0].map(|w| mix(HeightMode::Max, w)), [2.0, 2.0, 2.0]);
    }

    fn mixed(detail: bool, weight: f32, base: [f32; 3], top: [f32; 3]) -> [f32; 3] {
        let encode = |n: [f32; 3]| n.map(|v| 0.5 + 0.5 * v);
        let (b, t, mut out) = (encode(base), encode(top), [[0.0]; 3]);
        let [x, y, z] = &mut out;
        let planes = |n: &[f32; 3]| [[n[0]], [n[1]], [n[2]]];
        let (b, t) = (planes(&b), planes(&t));
        let mix = if detail { detail_normals } else { mix_normals };
        mix(&[weight], [&b[0], &b[1], &b[2]], [&t[0], &t[1], &t[2]], [x, y, z]);
        out.map(|v| 2.0 * v[0] - 1.0)
    }

    fn near(a: [f32; 3], b: [f32; 3]) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5), "{a:?} is not {b:?}");
    }

    #[test]
    fn normals_are_mixed_by_their_slopes() {
        // Half of slope 1 (45°) and half of slope 0 (level) is slope ½: (0.5, 0, 1) / √1.25, and not the mean of the
        // normals.
        let steep = [std::f32::consts::FRAC_1_SQRT_2, 0.0, std::f32::consts::FRAC_1_SQRT_2];
        let level = [0.0, 0.0, 1.0];
        let root = 1.25_f32.sqrt();
        near(mixed(false, 0.5, level, steep), [0.5 / root, 0.0, 1.0 / root]);
        near(mixed(false, 0.0, level, steep), level);
        near(mixed(false, 1.0, level, steep), steep);
        // On level ground detail is unchanged; level detail changes nothing; 30° on 30° about one axis are 60°.
        near(mixed(true, 1.0, level, steep), steep);
        near(mixed(true, 1.0, steep, level), steep);
        near(mixed(true, 0.0, steep, steep), steep);
        let tilt = |degrees: f32| [sin_degrees(degrees), 0.0, cos_degrees(degrees)];
        near(mixed(true, 1.0, tilt(30.0), tilt(30.0)), tilt(60.0));
    }

    #[test]
    fn ignores_sign_of_grain() {
        let mix = |angles, weight: f32, base: (f32, f32), top: (f32, f32)| {
            let (base, top) = (([base.0], [base.1]), ([top.0], [top.1]));
            let grain = |of: &'static str, (s, a): &([f32; 1], [f32; 1])| (of, *s, *a);
            let ((_, bs, ba), (_, ts, ta)) = (grain("base", &base), grain("top", &top));
            let mut out = [0.0];
            let (b, t) = (Grain { strength: &bs, angle: &ba }, Grain { strength: &ts, angle: &ta });
            mix_grain(angles, &[weight], b, t, &mut out);
            out[0]
        };
        // 80° and -80° are 20° apart, so halfway is 90°, and the strength is that of two vectors 40° apart: cos 20°.
        assert!((mix(true, 0.5, (1.0, 80.0), (1.0, -80.0)).abs() - 90.0).abs() < 1e-3);
        assert!((mix(false, 0.5, (1.0, 80.0), (1.0, -80.0)) - cos_degrees(20.0)).abs() < 1e-5);
        // Perpendicular axes cancel out.
        assert!(mix(false, 0.5, (0.6, 0.0), (0.6, 90.0)) < 1e-6);
        assert!((mix(true, 0.25, (0.0, 33.0), (0.8, 25.0)) - 25.0).abs() < 1e-3);
    }

    #[test]
    fn bounds_are_those_of_all_values() {
        let values: Vec<f32> = (0..37).map(|i| ((i * 13) % 37) as f32 - 5.0).collect();
        assert_eq!(bounds(&values), (-5.0, 31.0));
        assert_eq!(bounds(&values[..1]), (-5.0, -5.0));
        assert_eq!(bounds(&[]), (f32::INFINITY, f32::NEG_INFINITY));
    }
}
