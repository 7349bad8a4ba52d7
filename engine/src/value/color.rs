//! The sRGB transfer function in single precision, for colours in graph files and for showing numbers.
//!
//! Samples of picture files have functions of their own in [`picture`](crate::picture), in double precision and by tables.

/// The scene-linear value of an sRGB-encoded one (IEC 61966-2-1). Negative values stay on the straight part of the curve.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// The sRGB-encoded value of a scene-linear one. Negative values stay on the straight part of the curve.
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}
