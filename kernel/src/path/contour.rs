//! Level lines of samples: marching squares with linear interpolation, as separate pieces or joined to curves.
use super::pen::Pen;
use crate::ground::number::index_u32;
use glam::{DVec2, I64Vec2, UVec2};
use shibo_value::{Path, Tiling};

/// No edge.
const NONE: u32 = u32::MAX;

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
        let edges = Edges::new(self, level, stop)?;
        let mut pen = Pen::default();
        let mut next = edges.next.clone();
        let open = (0..index_u32(next.len())).filter(|edge| !edges.entered[*edge as usize]);
        for first in open.chain(0..index_u32(next.len())) {
            if next[first as usize] == NONE {
                continue;
            }
            let (mut edge, mut canvas) = (first, I64Vec2::ZERO);
            pen.move_to(edges.point(self, edge, canvas, level));
            while let Some(to) = next.get_mut(edge as usize).map(|to| std::mem::replace(to, NONE)) {
                if to == NONE {
                    break;
                }
                canvas += edges.step(edge, to);
                edge = to;
                pen.line_to(edges.point(self, edge, canvas, level));
            }
        }
        Some(pen.finish(self.size.as_dvec2() * self.pixel, self.tiling))
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
    tiling: Tiling,
    /// The next edge that the line from an edge crosses.
    next: Vec<u32>,
    /// True for edges to which a line comes.
    entered: Vec<bool>,
}

impl Edges {
    fn new(mask: &Mask, level: f64, stop: &dyn Fn() -> bool) -> Option<Self> {
        let margin = I64Vec2::new(i64::from(!mask.tiling.x), i64::from(!mask.tiling.y));
        let counts = mask.size.as_i64vec2() + 2 * margin;
        let all = usize::try_from(2 * counts.element_product()).ok()?;
        let mut edges =
            Self { low: -margin, counts, tiling: mask.tiling, next: vec![NONE; all], entered: vec![false; all] };
        for y in 0..counts.y - margin.y {
            if stop() {
                return None;
            }
            for x in 0..counts.x - margin.x {
                let at = I64Vec2::new(x, y);
                let cell = Cell::new(mask, edges.low + at, level);
                for [a, b] in cell.pieces().iter() {
                    // The line goes out of the higher values clockwise, so that they lie on its right.
                    let [from, to] = if cell.values[a] > 0.0 { [a, b] } else { [b, a] }.map(|k| edges.index(at, k));
                    edges.next[from] = index_u32(to);
                    edges.entered[to] = true;
                }
            }
        }
        Some(edges)
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
mod tests {
    use super::*;

    fn disc(tiling: Tiling, middle: DVec2) -> Mask {
        let (size, pixel) = (UVec2::new(64, 48), DVec2::splat(0.5));
        let value = |n: u32| {
            let p = (DVec2::new(f64::from(n % 64), f64::from(n / 64)) + 0.5) * pixel;
            let mut to = (p - middle).abs();
            if tiling == Tiling::BOTH {
                to = to.min(DVec2::new(32.0, 24.0) - to);
            }
            crate::ground::number::narrow((0.5 + (7.0 - to.length()) * 0.5).clamp(0.0, 1.0))
        };
        Mask::new((0..64 * 48).map(value).collect(), size, pixel, tiling)
    }

    #[test]
    fn borders_lie_on_the_shape_and_close() {
        for (tiling, middle) in [(Tiling::NONE, DVec2::new(15.0, 12.0)), (Tiling::BOTH, DVec2::new(1.0, 23.0))] {
            let border = disc(tiling, middle).border();
            let mut length = 0.0;
            for [a, b] in &border {
                let to = (*a - middle).abs();
                let to = if tiling == Tiling::BOTH { to.min((DVec2::new(32.0, 24.0) - to).abs()) } else { to };
                assert!((to.length() - 7.0).abs() < 0.02, "{a}");
                length += a.distance(*b);
            }
            assert!((length - 44.0).abs() < 0.1, "{length}");
        }
    }

    #[test]
    fn interpolates_between_samples_and_repeats() {
        let mask = disc(Tiling::BOTH, DVec2::new(1.0, 23.0));
        for n in 0..100 {
            let p = DVec2::new(f64::from(n) * 0.7 - 20.0, f64::from(n) * 0.31);
            assert!((mask.at(p) - mask.at(p + DVec2::new(32.0, -24.0))).abs() < 1e-9);
        }
        assert!(mask.at(DVec2::new(1.0, 23.0)) > 0.5 && mask.at(DVec2::new(16.0, 10.0)) < 0.5);
        let one = Mask::new(vec![f32::NAN, 1.0, f32::INFINITY, 0.0], UVec2::splat(2), DVec2::ONE, Tiling::NONE);
        assert!(one.border().iter().flatten().all(|p| p.is_finite()));
    }

    fn area(path: &Path) -> f64 {
        path.pieces().map(|[a, b]| 0.5 * a.perp_dot(b)).sum()
    }

    #[test]
    fn lines_of_a_disc_close_with_the_disc_on_their_right() {
        for n in [64, 256, 1024] {
            let (size, pixel) = (UVec2::new(n, n), DVec2::splat(32.0 / f64::from(n)));
            let centre = |k: u32| (DVec2::new(f64::from(k % n), f64::from(k / n)) + 0.5) * pixel;
            let value = |k: u32| crate::ground::number::narrow(7.0 - centre(k).distance(DVec2::new(15.3, 16.1)));
            let mask = Mask::new((0..n * n).map(value).collect(), size, pixel, Tiling::BOTH);
            let path = mask.lines(0.0, &|| false).unwrap();
            let [curve] = &path.curves[..] else { panic!("{} curves", path.curves.len()) };
            assert!(curve.closed && curve.points.first() == curve.points.last());
            let (length, area) = (curve.length() / 14.0, area(&path) / 49.0);
            assert!((length / std::f64::consts::PI - 1.0).abs() < 0.01, "{n}: {length}");
            assert!((area / std::f64::consts::PI - 1.0).abs() < 0.01, "{n}: {area}");
        }
    }

    #[test]
    fn lines_go_around_the_canvas_or_end_at_its_border() {
        // A band whose two borders are waves across the whole canvas.
        let value = |k: u32| {
            let (x, y) = (f64::from(k % 32) + 0.5, f64::from(k / 32) + 0.5);
            crate::ground::number::narrow(5.0 - (y - 16.0 - 3.0 * (x * std::f64::consts::TAU / 32.0).sin()).abs())
        };
        let values: Vec<f32> = (0..1024).map(value).collect();
        for tiling in [Tiling::BOTH, Tiling { x: false, y: true }, Tiling::NONE] {
            let path = Mask::new(values.clone(), UVec2::splat(32), DVec2::ONE, tiling).lines(0.0, &|| false).unwrap();
            assert_eq!(path.curves.len(), 2, "{tiling:?}");
            for curve in &path.curves {
                let way = *curve.points.last().unwrap() - curve.points[0];
                let far = if tiling.x { 32.0 } else { 33.0 };
                assert!(curve.closed == tiling.x && (way.x.abs() - far).abs() < 1e-9 && way.y.abs() < 3.0, "{way}");
                // The band lies on the right.
                let to = (curve.points[1] - curve.points[0]).perp() + curve.points[0];
                assert!((to.y - 16.0).abs() < (curve.points[0].y - 16.0).abs(), "{tiling:?}");
            }
        }
    }

    #[test]
    fn saddles_and_noise_give_whole_lines() {
        let hash = crate::ground::hash::Hash::new(3);
        let values: Vec<f32> = (0..40 * 30).map(|n| hash.unit_f32(n)).collect();
        for tiling in [Tiling::BOTH, Tiling { x: true, y: false }, Tiling::NONE] {
            let mask = Mask::new(values.clone(), UVec2::new(40, 30), DVec2::new(0.5, 0.5), tiling);
            let path = mask.lines(0.5, &|| false).unwrap();
            let inside = |p: DVec2| p.x > 0.25 && p.y > 0.25 && p.x < 19.75 && p.y < 14.75;
            let ends = path.curves.iter().filter(|curve| !curve.closed);
            for curve in ends {
                assert!(![curve.points[0], *curve.points.last().unwrap()].iter().any(|p| inside(*p)), "{tiling:?}");
            }
            if tiling == Tiling::BOTH {
                assert!(path.curves.iter().all(|curve| curve.closed));
                assert_eq!(path.len(), mask.border().len());
            }
        }
    }
}
