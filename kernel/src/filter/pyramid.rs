//! Image pyramid for wide filters: planes at a half, a quarter … of the resolution, and enlarging them again.
//!
//! Coarse pixel I of level k covers pixels I·2^k … of the absolute grid, so results do not depend on the window.
//! Halving has the weights [1 3 3 1]/8 in x and y (variance ¾ of a pixel); enlarging uses a cubic B-spline (variance ⅓
//! of a coarse pixel).

use super::blur::bspline;
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_value::Window;

/// The pixels read by [`halve`] for `rect` of the coarse grid.
pub fn halve_reads(rect: Window) -> Window {
    Window::of(2 * rect.x - 1, 2 * rect.y - 1, 2 * rect.columns() + 2, 2 * rect.rows() + 2)
}

/// Halves a plane: `rect` counts in coarse pixels, `input` in fine ones.
///
/// # Panics
/// If `input` does not cover [`halve_reads`], or `out` is smaller than `rect`.
pub fn halve(input: &View<'_>, rect: Window, out: &mut [f32]) {
    let from = halve_reads(rect);
    simd::dispatch(
        #[inline(always)]
        || {
            let mut line = vec![0.0; from.columns()];
            for (out, y) in out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).zip(rect.y..) {
                let row = |d: i32| &input.row(from.x, 2 * y + d, from.columns())[..from.columns()];
                let (a, b, c, d) = (row(-1), row(0), row(1), row(2));
                for x in 0..from.columns() {
                    line[x] = (a[x] + d[x]) * 0.125 + (b[x] + c[x]) * 0.375;
                }
                for (out, (p, q)) in out.iter_mut().zip(line.chunks_exact(2).zip(line[2..].chunks_exact(2))) {
                    *out = (p[0] + q[1]) * 0.125 + (p[1] + q[0]) * 0.375;
                }
            }
        },
    );
}

/// The coarse pixels read by [`magnify`] for `rect` of the fine grid.
pub fn magnify_reads(rect: Window, levels: u32) -> Window {
    let (f, half) = (1 << levels, (1 << levels) / 2);
    let axis = |start: i32, n: usize| {
        let first = (start - half).div_euclid(f) - 1;
        (first, offset((start + index(n) - 1 - half).div_euclid(f) + 3 - first))
    };
    let ((x0, w), (y0, h)) = (axis(rect.x, rect.columns()), axis(rect.y, rect.rows()));
    Window::of(x0, y0, w, h)
}

/// Enlarges a coarse plane by `levels` doublings, at least one.
///
/// # Panics
/// If `coarse` does not cover [`magnify_reads`], or `out` is smaller than `rect`.
pub fn magnify(coarse: &View<'_>, levels: u32, rect: Window, out: &mut [f32]) {
    let factor = 1 << levels;
    let from = magnify_reads(rect, levels);
    let columns: Vec<(usize, [f32; 4])> = (rect.x..)
        .take(rect.columns())
        .map(|x| (offset((x - factor / 2).div_euclid(factor) - 1 - from.x), weights(x, factor)))
        .collect();
    simd::dispatch(
        #[inline(always)]
        || {
            let mut line = vec![0.0; from.columns()];
            for (out, y) in out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).zip(rect.y..) {
                let first = (y - factor / 2).div_euclid(factor) - 1;
                let row = |d: i32| &coarse.row(from.x, first + d, from.columns())[..from.columns()];
                let ([s, t, u, v], a, b, c, d) = (weights(y, factor), row(0), row(1), row(2), row(3));
                for x in 0..from.columns() {
                    line[x] = (a[x] * s + b[x] * t) + (c[x] * u + d[x] * v);
                }
                for (out, (start, w)) in out.iter_mut().zip(&columns) {
                    let p = &line[*start..*start + 4];
                    *out = (p[0] * w[0] + p[1] * w[1]) + (p[2] * w[2] + p[3] * w[3]);
                }
            }
        },
    );
}

/// Weights of the four coarse pixels around fine pixel `x`.
#[inline(always)]
fn weights(x: i32, factor: i32) -> [f32; 4] {
    bspline((x - factor / 2).rem_euclid(factor), factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_linear_ramps() {
        let rect = Window::of(-5, 7, 40, 30);
        let value = |x: f64, y: f64| 0.25 * x - 0.5 * y + 3.0;
        for levels in 1..4 {
            let size = f64::from(1 << levels);
            let mut window = magnify_reads(rect, levels);
            let wanted = window;
            (0..levels).for_each(|_| window = halve_reads(window));
            #[expect(clippy::cast_possible_truncation, reason = "a test")]
            let mut data: Vec<f32> = (window.y..)
                .take(window.rows())
                .flat_map(|y| {
                    (window.x..).take(window.columns()).map(move |x| value(f64::from(x), f64::from(y)) as f32)
                })
                .collect();
            for level in (0..levels).rev() {
                let mut smaller = wanted;
                (0..level).for_each(|_| smaller = halve_reads(smaller));
                let mut half = vec![0.0; smaller.len()];
                halve(&View::new(&data, window), smaller, &mut half);
                (data, window) = (half, smaller);
            }
            let middle = value((f64::from(window.x) + 0.5) * size - 0.5, (f64::from(window.y) + 0.5) * size - 0.5);
            assert!((f64::from(data[0]) - middle).abs() < 1e-4);
            let mut out = vec![0.0; rect.len()];
            magnify(&View::new(&data, window), levels, rect, &mut out);
            for (k, v) in (0..).zip(&out) {
                let want = value(f64::from(k % 40 - 5), f64::from(k / 40 + 7));
                assert!((f64::from(*v) - want).abs() < 1e-4, "{v} {want}");
            }
        }
    }
}
