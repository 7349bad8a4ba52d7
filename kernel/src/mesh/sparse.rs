//! Values of an expensive function on the texels of an atlas, from few of them: exact at the corners of square cells,
//! interpolated between them where the surface and the value change little.
//!
//! Cells lie on multiples of their size, counted from pixel (0, 0), and a cell uses its own pixels alone. So a window
//! has the same bits as the crop of a larger one. A cell is divided into four until its texels lie on one chart, their
//! normals are similar and the values of its corners are close; cells of one pixel are exact. The idea is that of the
//! irradiance cache (Ward, Rubinstein & Clear 1988), on a regular grid.
use crate::ground::window::{WindowExt, index, offset};
use glam::Vec3;
use shibo_value::{Atlas, Grid, Window};

/// The largest cell, in pixels.
const LARGEST: u32 = 8;
/// Least cosine of the angle between the normals of a cell's corners: 14°.
const SIMILAR: f32 = 0.97;

/// The size of the largest cells in pixels, a power of two: at most the size of the mesh's triangles, so that cells miss
/// no detail of it, and at most 8.
pub fn spacing(atlas: &Atlas, grid: &Grid) -> u32 {
    let triangle = (2.0 * atlas.area / atlas.uvs.len().max(1) as f64).sqrt();
    let texel = atlas.scale() * grid.step.max_element();
    let mut size = 1;
    while size < LARGEST && f64::from(2 * size) * texel <= triangle {
        size *= 2;
    }
    size
}

/// The pixels that cells of a `size` need to cover a window: from a multiple of the size to another one, inclusive.
#[must_use]
pub fn covered(window: Window, size: u32) -> Window {
    let size = size.cast_signed();
    let low = |at: i32| at.div_euclid(size) * size;
    let high = |end: i32| (end - 1).div_euclid(size) * size + size + 1;
    let (x, y) = (low(window.x), low(window.y));
    Window::of(x, y, offset(high(window.right()) - x), offset(high(window.bottom()) - y))
}

/// The texels of a window that [`covered`] gives, by rows.
pub struct Cells<'a> {
    /// The pixels.
    pub window: Window,
    /// The chart of each texel; `None` without a surface.
    pub charts: &'a [Option<u16>],
    /// The normal of each texel.
    pub normals: &'a [Vec3],
}

impl Cells<'_> {
    /// The values of all texels; NaN without a surface. `value` computes a texel by its index in the window, and `close`
    /// tells whether the least and the greatest value of a cell's corners are close enough to interpolate.
    ///
    /// # Errors
    ///
    /// Those of `value`.
    pub fn values<E>(
        &self,
        size: u32,
        close: impl Fn(f32, f32) -> bool,
        mut value: impl FnMut(usize) -> Result<f32, E>,
    ) -> Result<Vec<f32>, E> {
        // Each texel is written by the cell that begins at it or above and left of it, so no other cell changes it.
        let (mut exact, mut out) = (vec![f32::NAN; self.window.len()], vec![f32::NAN; self.window.len()]);
        let width = self.window.columns();
        let size = size as usize;
        // Cells that wait, as the index of their first pixel and their size.
        let mut cells: Vec<[usize; 2]> = Vec::new();
        for y in (0..self.window.rows() - 1).step_by(size) {
            cells.extend((0..width - 1).step_by(size).map(|x| [y * width + x, size]));
        }
        let mut known = |k: usize| -> Result<f32, E> {
            if exact[k].is_nan() && self.charts[k].is_some() {
                exact[k] = value(k)?;
            }
            Ok(exact[k])
        };
        while let Some([first, size]) = cells.pop() {
            if size == 1 {
                out[first] = known(first)?;
                continue;
            }
            if self.even(first, size) {
                let mut at = [0.0; 4];
                for (at, k) in at.iter_mut().zip(self.corners(first, size)) {
                    *at = known(k)?;
                }
                if close(at.iter().copied().fold(at[0], f32::min), at.iter().copied().fold(at[0], f32::max)) {
                    self.interpolate(first, size, at, &mut out);
                    continue;
                }
            }
            let half = size / 2;
            cells.extend(self.corners(first, half).map(|first| [first, half]));
        }
        Ok(out)
    }

    /// The corners of a cell: its first pixel, and those of its neighbours to the right, below and across.
    fn corners(&self, first: usize, size: usize) -> [usize; 4] {
        let down = size * self.window.columns();
        [first, first + size, first + down, first + down + size]
    }

    /// Returns true if a cell lies on one chart and turns little.
    fn even(&self, first: usize, size: usize) -> bool {
        let (width, own) = (self.window.columns(), self.charts[first]);
        let rows = || (0..=size).map(|row| first + row * width);
        let turned = |k: usize| self.normals[first].dot(self.normals[k]) < SIMILAR;
        own.is_some()
            && rows().all(|start| self.charts[start..=start + size].iter().all(|chart| *chart == own))
            && !self.corners(first, size).into_iter().any(turned)
    }

    /// Fills a cell bilinearly between its corners.
    fn interpolate(&self, first: usize, size: usize, [a, b, c, d]: [f32; 4], out: &mut [f32]) {
        let step = 1.0 / size as f32;
        for row in 0..size {
            let down = row as f32 * step;
            let (left, right) = (a + (c - a) * down, b + (d - b) * down);
            let start = first + row * self.window.columns();
            for (column, out) in out[start..start + size].iter_mut().enumerate() {
                *out = left + (right - left) * (column as f32 * step);
            }
        }
    }
}

/// The index in `outer` of the first pixel of a row of `inner`, which lies within it.
pub fn row_start(outer: Window, inner: Window, row: usize) -> usize {
    offset(inner.y + index(row) - outer.y) * outer.columns() + offset(inner.x - outer.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// A disk on one chart around (40, 30), another chart to the right of column 70, and a bent normal below row 50.
    fn surface(window: Window) -> (Vec<Option<u16>>, Vec<Vec3>) {
        let places = (0..window.len()).map(|k| (k % window.columns(), k / window.columns()));
        let places = places.map(|(x, y)| (window.x + index(x), window.y + index(y)));
        let chart = |(x, y): (i32, i32)| {
            let round = (x - 40).pow(2) + (y - 30).pow(2) < 900;
            (x > 70).then_some(1).or(round.then_some(0))
        };
        let normal = |(_, y): (i32, i32)| if y > 50 { Vec3::X } else { Vec3::Z };
        places.map(|at| (chart(at), normal(at))).unzip()
    }

    #[expect(clippy::cast_possible_truncation, reason = "between 0 and 1")]
    fn smooth(x: i32, y: i32) -> f32 {
        let (x, y) = (f64::from(x), f64::from(y));
        (0.5 + 0.3 * libm::sin(0.05 * x) * libm::cos(0.04 * y) + if x > 40.0 { 0.2 } else { 0.0 }) as f32
    }

    /// Values of a window, and the number of texels that were computed.
    fn values(window: Window, size: u32) -> (Vec<f32>, usize) {
        let outer = covered(window, size);
        let (charts, normals) = surface(outer);
        let mut count = 0;
        let cells = Cells { window: outer, charts: &charts, normals: &normals };
        let value = |k: usize| -> Result<f32, Infallible> {
            count += 1;
            assert!(charts[k].is_some());
            Ok(smooth(outer.x + index(k % outer.columns()), outer.y + index(k / outer.columns())))
        };
        let Ok(all) = cells.values(size, |low, high| high - low < 0.1, value);
        let rows = (0..window.rows()).map(|row| row_start(outer, window, row));
        (rows.flat_map(|start| all[start..start + window.columns()].to_vec()).collect(), count)
    }

    #[test]
    fn interpolates_even_places_and_computes_the_others() {
        let window = Window::of(-3, -5, 101, 83);
        let (exact, all) = values(window, 1);
        let (found, few) = values(window, 8);
        for (found, exact) in found.iter().zip(&exact) {
            assert_eq!(found.is_nan(), exact.is_nan());
            assert!(exact.is_nan() || (found - exact).abs() < 0.02, "{found} {exact}");
        }
        assert!(3 * few < all, "{few} of {all}");
    }

    #[test]
    fn a_window_has_the_bits_of_the_crop() {
        let whole = Window::of(-8, -8, 112, 96);
        let (all, _) = values(whole, 8);
        for part in [Window::of(0, 0, 8, 8), Window::of(37, 3, 21, 50), Window::of(-7, 40, 90, 1)] {
            let (found, _) = values(part, 8);
            for (row, found) in found.chunks(part.columns()).enumerate() {
                let start = row_start(whole, part, row);
                let crop = &all[start..start + part.columns()];
                assert!(found.iter().zip(crop).all(|(a, b)| a.to_bits() == b.to_bits()));
            }
        }
    }
}
