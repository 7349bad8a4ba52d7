//! Level lines of samples: marching squares with linear interpolation, as separate pieces or joined to curves.
use super::pen::Pen;
use crate::ground::number::index_u32;
use glam::{DVec2, I64Vec2, UVec2};
use shibo_value::{Path, Tiling};
use std::ops::Range;

/// No edge.
const NONE: u32 = u32::MAX;

/// The most crossings of cells and levels that are sorted together, 64 MiB of them.
const AT_ONCE: i64 = 1 << 24;

/// The corners of a cell between four samples, clockwise in the picture. Edge k leads from corner k to the next one.
const CORNERS: [I64Vec2; 4] = [I64Vec2::ZERO, I64Vec2::X, I64Vec2::ONE, I64Vec2::Y];

/// Samples of a mask at the centres of pixels. The border lies where the mask is ½.
#[derive(Clone, Debug)]
pub struct Mask {
    values: Vec<f32>,
    size: UVec2,
    pixel: DVec2,
    tiling: Tiling,
}

impl Mask {
    /// From samples, row by row; a pixel has the size `pixel` in mm. In directions without `tiling` the mask goes on
    /// with its last row or column.
    pub const fn new(values: Vec<f32>, size: UVec2, pixel: DVec2, tiling: Tiling) -> Self {
        Self { values, size, pixel, tiling }
    }

    fn sample(&self, x: i64, y: i64) -> f64 {
        let index = |i: i64, n: u32, repeats: bool| {
            let n = i64::from(n);
            if repeats { i.rem_euclid(n) } else { i.clamp(0, n - 1) }
        };
        let (x, y) = (index(x, self.size.x, self.tiling.x), index(y, self.size.y, self.tiling.y));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the samples")]
        let i = (y * i64::from(self.size.x) + x) as usize;
        self.values.get(i).map_or(0.0, |v| f64::from(*v))
    }

    /// The mask at a point in mm, by linear interpolation.
    pub fn at(&self, p: DVec2) -> f64 {
        let at = p / self.pixel - 0.5;
        let base = at.floor();
        let t = at - base;
        #[expect(clippy::cast_possible_truncation, reason = "saturates, and is clamped or wrapped after that")]
        let (x, y) = (base.x as i64, base.y as i64);
        let row = |y: i64| {
            let (a, b) = (self.sample(x, y), self.sample(x.saturating_add(1), y));
            a + t.x * (b - a)
        };
        let (a, b) = (row(y), row(y.saturating_add(1)));
        a + t.y * (b - a)
    }

    /// The pieces of the border.
    pub fn border(&self) -> Vec<[DVec2; 2]> {
        let mut out = Vec::new();
        let cells = |n: u32, repeats: bool| i64::from(n) - i64::from(!repeats);
        for y in 0..cells(self.size.y, self.tiling.y) {
            for x in 0..cells(self.size.x, self.tiling.x) {
                let cell = Cell::new(self, I64Vec2::new(x, y), 0.5);
                out.extend(cell.pieces().iter().map(|piece| piece.map(|edge| cell.crossing(self, edge))));
            }
        }
        out
    }

    /// The lines on which the samples have the value `level`, in mm. Higher values lie on the right of a line as one
    /// goes along it. Lines close, also around the canvas where the samples repeat; elsewhere they end half a pixel
    /// beyond the outermost samples. Open lines come first; apart from that, the order is that of the uppermost, then
    /// leftmost edge of a line. `None` if stopped. O(samples).
    pub fn lines(&self, level: f64, stop: &dyn Fn() -> bool) -> Option<Path> {
        let mut found = None;
        self.levels(&[level], stop, &mut |_, path| found = Some(path))?;
        found
    }

    /// Hands out the [`lines`](Self::lines) of each level, with its index. Levels rise. `None` if stopped.
    /// O(samples + samples of all lines): cells are sorted by the levels that cross them.
    pub fn levels(&self, levels: &[f64], stop: &dyn Fn() -> bool, each: &mut dyn FnMut(usize, Path)) -> Option<()> {
        let mut edges = Edges::new(self)?;
        if let [level] = levels {
            for y in 0..edges.cells.y {
                if stop() {
                    return None;
                }
                (0..edges.cells.x).for_each(|x| edges.cross(self, I64Vec2::new(x, y), *level));
            }
            each(0, edges.take(self, *level));
            return Some(());
        }
        // The cells that each level crosses, and their sum over the levels before each level.
        let mut before = vec![0_i64; levels.len() + 1];
        edges.crossed(self, levels, stop, &mut |_, crossed| {
            before[crossed.start] += 1;
            before[crossed.end] -= 1;
        })?;
        let (mut count, mut sum) = (0, 0);
        for cells in &mut before {
            count += *cells;
            (*cells, sum) = (sum, sum + count);
        }
        let mut first = 0;
        while first < levels.len() {
            let within = before[first + 1..].partition_point(|sum| *sum - before[first] <= AT_ONCE);
            let last = (first + within).clamp(first + 1, levels.len());
            let place = |level: usize| usize::try_from(before[level] - before[first]).unwrap_or(0);
            let mut cells = vec![0_u32; place(last)];
            let mut next: Vec<usize> = (first..last).map(place).collect();
            edges.crossed(self, levels, stop, &mut |cell, crossed| {
                for level in crossed.start.max(first)..crossed.end.min(last) {
                    cells[next[level - first]] = cell;
                    next[level - first] += 1;
                }
            })?;
            for (level, height) in (first..).zip(&levels[first..last]) {
                if stop() {
                    return None;
                }
                for cell in &cells[place(level)..place(level + 1)] {
                    edges.cross(self, edges.sample(2 * cell), *height);
                }
                each(level, edges.take(self, *height));
            }
            first = last;
        }
        Some(())
    }
}

/// The values at the corners of a cell, relative to a level.
struct Cell {
    at: I64Vec2,
    values: [f64; 4],
}

/// Pieces of a line within a cell, as pairs of edges.
struct Pieces {
    pairs: [[usize; 2]; 2],
    count: usize,
}

impl Pieces {
    fn iter(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.pairs.iter().copied().take(self.count)
    }
}

impl Cell {
    fn new(mask: &Mask, at: I64Vec2, level: f64) -> Self {
        Self { at, values: CORNERS.map(|corner| mask.sample(at.x + corner.x, at.y + corner.y) - level) }
    }

    fn is_crossed(&self, edge: usize) -> bool {
        (self.values[edge] > 0.0) != (self.values[(edge + 1) % 4] > 0.0)
    }

    /// The pieces between the crossed edges.
    fn pieces(&self) -> Pieces {
        let mut crossed = [0; 4];
        let mut count = 0;
        for edge in (0..4).filter(|edge| self.is_crossed(*edge)) {
            crossed[count] = edge;
            count += 1;
        }
        if count < 4 {
            return Pieces { pairs: [[crossed[0], crossed[1]], [0; 2]], count: count / 2 };
        }
        // A saddle: the mean decides whether the two corners inside are connected.
        let connected = self.values.iter().sum::<f64>() > 0.0;
        let first = (self.values[0] > 0.0) == connected;
        Pieces { pairs: if first { [[0, 1], [2, 3]] } else { [[3, 0], [1, 2]] }, count: 2 }
    }

    /// The place where the line crosses an edge, in mm.
    fn crossing(&self, mask: &Mask, edge: usize) -> DVec2 {
        let corner = |k: usize| ((self.at + CORNERS[k % 4]).as_dvec2() + 0.5) * mask.pixel;
        corner(edge).lerp(corner(edge + 1), share(self.values[edge], self.values[(edge + 1) % 4]))
    }
}

/// The share of the way from a value to another at which it is 0.
fn share(a: f64, b: f64) -> f64 {
    if (a - b).is_finite() { a / (a - b) } else { 0.5 }
}

/// The edges between neighbouring samples. Edge 2 n leads from sample n to the right, edge 2 n + 1 down.
struct Edges {
    /// The first sample: before the canvas in directions without repeats.
    low: I64Vec2,
    counts: I64Vec2,
    /// Number of cells in each direction.
    cells: I64Vec2,
    tiling: Tiling,
    /// The next edge that the line from an edge crosses.
    next: Vec<u32>,
    /// True for edges to which a line comes.
    entered: Vec<bool>,
    /// The edge before and the edge after each piece.
    pairs: Vec<[u32; 2]>,
}

impl Edges {
    /// The edges of a mask, without lines.
    fn new(mask: &Mask) -> Option<Self> {
        let margin = I64Vec2::new(i64::from(!mask.tiling.x), i64::from(!mask.tiling.y));
        let counts = mask.size.as_i64vec2() + 2 * margin;
        let all = usize::try_from(2 * counts.element_product()).ok()?;
        let (next, entered) = (vec![NONE; all], vec![false; all]);
        Some(Self {
            low: -margin,
            counts,
            cells: counts - margin,
            tiling: mask.tiling,
            next,
            entered,
            pairs: Vec::new(),
        })
    }

    /// Calls `each` with each cell, named by its first sample, and the indices of the levels that cross it; `None` if
    /// stopped.
    fn crossed(
        &self,
        mask: &Mask,
        levels: &[f64],
        stop: &dyn Fn() -> bool,
        each: &mut dyn FnMut(u32, Range<usize>),
    ) -> Option<()> {
        for y in 0..self.cells.y {
            if stop() {
                return None;
            }
            for x in 0..self.cells.x {
                let [a, b, c, d] = Cell::new(mask, self.low + I64Vec2::new(x, y), 0.0).values;
                // A sample that is no number counts as low, as in a cell.
                let least = if (a + b + c + d).is_nan() { f64::NEG_INFINITY } else { a.min(b).min(c.min(d)) };
                let greatest = a.max(b).max(c.max(d));
                let first = levels.partition_point(|level| least > *level);
                let end = first + levels[first..].partition_point(|level| greatest > *level);
                if first < end {
                    each(index_u32(usize::try_from(y * self.counts.x + x).unwrap_or(0)), first..end);
                }
            }
        }
        Some(())
    }

    /// Adds the pieces of a line within a cell.
    fn cross(&mut self, mask: &Mask, at: I64Vec2, level: f64) {
        let cell = Cell::new(mask, self.low + at, level);
        for [a, b] in cell.pieces().iter() {
            // The line goes out of the higher values clockwise, so that they lie on its right.
            let [from, to] = if cell.values[a] > 0.0 { [a, b] } else { [b, a] }.map(|k| self.index(at, k));
            self.next[from] = index_u32(to);
            self.entered[to] = true;
            self.pairs.push([index_u32(from), index_u32(to)]);
        }
    }

    /// The lines of all pieces, which are removed.
    fn take(&mut self, mask: &Mask, level: f64) -> Path {
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.sort_unstable();
        let mut pen = Pen::default();
        let starts = || pairs.iter().map(|[from, _]| *from);
        let open: Vec<u32> = starts().filter(|edge| !self.entered[*edge as usize]).collect();
        for first in open.into_iter().chain(starts()) {
            if self.next[first as usize] == NONE {
                continue;
            }
            let (mut edge, mut canvas) = (first, I64Vec2::ZERO);
            pen.move_to(self.point(mask, edge, canvas, level));
            while let Some(to) = self.next.get_mut(edge as usize).map(|to| std::mem::replace(to, NONE)) {
                if to == NONE {
                    break;
                }
                canvas += self.step(edge, to);
                edge = to;
                pen.line_to(self.point(mask, edge, canvas, level));
            }
        }
        pairs.iter().for_each(|[_, to]| self.entered[*to as usize] = false);
        pairs.clear();
        self.pairs = pairs;
        pen.finish(mask.size.as_dvec2() * mask.pixel, mask.tiling)
    }

    /// Index of an edge of a cell.
    fn index(&self, cell: I64Vec2, edge: usize) -> usize {
        let (step, down) = [(I64Vec2::ZERO, 0), (I64Vec2::X, 1), (I64Vec2::Y, 0), (I64Vec2::ZERO, 1)][edge % 4];
        let at = (cell + step) % self.counts;
        usize::try_from(2 * (at.y * self.counts.x + at.x) + down).unwrap_or(0)
    }

    fn sample(&self, edge: u32) -> I64Vec2 {
        let n = i64::from(edge / 2);
        I64Vec2::new(n % self.counts.x, n / self.counts.x)
    }

    /// Canvases that lie between two edges of the same cell.
    fn step(&self, from: u32, to: u32) -> I64Vec2 {
        let by = self.sample(to) - self.sample(from);
        let axis = |by: i64, repeats: bool| if repeats && by.abs() > 1 { -by.signum() } else { 0 };
        I64Vec2::new(axis(by.x, self.tiling.x), axis(by.y, self.tiling.y))
    }

    /// The place where the line crosses an edge, in mm. It has the same bits from both sides of the edge.
    fn point(&self, mask: &Mask, edge: u32, canvas: I64Vec2, level: f64) -> DVec2 {
        let at = self.low + self.sample(edge);
        let way = if edge.is_multiple_of(2) { I64Vec2::X } else { I64Vec2::Y };
        let value = |p: I64Vec2| mask.sample(p.x, p.y) - level;
        let place = at.as_dvec2() + 0.5 + way.as_dvec2() * share(value(at), value(at + way));
        place * mask.pixel + canvas.as_dvec2() * mask.size.as_dvec2() * mask.pixel
    }
}

#[cfg(test)]
mod tests;
