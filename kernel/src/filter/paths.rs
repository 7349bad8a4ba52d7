//! Blurs along paths: means over a line, an arc or a ray through each pixel.
//!
//! Values between pixels are bilinear. A line that is the same for all pixels is converted to a kernel once, and
//! applied to whole rows. Paths that differ from pixel to pixel are sampled one by one.

use crate::ground::math::{clamp, floor_int, lerp};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_value::Window;
use std::collections::BTreeMap;

/// Maximum number of samples of a path.
pub const MOST: usize = 512;

/// Number of samples for a path of this length in pixels: two per pixel, and odd, so that one lies in the middle.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to a few hundred")]
pub fn samples(pixels: f64) -> usize {
    2 * (pixels.abs().ceil().min(MOST as f64 / 2.0 - 1.0) as usize) + 1
}

/// Positions of the samples of a path, from -½ to ½ of its length.
fn places(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| if count == 1 { 0.0 } else { k as f64 / (count - 1) as f64 - 0.5 })
}

/// A line that is the same for all pixels, as a kernel.
#[derive(Clone, Debug)]
pub struct Line {
    taps: Vec<(i32, i32, f32)>,
}

impl Line {
    /// The line with this extent in pixels, in x and y.
    #[expect(clippy::cast_possible_truncation, reason = "small numbers of pixels, and weights in f32")]
    pub fn new(length: [f64; 2]) -> Self {
        let count = samples(length[0].abs().max(length[1].abs()));
        let mut taps: BTreeMap<(i32, i32), f64> = BTreeMap::new();
        for at in places(count) {
            let [x, y] = length.map(|length| (at * length).clamp(-1e6, 1e6));
            let (i, j) = (x.floor(), y.floor());
            let (u, v) = (x - i, y - j);
            for (dy, wy) in [(0, 1.0 - v), (1, v)] {
                for (dx, wx) in [(0, 1.0 - u), (1, u)] {
                    if wx * wy > 0.0 {
                        *taps.entry((j as i32 + dy, i as i32 + dx)).or_default() += wx * wy / count as f64;
                    }
                }
            }
        }
        Self { taps: taps.into_iter().map(|((dy, dx), weight)| (dx, dy, weight as f32)).collect() }
    }

    /// Halo in pixels, in x and y.
    pub fn halo(&self) -> [usize; 2] {
        let reach = |of: fn(&(i32, i32, f32)) -> i32| self.taps.iter().map(|t| of(t).unsigned_abs()).max().unwrap_or(0);
        [reach(|t| t.0) as usize, reach(|t| t.1) as usize]
    }

    /// Mean along the line through each pixel of `rect`.
    ///
    /// # Panics
    /// If `input` does not cover `rect` grown by the halo, or `out` is smaller than `rect`.
    pub fn apply(&self, input: &View<'_>, rect: Window, out: &mut [f32]) {
        simd::dispatch(
            #[inline(always)]
            || {
                for (out, y) in out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).zip(rect.y..) {
                    out.fill(0.0);
                    for (dx, dy, weight) in &self.taps {
                        let row = input.row(rect.x + dx, y + dy, rect.columns());
                        for (out, v) in out.iter_mut().zip(row) {
                            *out += weight * v;
                        }
                    }
                }
            },
        );
    }
}

/// Planes over one window, with bilinear sampling.
pub struct Reader<'a> {
    data: Vec<&'a [f32]>,
    stride: usize,
    window: Window,
}

/// Maximum number of channels.
const CHANNELS: usize = 4;

impl<'a> Reader<'a> {
    /// Takes views of one window of at least 2 × 2 pixels.
    ///
    /// # Panics
    /// If there are more than four views, or the window is smaller.
    pub fn new(views: &[View<'a>]) -> Self {
        let window = views[0].window();
        let [w, h] = [window.columns(), window.rows()];
        assert!(views.len() <= CHANNELS && w >= 2 && h >= 2, "up to four planes of 2 × 2 pixels");
        Self { data: views.iter().map(|view| view.raw().0).collect(), stride: views[0].raw().1, window }
    }

    /// Values at an offset in pixels from the centre of pixel (x, y), clamped to the window. The bits are the same in
    /// every window, because the offset is split into whole pixels and a fraction before it is added.
    #[inline(always)]
    pub fn at(&self, x: i32, y: i32, [dx, dy]: [f32; 2]) -> [f32; CHANNELS] {
        let part = |d: f32| {
            let d = clamp(d, -FARTHEST, FARTHEST);
            let (floor, cell) = floor_int(d);
            (cell, d - floor)
        };
        let ((i, u), (j, v)) = (part(dx), part(dy));
        let place = |at: i32, n: usize| offset(at.max(0)).min(n - 2);
        let column = place(x - self.window.x + i, self.window.columns());
        let row = place(y - self.window.y + j, self.window.rows());
        let start = row * self.stride + column;
        let mut values = [0.0; CHANNELS];
        for (value, data) in values.iter_mut().zip(&self.data) {
            let (a, b) = (&data[start..start + 2], &data[start + self.stride..start + self.stride + 2]);
            *value = lerp(lerp(a[0], a[1], u), lerp(b[0], b[1], u), v);
        }
        values
    }
}

/// Maximum offset in pixels; beyond it the fraction would be lost.
const FARTHEST: f32 = (1 << 20) as f32;

/// Fills `out` with means over paths. For each pixel, `path(x, y, pixel)` returns the number of samples and a function
/// that gives their offsets in pixels from the pixel's centre.
///
/// # Panics
/// If a plane is smaller than `rect`.
pub fn mean_along<P: Fn(f32) -> [f32; 2]>(
    reader: &Reader<'_>,
    rect: Window,
    path: impl Fn(i32, i32, usize) -> (usize, P),
    out: &mut [&mut [f32]],
) {
    for k in 0..rect.len() {
        let (x, y) = (rect.x + index(k % rect.columns()), rect.y + index(k / rect.columns()));
        let (count, place) = path(x, y, k);
        let mut sum = [0.0; CHANNELS];
        for s in 0..count {
            let at = if count == 1 { 0.0 } else { s as f32 / (count - 1) as f32 - 0.5 };
            let values = reader.at(x, y, place(at));
            sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
        }
        let share = 1.0 / count.max(1) as f32;
        out.iter_mut().zip(sum).for_each(|(out, sum)| out[k] = sum * share);
    }
}

/// The reduction of the values on a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduce {
    /// Their mean.
    Mean,
    /// Least value.
    Least,
    /// The greatest value.
    Greatest,
}

/// Follows `slope`, displacements in pixels per step in two planes, for `steps` steps from each pixel, and reduces the
/// values of `input` on the way, including the pixel itself.
///
/// # Panics
/// If a plane is smaller than `rect`.
pub fn follow(
    input: &Reader<'_>,
    slope: &Reader<'_>,
    rect: Window,
    (steps, reduce): (usize, Reduce),
    out: &mut [&mut [f32]],
) {
    for k in 0..rect.len() {
        let (x, y) = (rect.x + index(k % rect.columns()), rect.y + index(k / rect.columns()));
        let mut at = [0.0; 2];
        let mut all = input.at(x, y, at);
        for _ in 0..steps {
            let step = slope.at(x, y, at);
            at = [at[0] + step[0], at[1] + step[1]];
            for (all, v) in all.iter_mut().zip(input.at(x, y, at)) {
                *all = match reduce {
                    Reduce::Mean => *all + v,
                    Reduce::Least => all.min(v),
                    Reduce::Greatest => all.max(v),
                };
            }
        }
        let share = if reduce == Reduce::Mean { 1.0 / (steps + 1) as f32 } else { 1.0 };
        out.iter_mut().zip(all).for_each(|(out, v)| out[k] = v * share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::sample::{Filter, Outside, Sampler};

    fn picture(rect: Window) -> Vec<f32> {
        (0..rect.len()).map(|k| (k * k % 101) as f32 / 101.0).collect()
    }

    #[test]
    fn a_line_is_the_mean_of_its_samples() {
        let rect = Window::of(4, -2, 19, 7);
        for length in [[0.0, 0.0], [6.0, 0.0], [0.0, -5.0], [7.3, 4.1], [-3.0, 9.5]] {
            let line = Line::new(length);
            let big = rect.with_halo(line.halo().map(|n| n + 1));
            let data = picture(big);
            let view = View::new(&data, big);
            let sampler = Sampler::new(view, Filter::Bilinear, [Outside::Clamp; 2]);
            let (mut whole, mut each) = (vec![0.0; rect.len()], vec![0.0; rect.len()]);
            line.apply(&view, rect, &mut whole);
            let count = samples(length[0].abs().max(length[1].abs()));
            #[expect(clippy::cast_possible_truncation, reason = "a test")]
            let reach = length.map(|l| l as f32);
            let path = |_: i32, _: i32, _: usize| (count, move |at: f32| [at * reach[0], at * reach[1]]);
            mean_along(&Reader::new(&[view]), rect, path, &mut [&mut each]);
            for (k, got) in (0..).zip(&whole) {
                let (x, y) = ((rect.x + k % 19) as f32 + 0.5, (rect.y + k / 19) as f32 + 0.5);
                let want: f32 = (0..count)
                    .map(|s| if count == 1 { 0.0 } else { s as f32 / (count - 1) as f32 - 0.5 })
                    .map(|at| sampler.at(x + at * reach[0], y + at * reach[1]))
                    .sum::<f32>()
                    / count as f32;
                assert!((got - want).abs() < 2e-5 && (each[k as usize] - want).abs() < 2e-5, "{length:?} {got} {want}");
            }
        }
    }

    #[test]
    fn following_a_constant_slope_shifts() {
        let rect = Window::of(0, 0, 8, 5);
        let big = rect.with_halo([4, 4]);
        let data = picture(big);
        let view = View::new(&data, big);
        let (right, none) = (vec![1.0; big.len()], vec![0.0; big.len()]);
        let slope = Reader::new(&[View::new(&right, big), View::new(&none, big)]);
        for (reduce, want) in [
            (Reduce::Mean, Box::new(|v: [f32; 4]| v.iter().sum::<f32>() / 4.0) as Box<dyn Fn([f32; 4]) -> f32>),
            (Reduce::Least, Box::new(|v: [f32; 4]| v.into_iter().fold(9.0, f32::min))),
            (Reduce::Greatest, Box::new(|v: [f32; 4]| v.into_iter().fold(0.0, f32::max))),
        ] {
            let mut out = vec![0.0; rect.len()];
            follow(&Reader::new(&[view]), &slope, rect, (3, reduce), &mut [&mut out]);
            for (k, got) in (0..).zip(&out) {
                let values = [0, 1, 2, 3].map(|d| view.at(k % 8 + d, k / 8));
                assert!((got - want(values)).abs() < 1e-6);
            }
        }
    }
}
