//! Normals of a height field in millimetres, the same surface at every resolution.
//!
//! n = normalise(-s·∂h/∂x, ∓s·∂h/∂y, 1): x to the right, y up or down the picture, z towards the viewer. Memory-bound:
//! one plane in, three out.

use crate::ground::simd;
use crate::ground::window::{View, WindowExt};
use shibo_macros::choice;
use shibo_value::Window;

/// Filter for measuring slopes.
#[choice]
pub enum SlopeFilter {
    /// Central differences: the sharpest.
    Central,
    /// Weights 1 2 1 across: smoother.
    Sobel,
    /// Weights 3 10 3 across: the same in all directions.
    #[default]
    Scharr,
}

/// Parameters of [`normal`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalSpec {
    /// Size of a pixel, mm.
    pub step: [f64; 2],
    /// Factor on the height; 1 is true to scale.
    pub strength: f64,
    /// True if y points up the picture (OpenGL, glTF) rather than down.
    pub y_up: bool,
    /// True if components are stored as ½ + ½n.
    pub encode: bool,
    /// Filter for measuring slopes.
    pub slope: SlopeFilter,
}

/// Pixels read beyond the window.
pub const HALO: usize = 1;

/// Fills the planes `out` (x, y, z) over `rect` from heights in mm.
///
/// # Panics
/// If `input` does not cover `rect` grown by [`HALO`], or a plane is smaller than `rect`.
pub fn normal(input: &View<'_>, rect: Window, spec: &NormalSpec, out: [&mut [f32]; 3]) {
    simd::dispatch(
        #[inline(always)]
        || match (spec.slope, spec.encode) {
            (SlopeFilter::Central, true) => fill::<0, true>(input, rect, spec, out),
            (SlopeFilter::Central, false) => fill::<0, false>(input, rect, spec, out),
            (SlopeFilter::Sobel, true) => fill::<1, true>(input, rect, spec, out),
            (SlopeFilter::Sobel, false) => fill::<1, false>(input, rect, spec, out),
            (SlopeFilter::Scharr, true) => fill::<2, true>(input, rect, spec, out),
            (SlopeFilter::Scharr, false) => fill::<2, false>(input, rect, spec, out),
        },
    );
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "slopes need no more than f32")]
fn fill<const SLOPE: u8, const ENCODE: bool>(input: &View<'_>, rect: Window, spec: &NormalSpec, out: [&mut [f32]; 3]) {
    let (center, side) = [(1.0, 0.0), (0.5, 0.25), (0.625, 0.1875)][usize::from(SLOPE)];
    let kx = (-spec.strength / (2.0 * spec.step[0])) as f32;
    let ky = (-spec.strength / (2.0 * spec.step[1])) as f32 * if spec.y_up { -1.0 } else { 1.0 };
    let w = rect.columns();
    let [nx, ny, nz] = out;
    let rows = nx.chunks_exact_mut(w.max(1)).zip(ny.chunks_exact_mut(w.max(1))).zip(nz.chunks_exact_mut(w.max(1)));
    for (((nx, ny), nz), y) in rows.take(rect.rows()).zip(rect.y..) {
        // No `map` here: if it is not inlined, the lengths are lost, and with them the eight lanes.
        let (a, b, c) = (
            &input.row(rect.x - 1, y - 1, w + 2)[..w + 2],
            &input.row(rect.x - 1, y, w + 2)[..w + 2],
            &input.row(rect.x - 1, y + 1, w + 2)[..w + 2],
        );
        let (nx, ny, nz) = (&mut nx[..w], &mut ny[..w], &mut nz[..w]);
        for i in 0..w {
            let (dx, dy) = if SLOPE == 0 {
                (b[i + 2] - b[i], c[i + 1] - a[i + 1])
            } else {
                (
                    (b[i + 2] - b[i]) * center + ((a[i + 2] - a[i]) + (c[i + 2] - c[i])) * side,
                    (c[i + 1] - a[i + 1]) * center + ((c[i] - a[i]) + (c[i + 2] - a[i + 2])) * side,
                )
            };
            let (x, y) = (dx * kx, dy * ky);
            let z = 1.0 / (1.0 + x * x + y * y).sqrt();
            let encoded = |v: f32| if ENCODE { 0.5 + 0.5 * v } else { v };
            nx[i] = encoded(x * z);
            ny[i] = encoded(y * z);
            nz[i] = encoded(z);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_one_normal() {
        let (rect, big) = (Window::of(3, 4, 9, 5), Window::of(2, 3, 11, 7));
        let step = [0.5, 0.25];
        let data: Vec<f32> = (3..10u8)
            .flat_map(|y| (2..13u8).map(move |x| 0.75 * 0.5 * f32::from(x) + 0.4 * 0.25 * f32::from(y)))
            .collect();
        for slope in [SlopeFilter::Central, SlopeFilter::Sobel, SlopeFilter::Scharr] {
            for y_up in [true, false] {
                let spec = NormalSpec { step, strength: 2.0, y_up, encode: false, slope };
                let [mut x, mut y, mut z] = [(); 3].map(|()| vec![0.0; rect.len()]);
                normal(&View::new(&data, big), rect, &spec, [&mut x, &mut y, &mut z]);
                let length = (1.0f32 + 1.5 * 1.5 + 0.8 * 0.8).sqrt();
                let sign = if y_up { 1.0 } else { -1.0 };
                for i in 0..rect.len() {
                    assert!((x[i] + 1.5 / length).abs() < 1e-5);
                    assert!((y[i] - sign * 0.8 / length).abs() < 1e-5);
                    assert!((z[i] - 1.0 / length).abs() < 1e-5);
                }
            }
        }
    }
}
