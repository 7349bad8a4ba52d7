//! Resamples a picture on a grid parallel to its own: weights are computed once per column and row, and each row is
//! filtered once.

use super::sample::{Filter, Outside, Pyramid};
use crate::ground::cubic::{bspline, catmull_rom};
use crate::ground::math;
use crate::ground::simd;
use crate::ground::window::WindowExt;
use shibo_value::Window;

/// Position of a window on a picture, in pixels of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedWindow {
    /// The window.
    pub window: Window,
    /// The corner of the grid's pixel (0, 0).
    pub origin: [f64; 2],
    /// Size of a pixel of the grid.
    pub step: [f64; 2],
    /// The interpolation filter.
    pub filter: Filter,
    /// Values outside the picture.
    pub outside: [Outside; 2],
}

/// Fills `out` over the window: with the filter if the grid is as fine as the picture, otherwise from its mip levels.
///
/// # Panics
/// If `out` is smaller than the window.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number ≥ 0")]
pub fn fill(picture: &Pyramid, place: &PlacedWindow, out: &mut [f32]) {
    let out = &mut out[..place.window.len()];
    // The tolerance makes a grid of equal size read the picture itself, despite rounding.
    let footprint = place.step[0].max(place.step[1]);
    let level = if footprint > 1.0 + 1e-9 { libm::log2(footprint) } else { 0.0 };
    let level = level.min((picture.levels() - 1) as f64);
    let mix = (level - level.floor()) as f32;
    let low = level as usize;
    read(picture, low, place, out);
    if mix > 0.0 && low + 1 < picture.levels() {
        let mut smaller = vec![0.0; out.len()];
        read(picture, low + 1, place, &mut smaller);
        for (out, b) in out.iter_mut().zip(&smaller) {
            *out = math::lerp(*out, *b, mix);
        }
    }
}

/// Four pixels and their weights.
#[derive(Clone, Copy)]
struct Taps {
    at: [usize; 4],
    weight: [f32; 4],
}

impl Taps {
    /// The taps for position `x` on a line of `n` pixels.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited, and brought into the line")]
    fn new(x: f64, n: usize, filter: Filter, outside: Outside) -> Self {
        let x = (x - 0.5).clamp(-1e15, 1e15);
        let snapped = x.round();
        let x = if (x - snapped).abs() < 1e-6 { snapped } else { x };
        let (cell, t) = (x.floor(), (x - x.floor()) as f32);
        let weight = match filter {
            Filter::Nearest if t < 0.5 => [0.0, 1.0, 0.0, 0.0],
            Filter::Nearest => [0.0, 0.0, 1.0, 0.0],
            Filter::Bilinear => [0.0, 1.0 - t, t, 0.0],
            Filter::CatmullRom => catmull_rom(t),
            Filter::BSpline => bspline(t),
        };
        let (cell, n) = (cell as i64, n as i64);
        let at = [cell - 1, cell, cell + 1, cell + 2].map(|i| match outside {
            Outside::Wrap => i.rem_euclid(n) as usize,
            Outside::Clamp => i.clamp(0, n - 1) as usize,
        });
        Self { at, weight }
    }
}

fn read(picture: &Pyramid, level: usize, place: &PlacedWindow, out: &mut [f32]) {
    let ((w0, h0, _), (w, h, data)) = (picture.level(0), picture.level(level));
    let filter = if level == 0 { place.filter } else { Filter::Bilinear };
    let taps = |k: usize, start: i32, count: usize, full: usize, n: usize| -> Vec<Taps> {
        let scale = n as f64 / full as f64;
        let position = |i: i32| (place.origin[k] + (f64::from(i) + 0.5) * place.step[k]) * scale;
        (start..).take(count).map(|i| Taps::new(position(i), n, filter, place.outside[k])).collect()
    };
    let rect = place.window;
    let columns = taps(0, rect.x, rect.columns(), w0, w);
    let rows = taps(1, rect.y, rect.rows(), h0, h);
    let mut lines = Lines { held: [usize::MAX; 4], data: [(); 4].map(|()| vec![0.0; rect.columns()]) };
    simd::dispatch(
        #[inline(always)]
        || {
            for (out, row) in out.chunks_exact_mut(rect.columns().max(1)).zip(&rows) {
                let [a, b, c, d] = lines.get(row, &columns, &data[..w * h], w);
                let [s, t, u, v] = row.weight;
                for x in 0..out.len() {
                    out[x] = (a[x] * s + b[x] * t) + (c[x] * u + d[x] * v);
                }
            }
        },
    );
}

/// Rows of the picture, filtered in x. The last four are kept.
struct Lines {
    held: [usize; 4],
    data: [Vec<f32>; 4],
}

impl Lines {
    #[inline(always)]
    fn get(&mut self, row: &Taps, columns: &[Taps], data: &[f32], w: usize) -> [&[f32]; 4] {
        for y in row.at {
            if self.held.contains(&y) {
                continue;
            }
            // A buffer that holds none of the four wanted rows. There is one, because row `y` is not held yet.
            let place = (0..4).find(|k| !row.at.contains(&self.held[*k])).unwrap_or(0);
            self.held[place] = y;
            let source = &data[y * w..(y + 1) * w];
            for (out, Taps { at, weight }) in self.data[place].iter_mut().zip(columns) {
                let [a, b, c, d] = [source[at[0]], source[at[1]], source[at[2]], source[at[3]]];
                *out = (a * weight[0] + b * weight[1]) + (c * weight[2] + d * weight[3]);
            }
        }
        row.at.map(|y| &*self.data[self.held.iter().position(|held| *held == y).unwrap_or(0)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> (Pyramid, Vec<f32>) {
        let data: Vec<f32> = (0..12 * 7).map(|k| (k * k % 23) as f32).collect();
        (Pyramid::new(data.clone(), 12, 7, [Outside::Wrap; 2]), data)
    }

    fn place(window: Window, step: f64) -> PlacedWindow {
        PlacedWindow {
            window,
            origin: [0.0; 2],
            step: [step; 2],
            filter: Filter::CatmullRom,
            outside: [Outside::Wrap; 2],
        }
    }

    #[test]
    fn pixels_are_exact_at_their_centres() {
        let (picture, data) = picture();
        for filter in [Filter::Nearest, Filter::Bilinear, Filter::CatmullRom] {
            let mut out = vec![0.0; 12 * 7 * 4];
            fill(&picture, &PlacedWindow { filter, ..place(Window::of(0, 0, 24, 14), 1.0) }, &mut out);
            for (k, v) in out.iter().enumerate() {
                assert_eq!(*v, data[(k / 24 % 7) * 12 + k % 24 % 12]);
            }
            let third = place(Window::of(0, 0, 36, 21), 1.0 / 3.0);
            let mut out = vec![0.0; 36 * 21];
            fill(&picture, &PlacedWindow { filter, ..third }, &mut out);
            assert!((0..84).all(|k| out[(k / 12 * 3 + 1) * 36 + k % 12 * 3 + 1] == data[k]));
        }
    }

    #[test]
    fn agrees_with_single_reads_and_keeps_the_mean() {
        let (picture, data) = picture();
        for step in [0.37, 1.9, 3.0] {
            let rect = Window::of(-5, -3, 40, 30);
            let mut out = vec![0.0; rect.len()];
            fill(&picture, &place(rect, step), &mut out);
            for (k, v) in (0..).zip(&out) {
                #[expect(clippy::cast_possible_truncation, reason = "a test")]
                let at = |i: i32| ((f64::from(i) + 0.5) * step) as f32;
                #[expect(clippy::cast_possible_truncation, reason = "a test")]
                let want = picture.at(at(k % 40 - 5), at(k / 40 - 3), step as f32, Filter::CatmullRom);
                assert!((v - want).abs() < 2e-3, "{v} {want}");
            }
        }
        let mut one = vec![0.0];
        fill(&picture, &place(Window::of(4, -9, 1, 1), 1e6), &mut one);
        let mean = data.iter().sum::<f32>() / 84.0;
        assert!((one[0] - mean).abs() < 1e-4);
    }
}
