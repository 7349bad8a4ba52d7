//! Points at random that keep their distance: Poisson discs.
//!
//! Stands for the source's "any algorithm with an almost uniform distribution" (JP4905282B2 §3, A9, A68). Darts are
//! thrown at the free cells of a grid whose cells hold one point at most; cells of the same colour are too far apart to
//! matter to each other, so each colour is thrown in parallel and the result depends on the hash alone (after Wei,
//! "Parallel Poisson disk sampling", 2008). About 40 darts per square pitch give `.97 / aspect · A / pitch²` points.

use super::hash::Hash;
use glam::{IVec2, Vec2};
use rayon::prelude::*;

/// Disc radius over pitch: the mean distance of neighbours is then about the pitch.
const RADIUS: f32 = 0.8;
/// Darts per square pitch.
const DARTS: f32 = 40.0;

/// A set of Poisson discs.
#[derive(Clone, Copy)]
pub struct PoissonSpec<'a> {
    /// Size of the canvas in mm, > 0.
    pub size: Vec2,
    /// Wanted mean distance of neighbours in mm, > 0.
    pub pitch: f32,
    /// By how much the discs are longer than wide, ≥ 1.
    pub aspect: f32,
    /// Direction of their long axis in radians, from +x towards +y.
    pub angle: f32,
    /// Distances are measured across the canvas' edges.
    pub periodic: bool,
    /// Factor of the radius by place, clamped to 1..=`most`: sparser where it is large.
    pub factor: Option<&'a (dyn Fn(Vec2) -> f32 + Sync)>,
    /// Largest factor, 1 to 8; cost grows with its square.
    pub most: f32,
}

/// The cells and what is in them.
struct Board<'a> {
    spec: PoissonSpec<'a>,
    /// Cells per side, a multiple of the colours per side.
    cells: IVec2,
    cell: Vec2,
    /// Colours per side.
    colours: i32,
    /// Cells that may hold a point too near, nearest first.
    reach: Vec<IVec2>,
    /// Per cell the point and its factor; the factor is 0 in free cells.
    held: Vec<(Vec2, f32)>,
}

/// Points on the canvas, `0 ≤ p < size`, by cells from the top. O(darts); about half a microsecond a point.
pub fn poisson(spec: &PoissonSpec<'_>, hash: Hash) -> Vec<Vec2> {
    let mut board = Board::new(spec);
    let area = board.cell.x * board.cell.y / (spec.pitch * spec.pitch);
    let colours = board.colours;
    for dart in 0..whole((DARTS * area).ceil()).max(1) {
        let hash = hash.with(u64::from(dart.unsigned_abs()));
        let mut order: Vec<i32> = (0..colours * colours).collect();
        // The order of colours changes, or the first would leave its mark on the pattern.
        order.sort_by_key(|&c| hash.u64(u64::MAX - u64::from(c.unsigned_abs())));
        for colour in order {
            let rows = board.cells.y / colours;
            let throw = |row: i32| board.throw_row(row * colours + colour / colours, colour % colours, hash);
            let hits: Vec<_> = (0..rows).into_par_iter().flat_map_iter(throw).collect();
            for (cell, point, factor) in hits {
                board.held[cell] = (point, factor);
            }
        }
    }
    board.held.iter().filter(|h| h.1 > 0.0).map(|h| h.0).collect()
}

/// About how many points [`poisson`] gives for a factor of 1.
pub fn poisson_estimate(spec: &PoissonSpec<'_>) -> f64 {
    0.97 * f64::from(spec.size.x) * f64::from(spec.size.y)
        / (f64::from(spec.aspect) * f64::from(spec.pitch) * f64::from(spec.pitch))
}

impl<'a> Board<'a> {
    fn new(spec: &PoissonSpec<'a>) -> Self {
        let spec = PoissonSpec { most: if spec.factor.is_some() { spec.most.clamp(1.0, 8.0) } else { 1.0 }, ..*spec };
        let radius = RADIUS * spec.pitch;
        let side = radius * std::f32::consts::FRAC_1_SQRT_2;
        let (long, short) = (radius * spec.aspect * spec.most, radius * spec.most);
        // The box around the largest disc.
        let axis = Vec2::new(super::math::cos(spec.angle), super::math::sin(spec.angle));
        let half = ((axis * long).powf(2.0) + (axis.perp() * short).powf(2.0)).map(f32::sqrt);
        let colours = whole((half.max_element() / side).ceil()) + 1;
        let fit = |length: f32| whole((length / side / colours as f32).ceil()).max(1) * colours;
        let cells = IVec2::new(fit(spec.size.x), fit(spec.size.y));
        let cell = spec.size / cells.as_vec2();
        let span = (half / cell).ceil().as_ivec2();
        let mut board = Self { spec, cells, cell, colours, reach: Vec::new(), held: Vec::new() };
        for y in -span.y..=span.y {
            for x in -span.x..=span.x {
                let gap = (IVec2::new(x, y).abs() - 1).max(IVec2::ZERO).as_vec2() * cell;
                if gap.length() < long {
                    board.reach.push(IVec2::new(x, y));
                }
            }
        }
        board.reach.sort_by_key(|r| (r.length_squared(), r.y, r.x));
        board.held = vec![(Vec2::ZERO, 0.0); cells.as_usizevec2().element_product()];
        board
    }

    /// Throws a dart at each free cell of one colour in row `y`.
    fn throw_row(&self, y: i32, x: i32, hash: Hash) -> Vec<(usize, Vec2, f32)> {
        let mut hits = Vec::new();
        for x in (x..self.cells.x).step_by(self.colours.unsigned_abs() as usize) {
            let cell = self.index(IVec2::new(x, y));
            if self.held[cell].1 > 0.0 {
                continue;
            }
            let n = 2 * cell as u64;
            let rnd = Vec2::new(hash.unit_f32(n), hash.unit_f32(n + 1));
            // Rounding must not carry a point into the next cell's place beyond the canvas.
            let point = ((IVec2::new(x, y).as_vec2() + rnd) * self.cell).min(self.spec.size * (1.0 - f32::EPSILON));
            let factor = self.spec.factor.map_or(1.0, |f| f(point).clamp(1.0, self.spec.most));
            if self.is_free(IVec2::new(x, y), point, factor) {
                hits.push((cell, point, factor));
            }
        }
        hits
    }

    /// No point is nearer than the larger of the two radii.
    fn is_free(&self, at: IVec2, point: Vec2, factor: f32) -> bool {
        let axis = Vec2::new(super::math::cos(self.spec.angle), super::math::sin(self.spec.angle));
        let radius = RADIUS * self.spec.pitch;
        self.reach.iter().all(|reach| {
            let cell = at + *reach;
            let turn = cell.div_euclid(self.cells);
            if !self.spec.periodic && turn != IVec2::ZERO {
                return true;
            }
            let (other, its) = self.held[self.index(cell - turn * self.cells)];
            let delta = other + turn.as_vec2() * self.spec.size - point;
            let (u, v) = (delta.dot(axis) / self.spec.aspect, delta.perp_dot(axis));
            let limit = radius * factor.max(its);
            its == 0.0 || u * u + v * v >= limit * limit
        })
    }

    fn index(&self, cell: IVec2) -> usize {
        let cell = cell.as_usizevec2();
        cell.y * self.cells.as_usizevec2().x + cell.x
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a rounded number; casts saturate")]
fn whole(value: f32) -> i32 {
    value as i32
}
