//! Conversions between number types.

/// Narrows a parameter to the single precision of kernels.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "parameters are within ranges that f32 holds")]
pub fn narrow(value: f64) -> f32 {
    value as f32
}

/// An index as it is stored in lists, in 32 bits.
#[inline]
pub(crate) fn index_u32(i: usize) -> u32 {
    u32::try_from(i).expect("fewer than 2^32 entries")
}
