//! The functions that formulas of operations call, in double precision.
use super::random::{self as single_precision};

pub(super) fn truth(yes: bool) -> f64 {
    if yes { 1.0 } else { 0.0 }
}

pub(super) fn abs(x: f64) -> f64 {
    x.abs()
}

pub(super) fn floor(x: f64) -> f64 {
    x.floor()
}

pub(super) fn ceil(x: f64) -> f64 {
    x.ceil()
}

pub(super) fn round(x: f64) -> f64 {
    x.round()
}

pub(super) fn min(a: f64, b: f64) -> f64 {
    a.min(b)
}

pub(super) fn max(a: f64, b: f64) -> f64 {
    a.max(b)
}

pub(super) fn saturate(x: f64) -> f64 {
    x.clamp(0.0, 1.0)
}

/// The number; 0 if it is not finite in single precision, the precision of fields.
pub(super) fn finite(x: f64) -> f64 {
    if single(x).is_finite() { x } else { 0.0 }
}

pub(super) fn sqrt(x: f64) -> f64 {
    libm::sqrt(x)
}

pub(super) fn cbrt(x: f64) -> f64 {
    libm::cbrt(x)
}

pub(super) fn exp(x: f64) -> f64 {
    libm::exp(x)
}

pub(super) fn log(x: f64) -> f64 {
    libm::log(x)
}

pub(super) fn log2(x: f64) -> f64 {
    libm::log2(x)
}

pub(super) fn power(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

pub(super) fn sin(angle: f64) -> f64 {
    turn(angle, 0)
}

pub(super) fn cos(angle: f64) -> f64 {
    turn(angle, 1)
}

pub(super) fn asin(x: f64) -> f64 {
    libm::asin(x).to_degrees()
}

pub(super) fn acos(x: f64) -> f64 {
    libm::acos(x).to_degrees()
}

pub(super) fn atan(x: f64) -> f64 {
    libm::atan(x).to_degrees()
}

pub(super) fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x).to_degrees()
}

/// Linear light to the sRGB encoding, odd-symmetric outside 0..1.
pub(super) fn srgb(x: f64) -> f64 {
    let a = x.abs();
    let y = if a <= 0.003_130_8 { 12.92 * a } else { 1.055 * libm::pow(a, 1.0 / 2.4) - 0.055 };
    y.copysign(x)
}

/// The sRGB encoding to linear light, odd-symmetric outside 0..1.
pub(super) fn from_srgb(x: f64) -> f64 {
    let a = x.abs();
    let y = if a <= 0.040_45 { a / 12.92 } else { libm::pow((a + 0.055) / 1.055, 2.4) };
    y.copysign(x)
}

/// The remainder with the sign of the divisor.
pub(super) fn modulo(a: f64, b: f64) -> f64 {
    let rest = a % b;
    if rest != 0.0 && (rest < 0.0) != (b < 0.0) { rest + b } else { rest }
}

/// The sine of `x` degrees plus `quarters` quarter turns, exact at multiples of 90.
fn turn(x: f64, quarters: u8) -> f64 {
    let turned = x % 360.0;
    let nearest = (turned / 90.0).round();
    let rest = (turned - nearest * 90.0).to_radians();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from -4 to 4; others are not finite")]
    let quarter = ((nearest + 4.0) as u8).wrapping_add(quarters) % 4;
    let value = if quarter.is_multiple_of(2) { libm::sin(rest) } else { libm::cos(rest) };
    if quarter < 2 { value } else { -value }
}

/// Random numbers are functions of single-precision numbers.
#[expect(clippy::cast_possible_truncation, reason = "the rounding to f32 is meant")]
fn single(x: f64) -> f32 {
    x as f32
}

pub(super) fn random(seed: u64, x: f64) -> f64 {
    single_precision::random(seed, single(x)).into()
}

pub(super) fn of_piece(seed: u64, x: f64) -> f64 {
    single_precision::of_piece(seed, single(x)).into()
}

pub(super) fn hash(seed: u64, before: f64, x: f64) -> f64 {
    single_precision::hash(seed, single(before), single(x)).into()
}

pub(super) fn noise(seed: u64, x: f64, y: f64, period: [f32; 3]) -> f64 {
    single_precision::noise(seed, single(x), single(y), period).into()
}

pub(super) fn noise3(seed: u64, at: [f64; 3], period: [f32; 3]) -> f64 {
    single_precision::noise3(seed, at.map(single), period).into()
}
