//! The gradient of a field, per mm.

use crate::ground::simd;
use crate::ground::window::{View, WindowExt};
use shibo_value::Window;

/// Halo: pixels read beyond the window.
pub const HALO: usize = 1;

/// Fills `gx` and `gy` over `rect` with the slope of `input` per mm to the right and down: central differences, with
/// the weights 3 10 3 across (H. Scharr), which make them isotropic.
///
/// # Panics
/// If `input` does not cover `rect` grown by [`HALO`], or a plane is smaller than `rect`.
#[expect(clippy::cast_possible_truncation, reason = "slopes need no more than f32")]
pub fn slopes(input: &View<'_>, rect: Window, step: [f64; 2], gx: &mut [f32], gy: &mut [f32]) {
    let (center, side) = (0.625, 0.1875);
    let [kx, ky] = step.map(|step| (0.5 / step) as f32);
    let w = rect.columns();
    simd::dispatch(
        #[inline(always)]
        || {
            let rows = gx.chunks_exact_mut(w.max(1)).zip(gy.chunks_exact_mut(w.max(1)));
            for ((gx, gy), y) in rows.take(rect.rows()).zip(rect.y..) {
                let row = |y: i32| &input.row(rect.x - 1, y, w + 2)[..w + 2];
                let (a, b, c) = (row(y - 1), row(y), row(y + 1));
                let (gx, gy) = (&mut gx[..w], &mut gy[..w]);
                for i in 0..w {
                    gx[i] = kx * ((b[i + 2] - b[i]) * center + ((a[i + 2] - a[i]) + (c[i + 2] - c[i])) * side);
                    gy[i] = ky * ((c[i + 1] - a[i + 1]) * center + ((c[i] - a[i]) + (c[i + 2] - a[i + 2])) * side);
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_have_their_slope() {
        let (rect, step) = (Window::of(2, -1, 9, 4), [0.5, 0.25]);
        let big = rect.with_halo([HALO; 2]);
        let data: Vec<f32> = (0..big.len())
            .map(|k| 3.0 * 0.5 * (k % big.columns()) as f32 - 2.0 * 0.25 * (k / big.columns()) as f32)
            .collect();
        let (mut gx, mut gy) = (vec![0.0; rect.len()], vec![0.0; rect.len()]);
        slopes(&View::new(&data, big), rect, step, &mut gx, &mut gy);
        assert!(gx.iter().all(|g| (g - 3.0).abs() < 1e-5) && gy.iter().all(|g| (g + 2.0).abs() < 1e-5));
    }
}
