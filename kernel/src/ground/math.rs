//! Transcendental functions with the same bits on every machine: pure Rust, never the system's library.
//!
//! Every function is branch-free and inlined, so a loop over a slice vectorises. No function fuses a product and a sum.
//! Results are defined for every input; where mathematics defines none, the doc states the result.

use super::number::narrow;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, LOG2_E, PI};

/// 1.5·2^23: added to a float below 2^22 in size, it leaves the nearest integer in the low bits.
const SNAP: f32 = 12_582_912.0;
/// 1.5·2^52, the same for f64.
const SNAP64: f64 = 6_755_399_441_055_744.0;

/// Coefficients of `(e^r - 1 - r) / r²` for `|r| ≤ ln 2 / 2`, after Cephes.
const EXP: [f32; 6] = [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5];
/// ln 2 as the sum of two numbers; the first one has few bits.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// The larger of two numbers; `b` if either is NaN. A single instruction with the same result on every machine.
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers; `b` if either is NaN.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `x` limited to `low ≤ x ≤ high`; `low` if it is NaN.
#[inline(always)]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    min(max(x, low), high)
}

/// `x` limited to 0..1; 0 if it is NaN.
#[inline(always)]
pub fn saturate(x: f32) -> f32 {
    clamp(x, 0.0, 1.0)
}

/// `a + (b - a)·t`.
#[inline(always)]
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// The cubic step 3t² - 2t³ of `t` limited to 0..1.
#[inline(always)]
pub fn smooth(t: f32) -> f32 {
    let t = saturate(t);
    t * t * (3.0 - 2.0 * t)
}

/// The largest integer not above `x`, as float and as integer, for |x| < 2^22. Avoids the saturation of a cast, which
/// costs five instructions.
#[inline(always)]
pub fn floor_int(x: f32) -> (f32, i32) {
    let snapped = x + SNAP;
    let nearest = snapped - SNAP;
    let above = nearest > x;
    let floor = if above { nearest - 1.0 } else { nearest };
    (floor, (floor + SNAP).to_bits().wrapping_sub(SNAP.to_bits()).cast_signed())
}

/// √(x² + y²), rounded from double precision; NaN if either is NaN.
#[inline]
pub fn hypot(x: f32, y: f32) -> f32 {
    let (x, y) = (f64::from(x), f64::from(y));
    narrow((x * x + y * y).sqrt())
}

/// Sine of `x` radians; error ≤ 1e-7 for |x| < 1e6. 0 if `x` is not finite.
#[inline(always)]
pub fn sin(x: f32) -> f32 {
    quarter_turns(x, 0)
}

/// Cosine of `x` radians; error ≤ 1e-7 for |x| < 1e6. 0 if `x` is not finite.
#[inline(always)]
pub fn cos(x: f32) -> f32 {
    quarter_turns(x, 1)
}

/// [`sin`] and [`cos`] together, cheaper than two calls.
#[inline(always)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let (turns, s, c) = reduced(x);
    (quadrant(turns, s, c), quadrant(turns.wrapping_add(1), s, c))
}

/// Sine of `x` degrees, exact at multiples of 90; error ≤ 1e-7 for |x| < 1e6. 0 if `x` is not finite.
#[inline(always)]
pub fn sin_degrees(x: f32) -> f32 {
    quarter_turns_degrees(x, 0)
}

/// Cosine of `x` degrees, exact at multiples of 90; error ≤ 1e-7 for |x| < 1e6. 1 if `x` is not finite.
#[inline(always)]
pub fn cos_degrees(x: f32) -> f32 {
    quarter_turns_degrees(x, 1)
}

/// The sine of x + 90·turns degrees.
#[inline(always)]
fn quarter_turns_degrees(x: f32, turns: u64) -> f32 {
    let x = if x.abs() < 1e12 { f64::from(x) } else { 0.0 };
    let snapped = x * (1.0 / 90.0) + SNAP64;
    #[expect(clippy::cast_possible_truncation, reason = "the rounding to f32 is meant")]
    let r = (x - (snapped - SNAP64) * 90.0).to_radians() as f32;
    let (s, c) = polynomials(r);
    quadrant(snapped.to_bits().wrapping_add(turns), s, c)
}

/// sin(x + turns·π/2).
#[inline(always)]
fn quarter_turns(x: f32, turns: u64) -> f32 {
    let (more, s, c) = reduced(x);
    quadrant(more.wrapping_add(turns), s, c)
}

/// The number of quarter turns nearest to x in the low bits, and the sine and cosine of the remainder. Reduced in f64.
#[inline(always)]
fn reduced(x: f32) -> (u64, f32, f32) {
    let x = if x.abs() < 1e12 { f64::from(x) } else { 0.0 };
    let snapped = x * std::f64::consts::FRAC_2_PI + SNAP64;
    #[expect(clippy::cast_possible_truncation, reason = "the rounding to f32 is meant")]
    let r = (x - (snapped - SNAP64) * std::f64::consts::FRAC_PI_2) as f32;
    let (s, c) = polynomials(r);
    (snapped.to_bits(), s, c)
}

/// Sine and cosine for |r| ≤ π/4, by the polynomials of Cephes.
#[inline(always)]
fn polynomials(r: f32) -> (f32, f32) {
    let z = r * r;
    let s = r + r * z * (-1.666_665_5e-1 + z * (8.332_161e-3 - z * 1.951_529_6e-4));
    let c = 1.0 - 0.5 * z + z * z * (4.166_664_6e-2 + z * (-1.388_731_6e-3 + z * 2.443_315_7e-5));
    (s, c)
}

#[inline(always)]
fn quadrant(turns: u64, s: f32, c: f32) -> f32 {
    let value = if turns & 1 == 0 { s } else { c };
    if turns & 2 == 0 { value } else { -value }
}

/// Angle of the vector (x, y) in -π..π; error ≤ 4e-7. 0 for the null vector.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    angle(y, x, 1.0, [FRAC_PI_4, FRAC_PI_2, PI])
}

/// The same angle in degrees, -180..180, exact at multiples of 45; error ≤ 3e-5.
#[inline(always)]
pub fn atan2_degrees(y: f32, x: f32) -> f32 {
    angle(y, x, 180.0 / PI, [45.0, 90.0, 180.0])
}

/// Angle of a vector in any unit; `radian`, `eighth`, `quarter` and `half` are a radian and parts of a turn in that
/// unit.
#[inline(always)]
fn angle(y: f32, x: f32, radian: f32, [eighth, quarter, half]: [f32; 3]) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = (min(ax, ay), max(ax, ay));
    let t = if high > 0.0 { low / high } else { 0.0 };
    let wide = t > 0.414_213_57;
    let t = if wide { (t - 1.0) / (t + 1.0) } else { t };
    let z = t * t;
    let series = t + t * z * (-3.333_295e-1 + z * (1.997_771_1e-1 + z * (-1.387_768_6e-1 + z * 8.053_745e-2)));
    let angle = series * radian + if wide { eighth } else { 0.0 };
    let angle = if ay > ax { quarter - angle } else { angle };
    let angle = if x < 0.0 { half - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

/// 2^x; relative error ≤ 2e-7. 0 below -126, at most 2^127.49; 0 if `x` is NaN.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    let alive = x >= -126.0;
    let x = clamp(x, -126.0, 127.49);
    let snapped = x + SNAP;
    let f = x - (snapped - SNAP);
    let p = 1.0
        + f * (6.931_472e-1
            + f * (2.402_264_8e-1
                + f * (5.550_332_5e-2 + f * (9.618_437e-3 + f * (1.339_887_4e-3 + f * 1.535_336_2e-4)))));
    let scale = f32::from_bits(snapped.to_bits().wrapping_sub(SNAP.to_bits()).wrapping_add(127) << 23);
    if alive { p * scale } else { 0.0 }
}

/// The exponential of `x`; relative error ≤ 3e-7. Below -87 the result is e^-87.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let x = x.clamp(-87.0, 88.0);
    let shifted = x * LOG2_E + SNAP;
    let n = shifted - SNAP;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let p = EXP[1..].iter().fold(EXP[0], |p, c| p * r + c);
    let power = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
    ((p * (r * r) + r) + 1.0) * power
}

/// Coefficients of a polynomial for e^-x on 0..1, most accurate where its 16th power is large.
const BELL: [f32; 4] = [-0.999_992_9, 0.499_715_57, -0.163_786_49, 0.032_358_542];

/// e^-16x for 0 ≤ x ≤ 1; absolute error ≤ 1.3e-6, and exactly 1 for 0. Meaningless for other `x`.
#[inline(always)]
pub fn bell_simd<S: pulp::Simd>(simd: S, x: S::f32s) -> S::f32s {
    let mut p = simd.splat_f32s(BELL[3]);
    for c in [BELL[2], BELL[1], BELL[0], 1.0] {
        p = simd.add_f32s(simd.mul_f32s(p, x), simd.splat_f32s(c));
    }
    for _ in 0..4 {
        p = simd.mul_f32s(p, p);
    }
    p
}

/// Logarithm to base 2; error ≤ 2e-7·(1 + |result|). -126 for all numbers below 2^-126, including negative ones.
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    let (e, s) = split(x);
    let z = s * s;
    // 2/ln 2 · artanh(s), |s| ≤ 0.172
    let series = s * (2.885_39 + z * (9.617_967e-1 + z * (5.770_78e-1 + z * (4.121_986e-1 + z * 3.205_99e-1))));
    e + series
}

/// x as 2^e·(1+s)/(1-s), with the mantissa between √½ and √2.
#[inline(always)]
fn split(x: f32) -> (f32, f32) {
    let x = clamp(x, f32::MIN_POSITIVE, f32::MAX);
    let bits = x.to_bits().wrapping_sub(0x3f35_04f3);
    let m = f32::from_bits((bits & 0x007f_ffff).wrapping_add(0x3f35_04f3));
    let e = (bits.cast_signed() >> 23) as f32;
    (e, (m - 1.0) / (m + 1.0))
}

/// x^y for x > 0; relative error ≤ 3e-7. 0 for x ≤ 0 or NaN (1 if y is 0); the result is limited as in [`exp2`].
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "computed in f64 and rounded once")]
pub fn pow(x: f32, y: f32) -> f32 {
    let positive = x > 0.0;
    let x = clamp(x, f32::MIN_POSITIVE, f32::MAX);
    let bits = x.to_bits().wrapping_sub(0x3f35_04f3);
    let m = f64::from(f32::from_bits((bits & 0x007f_ffff).wrapping_add(0x3f35_04f3)));
    let e = f64::from(bits.cast_signed() >> 23);
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    // 2/ln 2 · (1, 1/3, 1/5, …): artanh in f64, because the product with y would lose too many digits in f32.
    let log = 2.885_390_081_777_926_8
        + z * (0.961_796_693_925_975_6
            + z * (0.577_078_016_355_585_4
                + z * (0.412_198_583_111_132_4 + z * (0.320_598_897_975_325_2 + z * 0.262_308_189_252_538_8))));
    let p = f64::from(y) * (e + s * log);
    let p = if p < -126.0 { -126.0 } else { p };
    let p = if p > 127.49 { 127.49 } else { p };
    let snapped = p + SNAP64;
    let f = (p - (snapped - SNAP64)) as f32;
    let q = 1.0
        + f * (6.931_472e-1
            + f * (2.402_264_8e-1
                + f * (5.550_332_5e-2 + f * (9.618_437e-3 + f * (1.339_887_4e-3 + f * 1.535_336_2e-4)))));
    let scale = f32::from_bits(((snapped.to_bits() as u32).wrapping_add(127)) << 23);
    let value = q * scale;
    if positive {
        value
    } else if y == 0.0 {
        1.0
    } else {
        0.0
    }
}

/// Linear light 0..1 to the sRGB encoding; odd-symmetric outside, so negative values survive a round trip.
#[inline(always)]
pub fn srgb_encode(x: f32) -> f32 {
    let a = x.abs();
    let curve = 1.055 * pow(a, 1.0 / 2.4) - 0.055;
    let y = if a <= 0.003_130_8 { 12.92 * a } else { curve };
    y.copysign(x)
}

/// The sRGB encoding to linear light, odd-symmetric outside 0..1.
#[inline(always)]
pub fn srgb_decode(x: f32) -> f32 {
    let a = x.abs();
    let curve = pow((a + 0.055) * (1.0 / 1.055), 2.4);
    let y = if a <= 0.040_45 { a * (1.0 / 12.92) } else { curve };
    y.copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(got: f32, want: f64, absolute: f64, relative: f64) -> bool {
        (f64::from(got) - want).abs() <= absolute + relative * want.abs()
    }

    proptest! {
        #[test]
        fn sine_and_cosine(x in -1e5f32..1e5) {
            prop_assert!(close(sin(x), f64::from(x).sin(), 1.2e-7, 0.0), "{}", sin(x));
            prop_assert!(close(cos(x), f64::from(x).cos(), 1.2e-7, 0.0), "{}", cos(x));
        }

        #[test]
        fn angle(x in -10f32..10.0, y in -10f32..10.0) {
            prop_assert!(close(atan2(y, x), f64::from(y).atan2(f64::from(x)), 4e-7, 0.0));
        }

        #[test]
        fn powers(x in 1e-6f32..100.0, y in -4f32..4.0) {
            prop_assert!(close(pow(x, y), f64::from(x).powf(f64::from(y)), 0.0, 5e-7), "{} {}", pow(x, y), f64::from(x).powf(f64::from(y)));
            prop_assert!(close(log2(x), f64::from(x).log2(), 2e-7, 2e-7));
            prop_assert!(close(exp2(y * 20.0), f64::from(y * 20.0).exp2(), 0.0, 3e-7));
        }

        #[test]
        fn srgb_round_trip(x in -1f32..2.0) {
            prop_assert!((srgb_decode(srgb_encode(x)) - x).abs() < 2e-6);
        }

        #[test]
        fn floor(x in -4e6f32..4e6) {
            let (f, i) = floor_int(x);
            prop_assert_eq!(f, x.floor());
            prop_assert_eq!(i as f32, x.floor());
        }
    }

    #[test]
    fn every_input_has_a_result() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, -1.0, f32::MIN_POSITIVE, 1e-42, f32::MAX] {
            for y in [f32::NAN, f32::INFINITY, 0.0, -2.0, 0.5] {
                assert!([sin(x), cos(x), exp2(x), log2(x), saturate(x)].iter().all(|v| v.is_finite()), "{x}");
                assert!(!pow(x, y).is_nan() || y.is_nan(), "{x} {y}");
                assert!(!pow(x, 0.5).is_nan());
            }
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert_eq!(pow(0.0, 0.0), 1.0);
        assert_eq!(pow(1.0, 2.2), 1.0);
        assert_eq!(sin(0.0), 0.0);
        assert_eq!(cos(0.0), 1.0);
    }

    struct Bell(Vec<f32>);

    impl pulp::WithSimd for Bell {
        type Output = Vec<f32>;
        #[inline(always)]
        fn with_simd<S: pulp::Simd>(mut self, simd: S) -> Vec<f32> {
            S::as_mut_simd_f32s(&mut self.0).0.iter_mut().for_each(|v| *v = bell_simd(simd, *v));
            self.0
        }
    }

    #[test]
    fn hypot_keeps_large_and_small_numbers() {
        assert_eq!(hypot(3.0, -4.0), 5.0);
        // The squares leave the range of f32.
        assert_eq!((hypot(3e30, 4e30), hypot(3e-30, 4e-30)), (5e30, 5e-30));
        assert_eq!((hypot(f32::MAX, f32::MAX), hypot(0.0, -0.0)), (f32::INFINITY, 0.0));
        assert!(hypot(f32::NAN, f32::INFINITY).is_nan());
    }

    #[test]
    fn the_bell_is_an_exponential_and_has_the_same_bits_at_any_width() {
        use pulp::WithSimd;
        let x: Vec<f32> = (0..=4096).map(|i| i as f32 / 4096.0).cycle().take(4096).collect();
        let many = pulp::Arch::new().dispatch(Bell(x.clone()));
        let one = Bell(x.clone()).with_simd(pulp::Scalar::new());
        for ((x, many), one) in x.iter().zip(&many).zip(&one) {
            assert_eq!(many.to_bits(), one.to_bits());
            assert!((f64::from(*many) - (-16.0 * f64::from(*x)).exp()).abs() < 1.3e-6, "{x}");
        }
    }
}
