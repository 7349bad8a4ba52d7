//! Cellular noise whose cells are stretched along a direction field.
//!
//! Source: F. Labelle, J. Shewchuk, "Anisotropic Voronoi diagrams" (2003): every position measures distances by its own
//! metric. Here that is the metric of the pixel, not of the point, so only the direction at the pixel is read, and
//! opposite directions are the same. Points lie in square cells of a [`CellGrid`] of the wanted area, one in each.
//!
//! A pixel visits the cells that intersect an ellipse around it, `aspect` times longer along the direction, and doubles
//! the ellipse until no point outside can matter. So the result is exact. Distances are those of
//! [`Worley`](super::worley::Worley): F1 and F2 in mm across the stretch, the border in true mm.
//!
//! Cost: about twenty points per pixel, about 200 ns.

use super::cells::{CellGrid, CellShape, LANES, Run, Wrap, lower_unit, scramble, upper_unit};
use super::worley::{Metric, WorleyOut, WorleySpec};
use crate::ground::hash::Hash;
use crate::ground::math::{cos_degrees, sin_degrees};
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, View, WindowExt, index, offset};
use glam::DVec2;
use shibo_value::Tiling;

/// Cells bound to a canvas and a seed; the angle of their [shape](WorleySpec::shape) is added to that of the field.
#[derive(Clone, Debug)]
pub struct WorleyAlong {
    grid: Option<CellGrid>,
    metric: Metric,
    jitter: f32,
    /// The added angle in degrees.
    angle: f32,
    aspect: f32,
    /// Size of a cell across its long direction, mm.
    size: f32,
    /// Cells to mm.
    to_mm: [[f32; 2]; 2],
    /// Maximum distance in cells of a cell that is read.
    most: i64,
}

/// Half the width of the first ellipse, in cell sizes; it nearly always suffices.
const FIRST: f32 = 1.3;
/// Half the width of the largest ellipse.
const LAST: f32 = 5.2;

impl WorleyAlong {
    /// Prepares the grid. With more than 10^9 cells on the canvas all outputs are 0.
    pub fn new(spec: &WorleySpec, canvas: (DVec2, Tiling), hash: Hash) -> Self {
        let CellShape { size, aspect, angle } = spec.shape;
        let side = size * aspect.sqrt();
        let grid = CellGrid::new(canvas, &CellShape::round(side), hash);
        let to_mm = grid.as_ref().map_or([[1.0, 0.0], [0.0, 1.0]], CellGrid::to_mm);
        // If cells are larger than a canvas that tiles, they shrink to fit it.
        let [[a, b], [c, d]] = to_mm;
        let size = ((a * d - b * c).abs() / aspect).sqrt();
        let dense = grid.as_ref().map_or(1.0, |grid| 1.0 / grid.pixels_per_cell([size; 2]));
        #[expect(clippy::cast_possible_truncation, reason = "at most a few hundred cells")]
        let most = (f64::from(LAST) * dense * aspect.max(1.0)).ceil().min(1e4) as i64 + 1;
        Self {
            grid,
            metric: spec.metric,
            jitter: spec.jitter * 0.875,
            angle: narrow(angle.to_degrees()),
            aspect: narrow(aspect),
            size: narrow(size),
            to_mm: to_mm.map(|row| row.map(narrow)),
            most,
        }
    }

    /// Fills the wanted planes over the frame's window. `angles` are degrees over that window.
    ///
    /// # Panics
    /// If a plane is smaller than the window.
    pub fn fill(&self, frame: &Frame, angles: &View<'_>, out: &mut WorleyOut<'_>) {
        let Some(grid) = &self.grid else { return };
        simd::dispatch(
            #[inline(always)]
            || self.rows(grid, frame, angles, out),
        );
    }

    #[inline(always)]
    fn rows(&self, grid: &CellGrid, frame: &Frame, angles: &View<'_>, out: &mut WorleyOut<'_>) {
        let (rect, lanes) = (frame.window, index(LANES));
        for (row, y) in (0..rect.rows()).zip(rect.y..) {
            let mut x = rect.x.div_euclid(lanes) * lanes;
            while x < rect.right() {
                let run = grid.run(frame, x, y, [-self.most, self.most]);
                let (from, to) = (rect.x.max(x), rect.right().min(x + lanes));
                let start = row * rect.columns() + offset(from - rect.x);
                for (at, column) in (start..).zip(from..to) {
                    let degrees = self.angle + angles.at(column, y);
                    let pixel = Pixel::new(self, &run, offset(column - x), degrees);
                    match run.wrap {
                        Wrap::None => pixel.write::<0>(at, out),
                        Wrap::Few => pixel.write::<1>(at, out),
                        Wrap::Many => pixel.write::<2>(at, out),
                    }
                }
                x += lanes;
            }
        }
    }
}

/// A pixel and its metric.
struct Pixel<'a> {
    cells: &'a WorleyAlong,
    run: &'a Run,
    /// Position in its cell, and the cell.
    place: (f32, f32, i32, i32),
    /// Cells to mm across the stretch, along and across the direction.
    compare: [[f32; 2]; 2],
    /// Cells to mm along and across the direction.
    true_mm: [[f32; 2]; 2],
}

/// A point: its compared distance, and its position in cells relative to the pixel.
#[derive(Clone, Copy)]
struct Point {
    distance: f32,
    word: u32,
    at: [f32; 2],
}

/// A distance beyond any point, with a finite square.
const FAR: Point = Point { distance: 1e30, word: 0, at: [0.0; 2] };

impl<'a> Pixel<'a> {
    #[inline(always)]
    fn new(cells: &'a WorleyAlong, run: &'a Run, lane: usize, degrees: f32) -> Self {
        let degrees = if degrees.is_finite() { degrees } else { 0.0 };
        let (sin, cos) = (sin_degrees(degrees), cos_degrees(degrees));
        let [[a, b], [c, d]] = cells.to_mm;
        let true_mm = [[cos * a + sin * c, cos * b + sin * d], [cos * c - sin * a, cos * d - sin * b]];
        let [along, across] = true_mm;
        let compare = [along.map(|v| v / cells.aspect), across];
        Self { cells, run, place: run.place(lane as f32), compare, true_mm }
    }

    #[inline(always)]
    fn write<const WRAP: u8>(&self, at: usize, out: &mut WorleyOut<'_>) {
        let (mut radius, last) = (FIRST * self.cells.size, LAST * self.cells.size);
        // The maximum ratio of the Euclidean distance to the compared one.
        let slack = if self.cells.metric == Metric::Chebyshev { std::f32::consts::SQRT_2 } else { 1.0 };
        let [first, second] = loop {
            let near = self.nearest::<WRAP>(radius);
            let reached =
                if self.cells.metric == Metric::Euclidean { near[1].distance.sqrt() } else { near[1].distance };
            if slack * reached <= radius || radius >= last {
                break near;
            }
            radius *= 2.0;
        };
        if let Some(border) = &mut out.border {
            border[at] = self.border::<WRAP>(&first, &second, radius);
        }
        let distance = |point: Point| {
            if self.cells.metric == Metric::Euclidean { point.distance.sqrt() } else { point.distance }
        };
        if let Some(f1) = &mut out.f1 {
            f1[at] = distance(first);
        }
        if let Some(f2) = &mut out.f2 {
            f2[at] = distance(second);
        }
        if let Some(id) = &mut out.id {
            id[at] = first.word;
        }
        if let Some(value) = &mut out.value {
            value[at] = upper_unit(scramble(first.word));
        }
    }

    /// Visits the points in all cells that intersect the ellipse with the radius `radius` in mm across the stretch.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "limited to the cells that a run may read")]
    fn visit<const WRAP: u8>(&self, radius: f32, mut each: impl FnMut(u32, f32, f32)) {
        let (x, y, u, v) = self.place;
        let [[p, q], [r, s]] = self.compare;
        // The ellipse is a i² + 2 b i j + c j² = radius².
        let (a, b, c) = (p * p + r * r, p * q + r * s, q * q + s * s);
        let det = (a * c - b * b).max(1e-30);
        let most = self.cells.most as f32;
        let bring = |cell: f32| cell.floor().clamp(-most, most) as i32;
        let high = radius * (a / det).sqrt();
        let (middle, narrowing) = (b / a, det / (a * a));
        for j in bring(y - high)..=bring(y + high) {
            let (top, bottom) = (j as f32 - y, j as f32 - y + 1.0);
            let nearest = if top > 0.0 { top } else { bottom.min(0.0) };
            let half = (radius * radius / a - narrowing * nearest * nearest).max(0.0).sqrt();
            let (one, other) = (-middle * top, -middle * bottom);
            for i in bring(x + one.min(other) - half)..=bring(x + one.max(other) + half) {
                let word = self.run.word::<WRAP>(u + i, v + j);
                let jitter = self.cells.jitter;
                let px = 0.5 + (upper_unit(word) - 0.5) * jitter + (i as f32 - x);
                let py = 0.5 + (lower_unit(word) - 0.5) * jitter + (j as f32 - y);
                each(word, px, py);
            }
        }
    }

    /// The two nearest points within `radius`.
    #[inline(always)]
    fn nearest<const WRAP: u8>(&self, radius: f32) -> [Point; 2] {
        let ([[a, b], [c, d]], metric) = (self.compare, self.cells.metric);
        let mut near = [FAR; 2];
        self.visit::<WRAP>(radius, |word, px, py| {
            let (mx, my) = (a * px + b * py, c * px + d * py);
            let distance = match metric {
                Metric::Euclidean => mx * mx + my * my,
                Metric::Manhattan => mx.abs() + my.abs(),
                Metric::Chebyshev => mx.abs().max(my.abs()),
            };
            let point = Point { distance, word, at: [px, py] };
            if distance < near[0].distance {
                near = [point, near[0]];
            } else if distance < near[1].distance {
                near[1] = point;
            }
        });
        near
    }

    /// Least distance, in true mm, to a bisector between the nearest point and another one, in the metric of the pixel.
    #[inline(always)]
    fn border<const WRAP: u8>(&self, first: &Point, second: &Point, radius: f32) -> f32 {
        let [[p, q], [r, s]] = self.compare;
        let squared = |[i, j]: [f32; 2]| {
            let (mx, my) = (p * i + q * j, r * i + s * j);
            mx * mx + my * my
        };
        let own = squared(first.at);
        // The maximum change of the stretched distance per true mm.
        let steep = (1.0 / self.cells.aspect).max(1.0);
        let bisect = |at: [f32; 2]| {
            let [di, dj] = [at[0] - first.at[0], at[1] - first.at[1]];
            if di * di + dj * dj < 1e-6 {
                return FAR.distance;
            }
            // (b - a)·(b + a), which has less cancellation, divided by the length of the gradient.
            let sum = [at[0] + first.at[0], at[1] + first.at[1]];
            let gap = (p * di + q * dj) * (p * sum[0] + q * sum[1]) + (r * di + s * dj) * (r * sum[0] + s * sum[1]);
            let [along, across] = self.true_mm;
            let stretch = 1.0 / (self.cells.aspect * self.cells.aspect);
            let (gx, gy) = (stretch * (along[0] * di + along[1] * dj), across[0] * di + across[1] * dj);
            0.5 * gap.max(0.0) / (gx * gx + gy * gy).max(1e-30).sqrt()
        };
        let mut best = bisect(second.at);
        let reach = |best: f32| (own.sqrt() + 2.0 * steep * best).min(LAST * self.cells.size);
        let mut searched = radius;
        loop {
            self.visit::<WRAP>(searched, |_, i, j| best = best.min(bisect([i, j])));
            if reach(best) <= searched {
                return best;
            }
            searched = reach(best);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shibo_value::Window;

    const CANVAS: (DVec2, Tiling) = (DVec2::new(60.0, 40.0), Tiling::BOTH);

    /// Degrees at a position: eddies that repeat with the canvas.
    fn eddies(x: f64, y: f64) -> f32 {
        narrow(70.0 * libm::sin(x * std::f64::consts::TAU / 60.0) + 40.0 * libm::cos(y * std::f64::consts::TAU / 20.0))
    }

    fn angles(frame: &Frame) -> Vec<f32> {
        let rect = frame.window;
        let at = |x, y| eddies(frame.center(x, y)[0], frame.center(x, y)[1]);
        (rect.y..rect.bottom()).flat_map(|y| (rect.x..rect.right()).map(move |x| at(x, y))).collect()
    }

    fn render(spec: &WorleySpec, seed: u64, rect: Window, step: f64) -> [Vec<f32>; 3] {
        let [mut f1, mut f2, mut border] = [(); 3].map(|()| vec![0.0; rect.len()]);
        let cells = WorleyAlong::new(spec, CANVAS, Hash::new(seed));
        let frame = Frame::new(rect, [step, step]);
        let mut out =
            WorleyOut { f1: Some(&mut f1), f2: Some(&mut f2), border: Some(&mut border), ..WorleyOut::default() };
        cells.fill(&frame, &View::new(&angles(&frame), rect), &mut out);
        [f1, f2, border]
    }

    /// The definition: all points of a large neighbourhood, with distances measured along and across the direction.
    fn by_definition(spec: &WorleySpec, seed: u64, frame: &Frame, (x, y): (i32, i32)) -> [f64; 3] {
        let CellShape { size, aspect, angle } = spec.shape;
        let grid = CellGrid::new(CANVAS, &CellShape::round(size * aspect.sqrt()), Hash::new(seed)).unwrap();
        let p = frame.center(x, y);
        let place = grid.place(p);
        let to_mm = grid.to_mm();
        let turn = angle + f64::from(eddies(p[0], p[1])).to_radians();
        let (sin, cos) = (libm::sin(turn), libm::cos(turn));
        let mut points = Vec::new();
        for j in -40..=40 {
            for i in -40..=40 {
                #[expect(clippy::cast_possible_truncation, reason = "cells of a small canvas")]
                let cell = [place[0].floor() as i64 + i, place[1].floor() as i64 + j];
                let word = grid.word(cell[0], cell[1]);
                let random = [upper_unit(word), lower_unit(word)].map(f64::from);
                let away = [0, 1].map(|k: usize| {
                    cell[k] as f64 + 0.5 + (random[k] - 0.5) * 0.875 * f64::from(spec.jitter) - place[k]
                });
                let d = [0, 1].map(|k: usize| to_mm[k][0] * away[0] + to_mm[k][1] * away[1]);
                let (along, across) = ((cos * d[0] + sin * d[1]) / aspect, cos * d[1] - sin * d[0]);
                let distance = match spec.metric {
                    Metric::Euclidean => along.hypot(across),
                    Metric::Manhattan => along.abs() + across.abs(),
                    Metric::Chebyshev => along.abs().max(across.abs()),
                };
                points.push((distance, [along, across]));
            }
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let near = points[0].1;
        // From here to the line on which q(a) = q(b), whose gradient in mm is 2 (b - a), along by 1/aspect.
        let border = points[1..]
            .iter()
            .map(|(_, far)| {
                let square = |[a, b]: [f64; 2]| a * a + b * b;
                let (da, db) = (far[0] - near[0], far[1] - near[1]);
                (square(*far) - square(near)).max(0.0) / (2.0 * (da / aspect).hypot(db))
            })
            .fold(f64::INFINITY, f64::min);
        [points[0].0, points[1].0, border]
    }

    #[test]
    fn is_the_nearest_of_all_points() {
        for (metric, aspect, jitter) in [
            (Metric::Euclidean, 4.0, 1.0),
            (Metric::Euclidean, 0.3, 1.0),
            (Metric::Euclidean, 12.0, 0.0),
            (Metric::Manhattan, 3.0, 0.6),
            (Metric::Chebyshev, 3.0, 1.0),
        ] {
            let shape = CellShape { size: 2.3, aspect, angle: 0.4 };
            let spec = WorleySpec { shape, jitter, metric };
            let rect = Window::of(33, 17, 90, 3);
            let frame = Frame::new(rect, [0.4; 2]);
            let got = render(&spec, 5, rect, 0.4);
            for k in 0..rect.len() {
                let at = (rect.x + index(k % 90), rect.y + index(k / 90));
                let want = by_definition(&spec, 5, &frame, at);
                for plane in 0..3 {
                    let (got, want) = (f64::from(got[plane][k]), want[plane]);
                    assert!(
                        (got - want).abs() < 2e-4 * (1.0 + want),
                        "{metric:?} {aspect} {plane} {at:?}: {got} {want}"
                    );
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]
        #[test]
        fn repeats_and_tiles(seed: u64, size in 1.0f64..30.0, aspect in 0.2f64..8.0) {
            let shape = CellShape { size, aspect, angle: 0.3 };
            let spec = WorleySpec { shape, jitter: 1.0, metric: Metric::Euclidean };
            let here = render(&spec, seed, Window::of(0, 0, 240, 12), 0.25);
            let there = render(&spec, seed, Window::of(240, 160, 240, 12), 0.25);
            let part = render(&spec, seed, Window::of(17, 3, 100, 2), 0.25);
            for plane in 0..3 {
                prop_assert_eq!(&part[plane][..100], &here[plane][3 * 240 + 17..][..100]);
                for (a, b) in here[plane].iter().zip(&there[plane]) {
                    prop_assert!(f64::from((a - b).abs()) < 2e-3 * size, "{plane} {a} {b}");
                }
            }
        }
    }
}
