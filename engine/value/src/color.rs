//! The sRGB transfer function in single precision, for colours in graph files and for display.
//!
//! Samples of picture files are converted by the crate `shibo-picture`, in double precision and with tables.

/// The scene-linear value of an sRGB-encoded value (IEC 61966-2-1). Negative values stay on the linear part of the
/// curve.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// The sRGB-encoded value of a scene-linear value. Negative values stay on the linear part of the curve.
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

/// The scene-linear colour that `#rgb` or `#rrggbb` writes in sRGB.
pub fn parse_color(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#')?;
    if !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let byte = |i: usize| match digits.len() {
        3 => u8::from_str_radix(&digits[i..=i], 16).ok().map(|d| d * 17),
        6 => u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok(),
        _ => None,
    };
    Some([byte(0)?, byte(1)?, byte(2)?].map(|byte| srgb_to_linear(f32::from(byte) / 255.0)))
}
