//! The mean curvature of a height field in millimetres.
//!
//! H = ((1 + h_y²) h_xx − 2 h_x h_y h_xy + (1 + h_x²) h_yy) / (2 (1 + h_x² + h_y²)^{3/2}), with the opposite sign, so
//! that convex parts are positive: a ball of radius R has 1/R, an edge rounded with radius R has 1/(2R). Derivatives
//! are differences over one pixel on each side.

use crate::ground::simd;
use crate::ground::window::{View, WindowExt};
use shibo_value::Window;

/// Pixels read beyond the window.
pub const HALO: usize = 1;

/// Fills `out` over `rect` with the mean curvature in 1/mm, convex positive.
///
/// # Panics
/// If `input` does not cover `rect` grown by [`HALO`], or `out` is smaller than `rect`.
#[expect(clippy::cast_possible_truncation, reason = "derivatives need no more than f32")]
pub fn mean_curvature(input: &View<'_>, rect: Window, step: [f64; 2], out: &mut [f32]) {
    let [sx, sy] = step;
    let [kx, ky] = step.map(|step| (0.5 / step) as f32);
    let (kxx, kyy, kxy) = ((1.0 / (sx * sx)) as f32, (1.0 / (sy * sy)) as f32, (0.25 / (sx * sy)) as f32);
    let w = rect.columns();
    simd::dispatch(
        #[inline(always)]
        || {
            for (out, y) in out.chunks_exact_mut(w.max(1)).take(rect.rows()).zip(rect.y..) {
                let row = |y: i32| &input.row(rect.x - 1, y, w + 2)[..w + 2];
                let (a, b, c) = (row(y - 1), row(y), row(y + 1));
                let out = &mut out[..w];
                for i in 0..w {
                    // Clamp: the square of a slope above a million could overflow.
                    let hx = ((b[i + 2] - b[i]) * kx).clamp(-1e6, 1e6);
                    let hy = ((c[i + 1] - a[i + 1]) * ky).clamp(-1e6, 1e6);
                    let hxx = ((b[i + 2] - b[i + 1]) + (b[i] - b[i + 1])) * kxx;
                    let hyy = ((c[i + 1] - b[i + 1]) + (a[i + 1] - b[i + 1])) * kyy;
                    let hxy = ((c[i + 2] - c[i]) - (a[i + 2] - a[i])) * kxy;
                    let squares = 1.0 + hx * hx + hy * hy;
                    let sum = ((1.0 + hy * hy) * hxx + (1.0 + hx * hx) * hyy) - 2.0 * (hx * hy) * hxy;
                    let value = -0.5 * sum / (squares * squares.sqrt());
                    out[i] = value.clamp(-1e9, 1e9);
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Curvature at the middle of a surface, given by its height.
    fn of(height: impl Fn(f64, f64) -> f64, step: [f64; 2]) -> f32 {
        let big = Window::of(-1, -1, 3, 3);
        #[expect(clippy::cast_possible_truncation, reason = "a test")]
        let data: Vec<f32> =
            (0..9).map(|k| height(f64::from(k % 3 - 1) * step[0], f64::from(k / 3 - 1) * step[1]) as f32).collect();
        let mut out = [0.0];
        mean_curvature(&View::new(&data, big), Window::of(0, 0, 1, 1), step, &mut out);
        out[0]
    }

    #[test]
    fn balls_and_cylinders() {
        // At the top, and on the slopes.
        for (x, y) in [(0.0, 0.0), (1.0, 0.5), (-1.2, 0.9)] {
            let ball = |dx: f64, dy: f64| (4.0 - (x + dx) * (x + dx) - (y + dy) * (y + dy)).sqrt();
            let hollow = |dx: f64, dy: f64| -ball(dx, dy);
            let cylinder = |dx: f64, _: f64| (4.0 - (x + dx) * (x + dx)).sqrt();
            assert!((of(ball, [0.02, 0.03]) - 0.5).abs() < 0.005, "{}", of(ball, [0.02, 0.03]));
            assert!((of(hollow, [0.02, 0.03]) + 0.5).abs() < 0.005);
            assert!((of(cylinder, [0.02, 0.03]) - 0.25).abs() < 0.003);
        }
        // A saddle, rotated by 45°.
        assert!(of(|x, y| 3.0 * x * y, [0.1, 0.1]).abs() < 1e-5);
    }
}
