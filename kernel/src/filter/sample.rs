//! Sampling of planes between pixels, and of pictures at reduced size.
//!
//! Positions are absolute, in pixels of the plane's own grid: the centre of pixel (i, j) is (i + ½, j + ½). At a
//! pixel's centre, every filter except the B-spline gives exactly the pixel's own value.

use crate::ground::cubic::{bspline, catmull_rom};
use crate::ground::math::{clamp, lerp};
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_macros::choice;
use shibo_value::Window;

/// The interpolation between pixel centres.
#[choice]
pub enum Filter {
    /// The nearest pixel.
    Nearest,
    /// Linear in x and y.
    Bilinear,
    /// Cubic and sharp; overshoots a little at edges.
    #[default]
    CatmullRom,
    /// Cubic and smooth; pixels lose a little contrast.
    // Cubic B-spline: smooth, never overshoots, blurs by a variance of ⅓ pixel².
    BSpline,
}

/// Values outside the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Outside {
    /// The plane repeats.
    Wrap,
    /// The border pixels are repeated.
    #[default]
    Clamp,
}

/// A plane with its sampling rule.
#[derive(Clone, Copy, Debug)]
pub struct Sampler<'a> {
    view: View<'a>,
    filter: Filter,
    outside: [Outside; 2],
}

impl<'a> Sampler<'a> {
    /// Samples `view`, which has at least one pixel; `outside` for x and y.
    pub const fn new(view: View<'a>, filter: Filter, outside: [Outside; 2]) -> Self {
        Self { view, filter, outside }
    }

    /// Halo for positions within a rectangle, including its border.
    pub const fn halo(filter: Filter) -> usize {
        match filter {
            Filter::Nearest => 1,
            Filter::Bilinear => 1,
            Filter::CatmullRom | Filter::BSpline => 2,
        }
    }

    /// Values at the positions (xs, ys).
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn fill(&self, xs: &[f32], ys: &[f32], out: &mut [f32]) {
        assert!(xs.len() == out.len() && ys.len() == out.len(), "one position per value");
        for (out, (x, y)) in out.iter_mut().zip(xs.iter().zip(ys)) {
            *out = self.at(*x, *y);
        }
    }

    /// Value at one position; a NaN position reads as 0.
    #[inline]
    pub fn at(&self, x: f32, y: f32) -> f32 {
        match self.filter {
            Filter::Nearest => self.pixel(cell(x).0, cell(y).0),
            Filter::Bilinear => {
                let ((i, u), (j, v)) = (cell(x - 0.5), cell(y - 0.5));
                let row = |j: i32| lerp(self.pixel(i, j), self.pixel(i + 1, j), u);
                lerp(row(j), row(j + 1), v)
            }
            Filter::CatmullRom => self.cubic(x, y, catmull_rom),
            Filter::BSpline => self.cubic(x, y, bspline),
        }
    }

    #[inline(always)]
    fn cubic(&self, x: f32, y: f32, weights: fn(f32) -> [f32; 4]) -> f32 {
        let ((i, u), (j, v)) = (cell(x - 0.5), cell(y - 0.5));
        let (wx, wy, rect) = (weights(u), weights(v), self.view.window());
        let inside = i > rect.x && j > rect.y && i + 2 < rect.right() && j + 2 < rect.bottom();
        let mut sum = 0.0;
        for (dj, wy) in (-1..).zip(wy) {
            let values = if inside {
                let row = self.view.row(i - 1, j + dj, 4);
                [row[0], row[1], row[2], row[3]]
            } else {
                [-1, 0, 1, 2].map(|di| self.pixel(i + di, j + dj))
            };
            sum += wy * ((values[0] * wx[0] + values[1] * wx[1]) + (values[2] * wx[2] + values[3] * wx[3]));
        }
        sum
    }

    #[inline(always)]
    fn pixel(&self, x: i32, y: i32) -> f32 {
        let rect = self.view.window();
        self.view.at(bring(x, rect.x, rect.columns(), self.outside[0]), bring(y, rect.y, rect.rows(), self.outside[1]))
    }
}

/// The integer part and the fraction of a position of moderate size.
#[inline(always)]
fn cell(x: f32) -> (i32, f32) {
    let floor = clamp(x, -1e9, 1e9).floor();
    #[expect(clippy::cast_possible_truncation, reason = "limited just above")]
    let i = floor as i32;
    (i, clamp(x - floor, 0.0, 1.0))
}

#[inline(always)]
fn bring(x: i32, start: i32, n: usize, outside: Outside) -> i32 {
    let (k, n) = (x - start, index(n));
    if (0..n).contains(&k) {
        return x;
    }
    match outside {
        Outside::Wrap => start + k.rem_euclid(n),
        Outside::Clamp => start + k.clamp(0, n - 1),
    }
}

/// A plane and its mip levels, for sampling at reduced size.
#[derive(Clone, Debug)]
pub struct Pyramid {
    levels: Vec<(usize, usize, Vec<f32>)>,
    outside: [Outside; 2],
}

impl Pyramid {
    /// Builds the levels by exact area averages (also for odd sizes) down to one pixel.
    ///
    /// # Panics
    /// If `data` has not `w`·`h` values or is empty.
    pub fn new(data: Vec<f32>, w: usize, h: usize, outside: [Outside; 2]) -> Self {
        assert!(!data.is_empty() && data.len() == w * h, "a picture of {w} × {h}");
        let mut levels = vec![(w, h, data)];
        while let Some((w, h, data)) = levels.last().filter(|(w, h, _)| w.max(h) > &1) {
            let (nw, nh) = (w.div_ceil(2), h.div_ceil(2));
            let rows: Vec<f32> = data.chunks_exact(*w).flat_map(|row| halve(row, 1, nw)).collect();
            let half = halve(&rows, nw, nh);
            levels.push((nw, nh, half));
        }
        Self { levels, outside }
    }

    /// Width, height and values of a level.
    pub(crate) fn level(&self, level: usize) -> (usize, usize, &[f32]) {
        let (w, h, data) = &self.levels[level.min(self.levels.len() - 1)];
        (*w, *h, data)
    }

    /// Number of levels.
    pub const fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Value at a position in pixels of the full plane, averaged over about `footprint` pixels: with `filter` up to one
    /// pixel, trilinear above.
    #[inline]
    pub fn at(&self, x: f32, y: f32, footprint: f32, filter: Filter) -> f32 {
        let level = if footprint > 1.0 { crate::ground::math::log2(footprint) } else { 0.0 };
        let level = clamp(level, 0.0, (self.levels.len() - 1) as f32);
        let (low, mix) = cell(level);
        let read = |k: usize| {
            let (w, h, data) = &self.levels[k];
            let (w0, h0, _) = &self.levels[0];
            let sampler = Sampler::new(
                View::new(data, Window::of(0, 0, *w, *h)),
                if k == 0 { filter } else { Filter::Bilinear },
                self.outside,
            );
            sampler.at(x * (*w as f32 / *w0 as f32), y * (*h as f32 / *h0 as f32))
        };
        let low = offset(low);
        if mix > 0.0 && low + 1 < self.levels.len() { lerp(read(low), read(low + 1), mix) } else { read(low) }
    }
}

/// Area averages of a group of rows (each `width` wide) over `n` equal parts.
fn halve(line: &[f32], width: usize, n: usize) -> Vec<f32> {
    let count = line.len() / width;
    let size = count as f64 / n as f64;
    let mut out = Vec::with_capacity(n * width);
    for k in 0..n {
        let (from, to) = (k as f64 * size, (k + 1) as f64 * size);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "row numbers")]
        let (first, last) = (from as usize, (to.ceil() as usize).min(count));
        for x in 0..width {
            let part = |y: usize| (to.min(y as f64 + 1.0) - from.max(y as f64)) * f64::from(line[y * width + x]);
            #[expect(clippy::cast_possible_truncation, reason = "an average of f32")]
            out.push(((first..last).map(part).sum::<f64>() / size) as f32);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn centres_are_exact_and_lines_stay_straight(x in 2i32..8, y in 2i32..6, u in 0f32..1.0) {
            let data: Vec<f32> = (0..80u8).map(|k| f32::from(k % 10) * 2.0 + f32::from(k / 10) * 5.0).collect();
            let view = View::new(&data, Window::of(0, 0, 10, 8));
            for filter in [Filter::Nearest, Filter::Bilinear, Filter::CatmullRom] {
                let sampler = Sampler::new(view, filter, [Outside::Wrap; 2]);
                prop_assert_eq!(sampler.at(x as f32 + 0.5, y as f32 + 0.5), view.at(x, y));
                prop_assert_eq!(sampler.at(x as f32 + 10.5, y as f32 - 7.5), view.at(x, y));
            }
            for filter in [Filter::Bilinear, Filter::CatmullRom, Filter::BSpline] {
                let sampler = Sampler::new(view, filter, [Outside::Clamp; 2]);
                let at = sampler.at((x - 1) as f32 + 0.5 + u, y as f32 + 0.5);
                prop_assert!((at - (view.at(x - 1, y) + 2.0 * u)).abs() < 1e-4 || y > 5);
            }
        }
    }

    #[test]
    fn pyramids_keep_the_mean() {
        let data: Vec<f32> = (0..35u8).map(|k| f32::from(k * 7 % 11)).collect();
        let mean = data.iter().sum::<f32>() / 35.0;
        let pyramid = Pyramid::new(data.clone(), 7, 5, [Outside::Wrap; 2]);
        assert_eq!(pyramid.levels(), 4);
        assert!((pyramid.at(3.0, 2.0, 64.0, Filter::Bilinear) - mean).abs() < 1e-5);
        assert_eq!(pyramid.at(2.5, 3.5, 1.0, Filter::CatmullRom), data[3 * 7 + 2]);
    }
}
