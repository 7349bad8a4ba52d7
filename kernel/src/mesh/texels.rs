//! The triangle of each pixel of an atlas.
//!
//! A pixel belongs to the triangle that contains its centre, of several to the lowest one. Edges count as inside, with
//! a tolerance of 1e-9 in barycentric coordinates. These are computed in `f64` from positions on the canvas and never
//! from the window, so a window has the same bits as the crop of a larger one.
//!
//! Cost: O(pixels + rows of triangles).
use crate::ground::window::{WindowExt, index};
use glam::DVec2;
use shibo_value::{Atlas, Grid, Window};
use std::ops::Range;

/// Distance outside a triangle at which a centre still counts, in barycentric coordinates.
const TOLERANCE: f64 = 1e-9;
/// Width of a chart's gutter, in pixels beyond its border.
pub const GUTTER: i32 = 2;

/// The centres of the columns or rows of a window in the unit square.
pub(super) fn centers(origin: f64, step: f64, size: f64, first: i32, count: usize) -> Vec<f64> {
    (first..).take(count).map(|i| (origin + (f64::from(i) + 0.5) * step) / size).collect()
}

/// The triangles that may contain pixels between two corners of the unit square, in ascending order.
pub fn near(atlas: &Atlas, low: DVec2, high: DVec2) -> Vec<u32> {
    let (low, high) = (low - 1e-6, high + 1e-6);
    let mut found = Vec::new();
    if !(low.cmple(DVec2::ONE).all() && high.cmpge(DVec2::ZERO).all()) {
        return found;
    }
    let last = f64::from(atlas.bins.side - 1);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the cells")]
    let cell = |x: f64| (x * f64::from(atlas.bins.side)).clamp(0.0, last) as u32;
    for row in cell(low.y)..=cell(high.y) {
        for column in cell(low.x)..=cell(high.x) {
            found.extend_from_slice(atlas.bins.cell(column, row));
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// A barycentric coordinate along a row: `slope · (u - from) + base`.
#[derive(Clone, Copy)]
struct Side {
    slope: f64,
    rise: f64,
    from: DVec2,
    /// 1 / slope, for estimates.
    inverse: f64,
}

/// The barycentric coordinates of a triangle of the unit square.
#[derive(Clone, Copy)]
pub(super) struct Barycentric([Side; 3]);

impl Barycentric {
    /// `None` for a triangle without area.
    pub(super) fn new(corners: [DVec2; 3]) -> Option<Self> {
        let det = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        let side = |k: usize| {
            let (from, to) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let slope = -(to - from).y / det;
            Side { slope, rise: (to - from).x / det, from, inverse: 1.0 / slope }
        };
        (det != 0.0).then(|| Self([0, 1, 2].map(side)))
    }

    /// The three coordinates of a point.
    pub(super) fn at(&self, place: DVec2) -> [f64; 3] {
        self.0.map(|side| side.slope * (place.x - side.from.x) + side.rise * (place.y - side.from.y))
    }

    /// The same along a row: slope, `from` and base of each coordinate.
    pub(super) fn row(&self, v: f64) -> [[f64; 3]; 3] {
        self.0.map(|side| [side.slope, side.from.x, side.rise * (v - side.from.y)])
    }

    /// Returns whether a point counts as inside.
    #[cfg(test)]
    fn holds(&self, at: DVec2) -> bool {
        self.at(at).iter().all(|b| *b >= -TOLERANCE)
    }

    /// The columns of a row at whose centres all coordinates are at least `least`, as a range within `first..last`.
    ///
    /// Each coordinate is monotonic along a row, rounding included. So each bounds a run of columns, whose ends are
    /// first estimated and then found exactly.
    fn run(
        &self,
        (us, column): (&[f64], Columns),
        v: f64,
        (mut first, mut last): (usize, usize),
        least: f64,
    ) -> (usize, usize) {
        let base = self.0.map(|side| side.rise * (v - side.from.y));
        for (side, base) in self.0.iter().zip(base) {
            if side.slope == 0.0 {
                if base < least {
                    return (0, 0);
                }
                continue;
            }
            let end = column.at(side.from.x - (base - least) * side.inverse);
            if side.slope > 0.0 {
                first = first.max(end.saturating_sub(1));
            } else {
                last = last.min(end + 2);
            }
        }
        let inside =
            |u: f64| self.0.iter().zip(base).all(|(side, base)| side.slope * (u - side.from.x) + base >= least);
        while first < last && !inside(us[first]) {
            first += 1;
        }
        while first < last && !inside(us[last - 1]) {
            last -= 1;
        }
        (first, last)
    }
}

/// Evenly spaced centres.
#[derive(Clone, Copy)]
struct Columns {
    first: f64,
    scale: f64,
    count: usize,
}

impl Columns {
    fn of(centers: &[f64]) -> Self {
        let (first, last) = (centers[0], centers[centers.len() - 1]);
        let scale = if last > first { (centers.len() - 1) as f64 / (last - first) } else { 0.0 };
        Self { first, scale, count: centers.len() }
    }

    /// The last column whose centre is not beyond `x`, with an error of at most one; 0 if there is none.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a float cast saturates, then a minimum"
    )]
    fn at(self, x: f64) -> usize {
        (((x - self.first) * self.scale) as usize).min(self.count)
    }
}

/// The triangle of each pixel of a window plus 1, or 0; rows from the top.
pub fn owners(atlas: &Atlas, grid: &Grid, window: Window) -> Vec<u32> {
    let mut out = vec![0; window.len()];
    if window.is_empty() {
        return out;
    }
    let size = atlas.size_mm;
    let us = centers(grid.origin.x, grid.step.x, size.x, window.x, window.columns());
    let vs = centers(grid.origin.y, grid.step.y, size.y, window.y, window.rows());
    let (low, high) = (DVec2::new(us[0], vs[0]), DVec2::new(us[us.len() - 1], vs[vs.len() - 1]));
    for n in near(atlas, low, high) {
        held(atlas, n as usize, (&us, &vs), -TOLERANCE, |row, run| {
            let start = row * us.len();
            let free = out[start + run.start..start + run.end].iter_mut();
            free.for_each(|owner| *owner = if *owner == 0 { n + 1 } else { *owner });
        });
    }
    out
}

/// Calls `body(row, columns)` for the centres whose barycentric coordinates in a triangle are at least `least`, among
/// columns at `us` and rows at `vs`.
pub(super) fn held(
    atlas: &Atlas,
    n: usize,
    (us, vs): (&[f64], &[f64]),
    least: f64,
    mut body: impl FnMut(usize, Range<usize>),
) {
    let corners = atlas.uvs[n].map(|uv| uv.as_dvec2());
    let Some(barycentric) = Barycentric::new(corners) else { return };
    let low = corners[0].min(corners[1]).min(corners[2]);
    let high = corners[0].max(corners[1]).max(corners[2]);
    let span = |c: Columns, low: f64, high: f64| (c.at(low).saturating_sub(1), (c.at(high) + 2).min(c.count));
    let columns = Columns::of(us);
    let (top, bottom) = span(Columns::of(vs), low.y, high.y);
    let within = span(columns, low.x, high.x);
    for (row, v) in vs.iter().enumerate().take(bottom).skip(top) {
        let (first, last) = barycentric.run((us, columns), *v, within, least);
        if first < last {
            body(row, first..last);
        }
    }
}

/// Squared distance from a point to a triangle that does not contain it.
fn distance(corners: [DVec2; 3], at: DVec2) -> f64 {
    let side = |k: usize| {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let along = (at - from).dot(to - from) / (to - from).length_squared();
        // A shared end of two edges must have the same distance from both triangles.
        let near = if along > 0.0 && along < 1.0 {
            from + (to - from) * along
        } else if along >= 1.0 {
            to
        } else {
            from
        };
        at.distance_squared(near)
    };
    side(0).min(side(1)).min(side(2))
}

/// The triangles of a window with their gutters, as the values of a field: the index of the triangle plus 1 within a
/// chart, the same negated up to [`GUTTER`] pixels beyond its border, and 0 elsewhere.
///
/// A pixel of the gutter belongs to the nearest of its eight neighbours' triangles.
pub fn fill(atlas: &Atlas, grid: &Grid, window: Window, out: &mut [f32]) {
    let around = window.grow(GUTTER, GUTTER);
    let mut ids = owners(atlas, grid, around);
    if ids.iter().all(|id| *id == 0) {
        out.fill(0.0);
        return;
    }
    // Pixels of the gutter have the top bit set.
    for left in (0..GUTTER).rev() {
        ids = grown(atlas, grid, &ids, window.grow(left, left));
    }
    #[expect(clippy::cast_precision_loss, reason = "there are fewer than 2²⁴ triangles")]
    let value = |id: u32| if id & BEYOND == 0 { id as f32 } else { -((id & !BEYOND) as f32) };
    out.iter_mut().zip(ids).for_each(|(out, id)| *out = value(id));
}

/// Marks a pixel of the gutter.
const BEYOND: u32 = 1 << 31;

/// Number of pixels of a row that are tested at once.
const AT_ONCE: usize = 32;

/// Adds one round of gutter to the pixels of `window`; the input has one more pixel on each side.
fn grown(atlas: &Atlas, grid: &Grid, ids: &[u32], window: Window) -> Vec<u32> {
    let width = window.columns() + 2;
    let mut out = Vec::with_capacity(window.len());
    for (row, y) in (0..window.rows()).zip(window.y..) {
        let rows: [&[u32]; 3] = std::array::from_fn(|k| &ids[(row + k) * width..(row + k + 1) * width]);
        let start = out.len();
        out.extend_from_slice(&rows[1][1..width - 1]);
        for first in (0..window.columns()).step_by(AT_ONCE) {
            let last = (first + AT_ONCE).min(window.columns());
            // Skip pixels in the middle of a chart or far from all charts, which are most.
            let full = rows[1][first + 1..last + 1].iter().fold(true, |full, id| full & (*id != 0));
            let any = |row: &[u32]| row[first..last + 2].iter().fold(0, |any, id| any | id);
            if full || rows.iter().fold(0, |all, row| all | any(row)) == 0 {
                continue;
            }
            for (column, x) in (first..last).zip(window.x + index(first)..) {
                if rows[1][column + 1] != 0 {
                    continue;
                }
                let three = |row: &[u32]| [row[column], row[column + 1], row[column + 2]];
                let around = rows.map(three);
                if around.as_flattened().iter().fold(0, |any, id| any | id) != 0 {
                    out[start + column] = BEYOND | nearest(atlas, grid.center(x, y), around.as_flattened());
                }
            }
        }
    }
    out
}

/// The triangle (of `ids`) nearest to a point on the canvas; of equals the lowest.
fn nearest(atlas: &Atlas, at: DVec2, ids: &[u32]) -> u32 {
    let mut best = (f64::INFINITY, u32::MAX);
    let mut last = 0;
    for id in ids.iter().map(|id| id & !BEYOND).filter(|id| *id != 0) {
        if id == last || id == best.1 {
            continue;
        }
        last = id;
        let corners = atlas.uvs[id as usize - 1].map(|uv| uv.as_dvec2() * atlas.size_mm);
        let distance = distance(corners, at);
        if distance < best.0 || (distance == best.0 && id < best.1) {
            best = (distance, id);
        }
    }
    best.1
}

/// The triangle of a field value, in its chart or its gutter.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number below 2²⁴")]
pub fn triangle(value: f32) -> Option<usize> {
    (value != 0.0).then(|| value.abs() as usize - 1)
}

#[cfg(test)]
#[path = "texels_tests.rs"]
mod tests;
