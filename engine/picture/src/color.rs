//! Colour spaces: the sRGB transfer curve in both directions, exact for 8-bit codes.

/// From linear Rec.709 to ACEScg (AP1), adapted from D65 to the white of ACES by Bradford's method (S-2014-004).
pub const REC709_TO_AP1: [[f32; 3]; 3] = [
    [0.613_097_4, 0.339_523_15, 0.047_379_45],
    [0.070_193_72, 0.916_353_9, 0.013_452_4],
    [0.020_615_6, 0.109_569_77, 0.869_814_6],
];

/// From ACEScg (AP1) to linear Rec.709.
pub(super) const AP1_TO_REC709: [[f32; 3]; 3] = [
    [1.705_051, -0.621_792_1, -0.083_258_87],
    [-0.130_256_42, 1.140_804_7, -0.010_548_32],
    [-0.024_003_36, -0.128_968_98, 1.152_972_3],
];

/// The linear value of an sRGB-encoded sample of a picture file (IEC 61966-2-1), computed in double precision. Values
/// below 0 are mirrored, values above 1 continue the curve.
///
/// Colours in graph files are decoded by [`srgb_to_linear`](crate::value::srgb_to_linear), in single precision: the
/// last bits differ for 198 of the 256 codes. Keys and pictures of all graphs with colours depend on those bits, so
/// both functions are kept.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "rounding to the precision of a sample is meant")]
pub fn linear_sample(encoded: f32) -> f32 {
    decode(f64::from(encoded.abs())).copysign(f64::from(encoded)) as f32
}

/// The linear value of an encoded value that is not negative.
pub(super) fn decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// Buckets for codes: floats from 2^-13 to 1, with 2^7 buckets per octave. The bucket is given by the upper 16 bits of
/// the float.
const CODE_FIRST: u32 = (127 - 13) << 7;
const CODE_LAST: u32 = 127 << 7;
/// The finer buckets for the curve: from 2^-9, with 2^9 buckets per octave.
const CURVE_FIRST: u32 = (127 - 9) << 9;
const CURVE_LAST: u32 = 127 << 9;

/// Tables that encode linear light by the sRGB curve.
///
/// The 8-bit code is exactly rounded to nearest: the bit pattern of a float selects a bucket that contains at most one
/// boundary between codes, and one comparison with that boundary decides. The continuous curve is interpolated linearly
/// in its buckets, with an error below 1/100 of a 16-bit step.
#[derive(Clone)]
pub struct SrgbEncoder {
    /// Code of the first float of each bucket.
    codes: Vec<u8>,
    /// The least float whose code is at least `k`.
    boundaries: [f32; 257],
    /// The curve at the start of each bucket, and its rise over the bucket.
    curve: Vec<(f32, f32)>,
}

impl Default for SrgbEncoder {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Debug for SrgbEncoder {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("SrgbEncoder").finish_non_exhaustive()
    }
}

impl SrgbEncoder {
    /// Computes the tables, about 100 KiB in half a millisecond.
    #[must_use]
    pub fn new() -> Self {
        let mut boundaries = [f32::INFINITY; 257];
        boundaries[0] = f32::NEG_INFINITY;
        for code in 1..256_u16 {
            boundaries[usize::from(code)] = least_float_at_least(decode((f64::from(code) - 0.5) / 255.0));
        }
        let codes = (CODE_FIRST..=CODE_LAST)
            .map(|bucket| {
                let value = f32::from_bits(bucket << 16);
                let above = boundaries[..256].partition_point(|boundary| *boundary <= value);
                u8::try_from(above - 1).unwrap_or(u8::MAX)
            })
            .collect();
        let curve = (CURVE_FIRST..=CURVE_LAST).map(curve_bucket).collect();
        Self { codes, boundaries, curve }
    }

    /// The 8-bit sRGB code of a linear value, clamped to 0..1; NaN gives 0.
    #[must_use]
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "a code is at most 255: its upper boundary is infinite")]
    pub fn code(&self, linear: f32) -> u8 {
        const LEAST: f32 = 1.0 / 8192.0;
        if linear.is_nan() || linear < LEAST {
            // Below 2^-13 the curve is linear, and only the codes 0 and 1 occur.
            return u8::from(linear >= self.boundaries[1]);
        }
        let linear = linear.min(1.0);
        let bucket = (linear.to_bits() >> 16) - CODE_FIRST;
        let code = usize::from(self.codes[bucket as usize]);
        (code + usize::from(linear >= self.boundaries[code + 1])) as u8
    }

    /// The encoded value of a linear value, clamped to 0..1; NaN gives 0.
    #[must_use]
    #[inline]
    pub fn encode(&self, linear: f32) -> f32 {
        const LINEAR_PART: f32 = 0.003_130_8;
        if linear.is_nan() || linear <= LINEAR_PART {
            return if linear > 0.0 { linear * 12.92 } else { 0.0 };
        }
        let bits = linear.min(1.0).to_bits();
        let (start, rise) = self.curve[((bits >> 14) - CURVE_FIRST) as usize];
        #[expect(clippy::cast_precision_loss, reason = "14 bits fit a float")]
        let within = (bits & 0x3fff) as f32 * (1.0 / 16384.0);
        start + rise * within
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the neighbouring floats are compared with the exact value")]
fn least_float_at_least(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

#[expect(clippy::cast_possible_truncation, reason = "table entries have the precision of a sample")]
fn curve_bucket(bucket: u32) -> (f32, f32) {
    let at = |bits: u32| encode(f64::from(f32::from_bits(bits)));
    let start = at(bucket << 14);
    let rise = if bucket == CURVE_LAST { 0.0 } else { at((bucket + 1) << 14) - start };
    (start as f32, rise as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_codes_survive_the_round_trip() {
        let encoder = SrgbEncoder::new();
        for code in 0..=255_u8 {
            assert_eq!(encoder.code(linear_sample(f32::from(code) / 255.0)), code);
        }
    }

    #[test]
    fn a_bucket_holds_at_most_one_boundary() {
        let encoder = SrgbEncoder::new();
        assert!(encoder.codes.windows(2).all(|pair| pair[1] - pair[0] <= 1));
    }

    #[test]
    fn codes_are_those_of_exact_arithmetic_and_monotonic() {
        let encoder = SrgbEncoder::new();
        let mut previous = 0;
        for bits in (0..=1.0_f32.to_bits()).step_by(997) {
            let linear = f32::from_bits(bits);
            let exact = (encode(f64::from(linear)) * 255.0 + 0.5).floor();
            let code = encoder.code(linear);
            assert_eq!(f64::from(code), exact, "{linear}");
            assert!(code >= previous);
            previous = code;
        }
    }

    #[test]
    fn codes_change_exactly_at_the_boundaries() {
        let encoder = SrgbEncoder::new();
        for code in 1..=255_u8 {
            let boundary = encoder.boundaries[usize::from(code)];
            assert_eq!(encoder.code(boundary), code);
            assert_eq!(encoder.code(boundary.next_down()), code - 1);
        }
    }

    #[test]
    fn values_out_of_range_are_clamped() {
        let encoder = SrgbEncoder::new();
        for (linear, code) in [(-1.0, 0), (f32::NEG_INFINITY, 0), (f32::NAN, 0), (2.0, 255), (f32::INFINITY, 255)] {
            assert_eq!(encoder.code(linear), code, "{linear}");
            assert_eq!(encoder.encode(linear), f32::from(code) / 255.0, "{linear}");
        }
    }

    #[test]
    fn curve_is_accurate_to_16_bits() {
        let encoder = SrgbEncoder::new();
        for bits in (0..=1.0_f32.to_bits()).step_by(991) {
            let linear = f32::from_bits(bits);
            let error = (f64::from(encoder.encode(linear)) - encode(f64::from(linear))).abs() * 65535.0;
            assert!(error < 0.02, "{linear}: off by {error} of a step");
        }
        for code in 0..=65535_u16 {
            let linear = linear_sample(f32::from(code) / 65535.0);
            assert_eq!((encoder.encode(linear) * 65535.0).round(), f32::from(code));
        }
    }

    #[test]
    fn aces_round_trip_keeps_colours() {
        // White maps to white, and the two matrices are inverse.
        for row in REC709_TO_AP1.iter().chain(&AP1_TO_REC709) {
            assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{row:?}");
        }
        for (i, row) in AP1_TO_REC709.iter().enumerate() {
            let there = [0, 1, 2].map(|j| (0..3).map(|k| row[k] * REC709_TO_AP1[k][j]).sum::<f32>());
            for (j, product) in there.into_iter().enumerate() {
                assert!((product - f32::from(u8::from(i == j))).abs() < 1e-5, "{i}, {j}: {product}");
            }
        }
    }
}
