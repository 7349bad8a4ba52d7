//! Masks from signed distances.
use crate::ground::math::{saturate, smooth};
use crate::ground::simd;

/// Fills `out` with 1 inside, 0 outside. The transition is the wider of one pixel of `pixel` mm, and of `softness` mm,
/// half of it outside. `distance` is in mm, negative inside.
///
/// # Panics
/// If the slices differ in length.
pub fn fill(distance: &[f32], softness: f32, pixel: f32, out: &mut [f32]) {
    assert_eq!(distance.len(), out.len(), "a distance for each pixel");
    let rate = 1.0 / softness.max(pixel).max(f32::MIN_POSITIVE);
    simd::dispatch(
        #[inline(always)]
        || {
            if softness > pixel {
                out.iter_mut().zip(distance).for_each(|(out, d)| *out = smooth(0.5 - d * rate));
            } else {
                out.iter_mut().zip(distance).for_each(|(out, d)| *out = saturate(0.5 - d * rate));
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn softens_edge_by_pixel_or_softness() {
        let distance = [-0.3, -0.25, -0.1, 0.0, 0.1, 0.25, 0.3];
        let mut out = [0.0; 7];
        fill(&distance, 0.0, 0.5, &mut out);
        let want = [1.0, 1.0, 0.7, 0.5, 0.3, 0.0, 0.0];
        assert!(out.iter().zip(want).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-6), "{out:?}");
        fill(&distance, 1.0, 0.5, &mut out);
        assert!((out[3] - 0.5).abs() < 1e-6 && out[0] < 1.0 && out[0] > 0.85, "{out:?}");
        fill(&[f32::NAN, f32::INFINITY], 0.0, 0.5, &mut out[..2]);
        assert_eq!(out[..2], [0.0, 0.0]);
    }
}
