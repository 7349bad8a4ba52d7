//! Links between neighbouring points.
//!
//! Source: JP4905282B2 §3, claim 8. A link is a pair of indices; it stays when points move and springs break. On a
//! periodic canvas a link also stores the copy of the canvas that holds its second end: the vector of link `[a, b]`
//! with wrap `w` is `p[b] + w · size - p[a]`. Points need not lie inside the canvas; [`wrap`] brings them back.

use crate::ground::number::index_u32;
use crate::ground::stop::{NEVER, Until};
use glam::Vec2;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Pairs of neighbours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Links {
    /// Indices of the two ends.
    pub pairs: Vec<[u32; 2]>,
    /// Per link the offset of the second end in canvases; empty where no link crosses the canvas' edge.
    pub wraps: Vec<[i8; 2]>,
}

impl Links {
    /// The offset in mm of the second end of link `l`.
    #[inline]
    pub fn offset(&self, l: usize, size: Vec2) -> Vec2 {
        self.wraps.get(l).map_or(Vec2::ZERO, |w| Vec2::new(f32::from(w[0]), f32::from(w[1])) * size)
    }

    /// Both ends of link `l`, the second one in its copy of the canvas.
    #[inline]
    pub fn ends(&self, l: usize, points: &[Vec2], size: Vec2) -> [Vec2; 2] {
        let [a, b] = self.pairs[l].map(|p| points[p as usize]);
        [a, b + self.offset(l, size)]
    }

    /// Length of each link in mm.
    pub fn lengths(&self, points: &[Vec2], size: Vec2) -> Vec<f32> {
        let length = |l| {
            let [a, b] = self.ends(l, points, size);
            (b - a).length()
        };
        (0..self.pairs.len()).into_par_iter().map(length).collect()
    }
}

/// The four directions of grid links, in their order per point: step in x, and whether the link leads to the row below.
pub(crate) const DIRECTIONS: [(i8, bool); 4] = [(1, false), (0, true), (1, true), (-1, true)];

/// The shape of a lattice that is a grid, points by rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridShape {
    /// Points in a row.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// Diagonal links too: 8 neighbours instead of 4.
    pub eight: bool,
    /// The last column and row link to the first.
    pub periodic: bool,
}

impl GridShape {
    /// Number of directions: 2 or 4.
    pub(crate) fn directions(self) -> usize {
        if self.eight { 4 } else { 2 }
    }

    /// The links in their order: start point, and index into [`DIRECTIONS`].
    pub(super) fn slots(self) -> impl Iterator<Item = (usize, usize)> {
        let inside = move |point: usize, (dx, down): (i8, bool)| {
            let (x, y) = (point % self.nx, point / self.nx);
            let x_ok = match dx {
                1 => x + 1 < self.nx,
                -1 => x > 0,
                _ => true,
            };
            self.periodic || (x_ok && (!down || y + 1 < self.ny))
        };
        let slots = (0..self.nx * self.ny).flat_map(move |p| (0..self.directions()).map(move |dir| (p, dir)));
        slots.filter(move |&(p, dir)| inside(p, DIRECTIONS[dir]))
    }

    /// The neighbour of the point in column `x` of row `y` in a direction of [`DIRECTIONS`], and the copy of the canvas
    /// that holds it.
    fn neighbor(self, [x, y]: [usize; 2], dir: usize) -> (usize, [i8; 2]) {
        let (dx, down) = DIRECTIONS[dir];
        let (to_x, wrap_x) = match dx {
            1 if x + 1 == self.nx => (0, 1),
            1 => (x + 1, 0),
            -1 if x == 0 => (self.nx - 1, -1),
            -1 => (x - 1, 0),
            _ => (x, 0),
        };
        let (to_y, wrap_y) = if y + usize::from(down) == self.ny { (0, 1) } else { (y + usize::from(down), 0) };
        (to_y * self.nx + to_x, [wrap_x, wrap_y])
    }

    /// For each direction and point the index of the link that starts there, or `u32::MAX`; `None` if a link does not
    /// belong to the grid. `wraps` may be empty.
    pub(crate) fn numbers(self, links: &[[u32; 2]], wraps: &[[i8; 2]]) -> Option<Vec<Vec<u32>>> {
        let mut numbers = vec![vec![u32::MAX; self.nx * self.ny]; self.directions()];
        // Most links start at the same point as the one before, or at the next one: this needs no division.
        let (mut point, mut at) = (0, [0, 0]);
        for (id, &[from, to]) in (0u32..).zip(links) {
            let (from, to) = (from as usize, (to as usize, wraps.get(id as usize).copied().unwrap_or_default()));
            if from == point + 1 && at[0] + 1 < self.nx {
                at[0] += 1;
            } else if from != point {
                at = [from % self.nx, from / self.nx];
            }
            point = from;
            let mut free = numbers.iter_mut().enumerate().filter(|(_, numbers)| numbers[from] == u32::MAX);
            let (_, numbers) = free.find(|&(dir, _)| self.neighbor(at, dir) == to)?;
            numbers[from] = id;
        }
        Some(numbers)
    }

    /// Number of links.
    pub fn link_count(self) -> usize {
        let (nx, ny) = (self.nx, self.ny);
        if self.periodic || nx == 0 || ny == 0 {
            return nx * ny * self.directions();
        }
        let diagonals = if self.eight { 2 * (nx - 1) * (ny - 1) } else { 0 };
        (nx - 1) * ny + nx * (ny - 1) + diagonals
    }
}

/// Links of a grid: for each point by rows those to the right, below, below right, below left.
pub fn grid_links(shape: GridShape) -> Links {
    grid_links_until(shape, NEVER)
}

/// Like [`grid_links`]; returns fewer links if stopped.
pub fn grid_links_until(shape: GridShape, until: Until<'_>) -> Links {
    let mut links = Links::default();
    for (point, dir) in shape.slots() {
        if dir == 0 && point.is_multiple_of(1 << 15) && until() {
            break;
        }
        let (to, wrap) = shape.neighbor([point % shape.nx, point / shape.nx], dir);
        links.pairs.push([index_u32(point), index_u32(to)]);
        if shape.periodic {
            links.wraps.push(wrap);
        }
    }
    links
}

/// Square cells about a radius wide, for finding points near each other.
struct Buckets {
    low: Vec2,
    extent: Vec2,
    count: [i64; 2],
    periodic: bool,
}

impl Buckets {
    fn new(points: &[Vec2], radius: f32, size: Vec2, periodic: bool) -> Self {
        let (low, extent) = if periodic { (Vec2::ZERO, size) } else { bounds(points) };
        let most = f64::from(radius.max(1e-30)).recip();
        let fit = |length: f32| whole((f64::from(length) * most).min((points.len() as f64).sqrt() + 1.0)).max(1);
        Self { low, extent, count: [fit(extent.x), fit(extent.y)], periodic }
    }

    fn of(&self, p: Vec2) -> (i64, i64) {
        let at = |axis: usize| {
            let n = self.count[axis];
            let t = f64::from(p[axis] - self.low[axis]) / f64::from(self.extent[axis].max(1e-30)) * n as f64;
            let cell = whole(t.clamp(-1e15, 1e15));
            if self.periodic { cell.rem_euclid(n) } else { cell.clamp(0, n - 1) }
        };
        (at(0), at(1))
    }

    fn sort(&self, points: &[Vec2]) -> Cells {
        let [nx, ny] = self.count;
        Cells::new(points, nx * ny, |p| {
            let (x, y) = self.of(p);
            y * nx + x
        })
    }
}

/// Estimates the number of links of [`radius_links`] in O(n): the share π/9 of the pairs in neighbouring cells.
pub fn radius_estimate(points: &[Vec2], radius: f32, size: Vec2, periodic: bool) -> f64 {
    let buckets = Buckets::new(points, radius, size, periodic);
    let ([nx, ny], cells) = (buckets.count, buckets.sort(points));
    let mut pairs = 0.0;
    for y in 0..ny {
        for x in 0..nx {
            let here = cells.of(y * nx + x).len() as f64;
            for (dx, dy) in [-1, 0, 1].into_iter().flat_map(|dy| [-1, 0, 1].map(|dx| (dx, dy))) {
                let (x, y) =
                    if periodic { ((x + dx).rem_euclid(nx), (y + dy).rem_euclid(ny)) } else { (x + dx, y + dy) };
                if (0..nx).contains(&x) && (0..ny).contains(&y) {
                    pairs += here * cells.of(y * nx + x).len() as f64;
                }
            }
        }
    }
    let all = points.len() as f64 * (points.len() as f64 - 1.0) / 2.0;
    (pairs * 0.5 * std::f64::consts::PI / 9.0).min(all)
}

/// Links between all points at most `radius` mm apart, sorted; on a periodic canvas also across its edges, to
/// the nearest copy only. O(n + links) for points spread evenly.
pub fn radius_links(points: &[Vec2], radius: f32, size: Vec2, periodic: bool) -> Links {
    radius_links_until(points, radius, size, periodic, NEVER)
}

/// Like [`radius_links`]; returns fewer links if stopped.
pub fn radius_links_until(points: &[Vec2], radius: f32, size: Vec2, periodic: bool, until: Until<'_>) -> Links {
    let buckets = Buckets::new(points, radius, size, periodic);
    let ([nx, ny], cells) = (buckets.count, buckets.sort(points));
    let stopped = AtomicBool::new(false);
    let neighbours = |i: usize| {
        let (cx, cy) = buckets.of(points[i]);
        let mut found: Vec<([u32; 2], [i8; 2])> = Vec::new();
        if i.is_multiple_of(1 << 8) && until() {
            stopped.store(true, Ordering::Relaxed);
        }
        if stopped.load(Ordering::Relaxed) {
            return found;
        }
        for y in cy - 1..=cy + 1 {
            for x in cx - 1..=cx + 1 {
                if !periodic && (x < 0 || y < 0 || x >= nx || y >= ny) {
                    continue;
                }
                for &j in cells.of(y.rem_euclid(ny) * nx + x.rem_euclid(nx)) {
                    let wrap = if periodic { nearest_copy(points[j as usize] - points[i], size) } else { [0, 0] };
                    let to = points[j as usize] + Vec2::new(f32::from(wrap[0]), f32::from(wrap[1])) * size;
                    if (j as usize) > i && (to - points[i]).length() <= radius {
                        found.push(([index_u32(i), j], wrap));
                    }
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    };
    let found: Vec<_> = (0..points.len()).into_par_iter().flat_map_iter(neighbours).collect();
    let wraps = if periodic { found.iter().map(|f| f.1).collect() } else { Vec::new() };
    Links { pairs: found.into_iter().map(|f| f.0).collect(), wraps }
}

/// Brings points back into `0 ≤ p < size` and adjusts the links' wraps so that no link changes.
pub fn wrap(points: &mut [Vec2], links: &mut Links, size: Vec2) {
    if links.wraps.is_empty() {
        links.wraps = vec![[0, 0]; links.pairs.len()];
    }
    let mut shifts = Vec::with_capacity(points.len());
    for p in points.iter_mut() {
        let mut shift = (*p / size).floor();
        *p -= shift * size;
        // A tiny negative number rounds up to the edge itself.
        for axis in 0..2 {
            if p[axis] >= size[axis] {
                p[axis] = 0.0;
                shift[axis] += 1.0;
            }
        }
        shifts.push(shift);
    }
    for (pair, wrap) in links.pairs.iter().zip(&mut links.wraps) {
        let change = shifts[pair[1] as usize] - shifts[pair[0] as usize];
        for axis in 0..2 {
            wrap[axis] = small(f32::from(wrap[axis]) + change[axis]);
        }
    }
}

/// The copy of the canvas in which `delta` is shortest.
fn nearest_copy(delta: Vec2, size: Vec2) -> [i8; 2] {
    let turn = (delta / size).round();
    [small(-turn.x), small(-turn.y)]
}

#[expect(clippy::cast_possible_truncation, reason = "clamped to the range; links span few canvases")]
pub(super) fn small(value: f32) -> i8 {
    value.clamp(-127.0, 127.0) as i8
}

#[expect(clippy::cast_possible_truncation, reason = "truncation to a whole number is meant")]
fn whole(value: f64) -> i64 {
    value.floor() as i64
}

/// Lower corner and extent of the points.
fn bounds(points: &[Vec2]) -> (Vec2, Vec2) {
    let low = points.iter().copied().reduce(Vec2::min).unwrap_or_default();
    let high = points.iter().copied().reduce(Vec2::max).unwrap_or_default();
    (low, high - low)
}

/// Points by cell.
struct Cells {
    start: Vec<u32>,
    order: Vec<u32>,
}

impl Cells {
    fn new(points: &[Vec2], count: i64, cell: impl Fn(Vec2) -> i64) -> Self {
        let count = usize::try_from(count).expect("cell counts are positive");
        let cells: Vec<usize> = points.iter().map(|&p| usize::try_from(cell(p)).unwrap_or(0)).collect();
        let mut start = vec![0u32; count + 1];
        for &c in &cells {
            start[c + 1] += 1;
        }
        for c in 0..count {
            start[c + 1] += start[c];
        }
        let mut next = start.clone();
        let mut order = vec![0; points.len()];
        for (i, &c) in cells.iter().enumerate() {
            order[next[c] as usize] = index_u32(i);
            next[c] += 1;
        }
        Self { start, order }
    }

    fn of(&self, cell: i64) -> &[u32] {
        let cell = usize::try_from(cell).expect("cells are not negative");
        &self.order[self.start[cell] as usize..self.start[cell + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leather::points::{hexagon_grid, hexagons};

    #[test]
    fn edges_of_hexagons_are_links_of_their_grid() {
        for (size, edge) in [(Vec2::new(30.0, 20.0), 1.0), (Vec2::new(4.0, 3.0), 1.2), (Vec2::new(2.0, 2.0), 1.0)] {
            let shape = hexagon_grid(size, edge, true).expect("rows of as many");
            let (points, links) = hexagons(size, edge, true);
            assert_eq!(points.len(), shape.nx * shape.ny);
            let numbers = shape.numbers(&links.pairs, &links.wraps).expect("links of the grid");
            assert_eq!(numbers.iter().flatten().filter(|&&n| n != u32::MAX).count(), links.pairs.len());
        }
        // Rows of 8 and of 7 corners.
        assert_eq!(hexagon_grid(Vec2::new(11.1, 10.0), 1.0, false), None);
        let shape = GridShape { nx: 4, ny: 3, eight: false, periodic: true };
        assert_eq!(shape.numbers(&[[0, 5]], &[]), None);
        assert_eq!(shape.numbers(&[[0, 1], [0, 1]], &[]), None);
    }
}
