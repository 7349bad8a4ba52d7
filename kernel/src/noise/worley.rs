//! Cellular noise (S. Worley, "A cellular texture basis function", 1996), periodic on a canvas that tiles.
//!
//! One feature point per cell of a [`CellGrid`], up to 7/16 of a cell from its middle, so that the nine cells around a
//! pixel contain its two nearest points except in the rarest cases. With an aspect, points are compared in the
//! stretched space in which cells are round; F1 and F2 are mm across the stretch. The border distance is true mm in
//! every direction: to the bisector of the nearest point and each of the 24 points around (I. Quilez, "Voronoi edges").

use super::cells::{CellGrid, CellShape, LANES, RAMP, Run, Wrap, lower_unit, scramble, upper_unit};
use crate::ground::hash::Hash;
use crate::ground::math::{max, min};
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt, index, offset};
use glam::DVec2;
use shibo_macros::choice;
use shibo_value::Tiling;

/// The metric for distances to points.
#[choice]
pub enum Metric {
    /// The straight distance: round cells.
    // √(x² + y²).
    #[default]
    Euclidean,
    /// The distance along x plus that along y: diamonds.
    // |x| + |y|.
    Manhattan,
    /// The larger of the distances along x and along y: squares.
    // max(|x|, |y|).
    Chebyshev,
}

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorleySpec {
    /// The shape of cells.
    pub shape: CellShape,
    /// 0: a regular grid … 1: as irregular as possible.
    pub jitter: f32,
    /// The metric of F1 and F2; border distances are Euclidean.
    pub metric: Metric,
}

/// The planes to fill, `None` for unwanted ones; each covers the window without gaps.
#[derive(Debug, Default)]
pub struct WorleyOut<'a> {
    /// Distance to the nearest point, mm.
    pub f1: Option<&'a mut [f32]>,
    /// Distance to the second nearest, mm.
    pub f2: Option<&'a mut [f32]>,
    /// Distance to the border of the cell, mm (four times the cost).
    pub border: Option<&'a mut [f32]>,
    /// A random number per cell, uniform in 0..1.
    pub value: Option<&'a mut [f32]>,
    /// A random word per cell that identifies it.
    pub id: Option<&'a mut [u32]>,
}

/// The words of cells as integers below 2^24, which `f32` holds exactly. Among a thousand cells, the chance that two
/// share a number is 3 %.
pub fn ids(words: &[u32], out: &mut [f32]) {
    for (out, word) in out.iter_mut().zip(words) {
        *out = (scramble(!*word) >> 8) as f32;
    }
}

/// Cells bound to a canvas and a seed.
#[derive(Clone, Debug)]
pub struct Worley {
    grid: Option<CellGrid>,
    metric: Metric,
    jitter: f32,
    /// Cells to the space in which points are compared, mm.
    compare: [[f32; 2]; 2],
    /// Cells to the gradient of half the squared distance there, per true mm.
    slope: [[f32; 2]; 2],
}

impl Worley {
    /// Prepares the grid. With more than 10^9 cells on the canvas all outputs are 0.
    pub fn new(spec: &WorleySpec, canvas: (DVec2, Tiling), hash: Hash) -> Self {
        let grid = CellGrid::new(canvas, &spec.shape, hash);
        let stretch = spec.shape.wanted().map(|row| row.map(|x| x * spec.shape.size));
        let m = grid.as_ref().map_or([[1.0, 0.0], [0.0, 1.0]], CellGrid::to_cell);
        let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
        let to_mm = [[m[1][1] / det, -m[0][1] / det], [-m[1][0] / det, m[0][0] / det]];
        let compare = product(&stretch, &to_mm);
        let transposed = [[stretch[0][0], stretch[1][0]], [stretch[0][1], stretch[1][1]]];
        #[expect(clippy::cast_possible_truncation, reason = "lengths need no more than f32")]
        let single = |m: [[f64; 2]; 2]| m.map(|row| row.map(|x| x as f32));
        let slope = single(product(&transposed, &compare));
        Self { grid, metric: spec.metric, jitter: spec.jitter * 0.875, compare: single(compare), slope }
    }

    /// Fills the wanted planes over the frame's window.
    ///
    /// # Panics
    /// If a plane is smaller than the window.
    pub fn fill(&self, frame: &Frame, out: &mut WorleyOut<'_>) {
        let Some(grid) = &self.grid else { return };
        simd::dispatch(
            #[inline(always)]
            || self.fill_rows(grid, frame, out),
        );
    }

    #[inline(always)]
    fn fill_rows(&self, grid: &CellGrid, frame: &Frame, out: &mut WorleyOut<'_>) {
        let (rect, lanes) = (frame.window, index(LANES));
        let mut near = Near::default();
        let mut value = [0.0; LANES];
        for (j, y) in (0..rect.rows()).zip(rect.y..) {
            let mut x = rect.x.div_euclid(lanes) * lanes;
            while x < rect.right() {
                let from = offset((rect.x - x).max(0));
                let to = LANES.min(offset(rect.right() - x));
                let start = j * rect.columns() + offset((x - rect.x).max(0));
                let part = start..start + to - from;
                self.nearest_points(grid, frame, [x, y], &mut near);
                if let Some(border) = &mut out.border {
                    self.borders(&grid.run(frame, x, y, [-2, 2]), &near, &mut value);
                    border[part.clone()].copy_from_slice(&value[from..to]);
                }
                if let Some(f1) = &mut out.f1 {
                    f1[part.clone()].copy_from_slice(&near.first[from..to]);
                }
                if let Some(f2) = &mut out.f2 {
                    f2[part.clone()].copy_from_slice(&near.second[from..to]);
                }
                if let Some(id) = &mut out.id {
                    id[part.clone()].copy_from_slice(&near.word[from..to]);
                }
                if let Some(random) = &mut out.value {
                    for (value, word) in random[part].iter_mut().zip(&near.word[from..to]) {
                        *value = upper_unit(scramble(*word));
                    }
                }
                x += lanes;
            }
        }
    }

    #[inline(always)]
    fn nearest_points(&self, grid: &CellGrid, frame: &Frame, [x, y]: [i32; 2], near: &mut Near) {
        let run = grid.run(frame, x, y, [-1, 1]);
        match (self.metric, run.wrap) {
            (Metric::Euclidean, Wrap::None) => self.nearest::<0, 0>(&run, near),
            (Metric::Euclidean, Wrap::Few) => self.nearest::<1, 0>(&run, near),
            (Metric::Euclidean, Wrap::Many) => self.nearest::<2, 0>(&run, near),
            (Metric::Manhattan, Wrap::None) => self.nearest::<0, 1>(&run, near),
            (Metric::Manhattan, _) => self.nearest::<2, 1>(&run, near),
            (Metric::Chebyshev, Wrap::None) => self.nearest::<0, 2>(&run, near),
            (Metric::Chebyshev, _) => self.nearest::<2, 2>(&run, near),
        }
    }

    /// Offset of a cell's point from the cell's corner, in cells.
    #[inline(always)]
    fn point(&self, word: u32) -> (f32, f32) {
        (0.5 + (upper_unit(word) - 0.5) * self.jitter, 0.5 + (lower_unit(word) - 0.5) * self.jitter)
    }

    #[inline(always)]
    fn nearest<const WRAP: u8, const METRIC: u8>(&self, run: &Run, near: &mut Near) {
        for (k, &ramp) in RAMP.iter().enumerate() {
            let place = run.place(ramp);
            let visit = |best, i, j| self.visit::<WRAP, METRIC>(run, place, best, i, j);
            let mut best = Best { first: FAR, second: FAR, word: 0, offset: [0.0; 2] };
            // Unrolled by hand: with a loop the compiler does not vectorise over eight pixels.
            best = visit(best, -1, -1);
            best = visit(best, 0, -1);
            best = visit(best, 1, -1);
            best = visit(best, -1, 0);
            best = visit(best, 0, 0);
            best = visit(best, 1, 0);
            best = visit(best, -1, 1);
            best = visit(best, 0, 1);
            best = visit(best, 1, 1);
            near.first[k] = if METRIC == 0 { best.first.sqrt() } else { best.first };
            near.second[k] = if METRIC == 0 { best.second.sqrt() } else { best.second };
            near.word[k] = best.word;
            near.offset[0][k] = best.offset[0];
            near.offset[1][k] = best.offset[1];
        }
    }

    /// Compares with the point of the cell (i, j) relative to the pixel's own.
    #[inline(always)]
    fn visit<const WRAP: u8, const METRIC: u8>(
        &self,
        run: &Run,
        (x, y, u, v): (f32, f32, i32, i32),
        best: Best,
        i: i32,
        j: i32,
    ) -> Best {
        let [[a, b], [c, d]] = self.compare;
        let word = run.word::<WRAP>(u + i, v + j);
        let (px, py) = self.point(word);
        let (px, py) = (px + (i as f32 - x), py + (j as f32 - y));
        let (mx, my) = (a * px + b * py, c * px + d * py);
        let distance = match METRIC {
            0 => mx * mx + my * my,
            1 => mx.abs() + my.abs(),
            _ => max(mx.abs(), my.abs()),
        };
        let closer = distance < best.first;
        let pick = |yes: f32, no: f32| if closer { yes } else { no };
        Best {
            first: pick(distance, best.first),
            second: min(best.second, pick(best.first, distance)),
            word: if closer { word } else { best.word },
            offset: [pick(px, best.offset[0]), pick(py, best.offset[1])],
        }
    }

    #[inline(always)]
    fn borders(&self, run: &Run, near: &Near, out: &mut [f32; LANES]) {
        match run.wrap {
            Wrap::None => self.border::<0>(run, near, out),
            Wrap::Few => self.border::<1>(run, near, out),
            Wrap::Many => self.border::<2>(run, near, out),
        }
    }

    /// Least distance to a bisector, (|b|² - |a|²) / (2 |slope·(b - a)|), over all points b around.
    #[inline(always)]
    fn border<const WRAP: u8>(&self, run: &Run, near: &Near, out: &mut [f32; LANES]) {
        let points = near.offset[0].iter().zip(&near.offset[1]);
        for ((out, &k), (&ax, &ay)) in out.iter_mut().zip(&RAMP).zip(points) {
            let (place, a) = (run.place(k), (ax, ay));
            let mut best = self.bisect_three::<WRAP>(run, place, a, -2);
            best = min(best, self.bisect_five::<WRAP>(run, place, a, -1));
            best = min(best, self.bisect_five::<WRAP>(run, place, a, 0));
            best = min(best, self.bisect_five::<WRAP>(run, place, a, 1));
            best = min(best, self.bisect_three::<WRAP>(run, place, a, 2));
            *out = 0.5 * best.sqrt();
        }
    }

    /// The least of three cells of row j; unrolled for the same reason as in `nearest`.
    #[inline(always)]
    fn bisect_three<const WRAP: u8>(&self, run: &Run, place: (f32, f32, i32, i32), a: (f32, f32), j: i32) -> f32 {
        let left = self.bisect::<WRAP>(run, place, a, (-1, j));
        let middle = self.bisect::<WRAP>(run, place, a, (0, j));
        min(min(left, middle), self.bisect::<WRAP>(run, place, a, (1, j)))
    }

    /// The least of five cells of row j.
    #[inline(always)]
    fn bisect_five<const WRAP: u8>(&self, run: &Run, place: (f32, f32, i32, i32), a: (f32, f32), j: i32) -> f32 {
        let left = self.bisect::<WRAP>(run, place, a, (-2, j));
        let right = self.bisect::<WRAP>(run, place, a, (2, j));
        min(min(left, right), self.bisect_three::<WRAP>(run, place, a, j))
    }

    /// Four times the squared distance to the bisector with the point of cell (i, j) relative to the pixel's own.
    #[inline(always)]
    fn bisect<const WRAP: u8>(
        &self,
        run: &Run,
        (x, y, u, v): (f32, f32, i32, i32),
        (ax, ay): (f32, f32),
        (i, j): (i32, i32),
    ) -> f32 {
        let ([[a, b], [c, d]], [[p, q], [r, s]]) = (self.compare, self.slope);
        let (px, py) = self.point(run.word::<WRAP>(u + i, v + j));
        let (px, py) = (px + (i as f32 - x), py + (j as f32 - y));
        let (dx, dy) = (px - ax, py - ay);
        // |b|² - |a|² = (b - a)·(b + a), which cancels less.
        let (mx, my) = (a * dx + b * dy, c * dx + d * dy);
        let (nx, ny) = (a * (px + ax) + b * (py + ay), c * (px + ax) + d * (py + ay));
        let (gx, gy) = (p * dx + q * dy, r * dx + s * dy);
        let gap = max(mx * nx + my * ny, 0.0);
        let square = gap * gap / max(gx * gx + gy * gy, 1e-30);
        if dx * dx + dy * dy < 1e-6 { FAR } else { square }
    }
}

/// A distance beyond any point, with a finite square.
const FAR: f32 = 1e30;

/// The nearest points found so far for a pixel.
#[derive(Clone, Copy)]
struct Best {
    first: f32,
    second: f32,
    word: u32,
    offset: [f32; 2],
}

/// The nearest points of a run.
struct Near {
    first: [f32; LANES],
    second: [f32; LANES],
    word: [u32; LANES],
    offset: [[f32; LANES]; 2],
}

impl Default for Near {
    fn default() -> Self {
        Self { first: [0.0; LANES], second: [0.0; LANES], word: [0; LANES], offset: [[0.0; LANES]; 2] }
    }
}

fn product(a: &[[f64; 2]; 2], b: &[[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let at = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shibo_value::Window;

    const CANVAS: (DVec2, Tiling) = (DVec2::new(60.0, 40.0), Tiling::BOTH);

    fn render(spec: &WorleySpec, seed: u64, rect: Window, step: f64) -> [Vec<f32>; 3] {
        let [mut f1, mut f2, mut border] = [(); 3].map(|()| vec![0.0; rect.len()]);
        let worley = Worley::new(spec, CANVAS, Hash::new(seed));
        let mut out =
            WorleyOut { f1: Some(&mut f1), f2: Some(&mut f2), border: Some(&mut border), ..WorleyOut::default() };
        worley.fill(&Frame::new(rect, [step, step]), &mut out);
        [f1, f2, border]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn repeats_tiles_and_is_ordered(seed: u64, size in 1.0f64..60.0, aspect in 0.5f64..3.0, angle in -3.2f64..3.2) {
            let spec = WorleySpec { shape: CellShape { size, aspect, angle }, jitter: 1.0, metric: Metric::Euclidean };
            let here = render(&spec, seed, Window::of(0, 0, 240, 20), 0.25);
            let there = render(&spec, seed, Window::of(240, 160, 240, 20), 0.25);
            let part = render(&spec, seed, Window::of(17, 3, 100, 2), 0.25);
            for plane in 0..3 {
                prop_assert_eq!(&part[plane][..100], &here[plane][3 * 240 + 17..][..100]);
                for (a, b) in here[plane].iter().zip(&there[plane]) {
                    prop_assert!(f64::from((a - b).abs()) < 1e-3 * size, "{plane} {a} {b}");
                }
            }
            for ((f1, f2), border) in here[0].iter().zip(&here[1]).zip(&here[2]) {
                prop_assert!(f1 <= f2 && *border >= 0.0 && f64::from(*border) < 10.0 * size);
            }
        }
    }

    #[test]
    fn matches_a_regular_grid() {
        let spec = WorleySpec { shape: CellShape::round(10.0), jitter: 0.0, metric: Metric::Euclidean };
        let [f1, f2, border] = render(&spec, 4, Window::of(0, 0, 600, 400), 0.1);
        for k in 0..f1.len() {
            assert!(border[k] <= 5.001 && f1[k] <= 7.08 && f2[k] <= 11.19);
        }
        let most = border.iter().copied().fold(0.0, f32::max);
        assert!((most - 5.0).abs() < 0.1);
    }
}
