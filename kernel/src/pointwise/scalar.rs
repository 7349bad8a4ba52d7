//! The functions that formulas of operations call, in single precision. All are inlined and free of branches, so loops
//! over them vectorise.
use crate::ground::math;
pub(super) use crate::ground::math::{
    atan2_degrees as atan2, cos_degrees as cos, max, min, saturate, sin_degrees as sin, srgb_decode as from_srgb,
    srgb_encode as srgb,
};
pub(super) use shibo_value::expression::{hash, noise, noise3, of_piece, random};

#[inline(always)]
pub(super) fn truth(yes: bool) -> f32 {
    if yes { 1.0 } else { 0.0 }
}

#[inline(always)]
pub(super) fn abs(x: f32) -> f32 {
    x.abs()
}

#[inline(always)]
pub(super) fn floor(x: f32) -> f32 {
    x.floor()
}

#[inline(always)]
pub(super) fn ceil(x: f32) -> f32 {
    x.ceil()
}

/// Rounds halves away from 0.
#[inline(always)]
pub(super) fn round(x: f32) -> f32 {
    (x.abs() + 0.5).floor().copysign(x)
}

#[inline(always)]
pub(super) fn sqrt(x: f32) -> f32 {
    x.sqrt()
}

/// The number; 0 if it is not finite.
#[inline(always)]
pub(super) fn finite(x: f32) -> f32 {
    if x.abs() < f32::INFINITY { x } else { 0.0 }
}

#[inline(always)]
pub(super) fn modulo(a: f32, b: f32) -> f32 {
    a - b * (a / b).floor()
}

/// The cube root, by two steps of Newton's method in double precision; error ≤ 0.667 units in the last place. Numbers
/// below 2^-126 in size become 0.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the rounding to f32 is meant")]
pub(super) fn cbrt(x: f32) -> f32 {
    let size = x.abs();
    // Exact to 5 bits, as in FreeBSD's `cbrtf` by B. Evans: a third of the exponent, and a bias for the mantissa.
    let root = f64::from(f32::from_bits(size.to_bits() / 3 + 0x2a51_19f2));
    let size64 = f64::from(size);
    let step = |root: f64| {
        let cube = root * root * root;
        root * (size64 + size64 + cube) / (size64 + cube + cube)
    };
    let root = step(step(root)) as f32;
    let root = if size < f32::MIN_POSITIVE { 0.0 } else { root };
    let root = if size < f32::INFINITY { root } else { size };
    root.copysign(x)
}

/// The exponential; infinity on overflow.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    if x > 88.0 { f32::INFINITY } else { math::exp(x) }
}

/// The natural logarithm: infinite at 0 and NaN below.
#[inline(always)]
pub(super) fn log(x: f32) -> f32 {
    defined(x, math::log2(x) * std::f32::consts::LN_2)
}

/// The logarithm to base 2: infinite at 0 and NaN below.
#[inline(always)]
pub(super) fn log2(x: f32) -> f32 {
    defined(x, math::log2(x))
}

/// The logarithm of `x`, which is `log` above 0.
#[inline(always)]
fn defined(x: f32, log: f32) -> f32 {
    if x > 0.0 {
        log
    } else if x == 0.0 {
        f32::NEG_INFINITY
    } else {
        f32::NAN
    }
}

/// x^y; for negative x only if y is an integer.
#[inline(always)]
pub(super) fn power(x: f32, y: f32) -> f32 {
    let size = math::pow(x.abs(), y);
    let whole = y == y.floor();
    let odd = whole & (y * 0.5 != (y * 0.5).floor());
    let negative = if odd { -size } else { size };
    let signed = if x < 0.0 { negative } else { size };
    let possible = (x >= 0.0) | whole;
    let infinite = (x == 0.0) & (y < 0.0);
    if infinite {
        f32::INFINITY
    } else if possible {
        signed
    } else {
        f32::NAN
    }
}

// Outside the domain the root is NaN, and so is the angle.

#[inline(always)]
pub(super) fn asin(x: f32) -> f32 {
    angle(x, ((1.0 - x) * (1.0 + x)).sqrt())
}

#[inline(always)]
pub(super) fn acos(x: f32) -> f32 {
    angle(((1.0 - x) * (1.0 + x)).sqrt(), x)
}

#[inline(always)]
pub(super) fn atan(x: f32) -> f32 {
    math::atan2_degrees(x, 1.0)
}

/// Angle of the vector (x, y) in degrees; NaN if a component is NaN.
#[inline(always)]
fn angle(y: f32, x: f32) -> f32 {
    math::atan2_degrees(y, x) + 0.0 * (x + y)
}
