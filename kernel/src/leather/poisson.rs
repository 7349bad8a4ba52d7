//! Random points with a minimum distance: Poisson discs.
//!
//! Implements the source's "any algorithm with an almost uniform distribution" (JP4905282B2 §3). Dart throwing in
//! rounds: each round throws darts at some of the free cells of a grid whose cells hold at most one point. A dart lands
//! unless it is too near to a point, or to another dart of the same round with a higher priority. Both tests depend
//! only on the state before the round, so each round runs in parallel and the result depends on the hash alone. Few
//! darts in the first rounds keep the grid out of the pattern: throwing cell by cell in a fixed order left peaks of the
//! grid in the spectrum, 240 times the mean. About 40 darts per square pitch give `.97 / aspect · A / pitch²` points.

use crate::ground::hash::Hash;
use crate::ground::stop::{NEVER, Until};
use glam::{IVec2, Vec2};
use rayon::prelude::*;

/// Disc radius over pitch: the mean distance of neighbours is then about the pitch.
const RADIUS: f32 = 0.8;
/// For each round, the share of free cells at which a dart is thrown.
const ROUNDS: [f32; 24] = [
    0.05, 0.05, 0.1, 0.1, 0.1, 0.15, 0.2, 0.2, 0.3, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0,
    1.0, 1.0,
];

/// A set of Poisson discs.
#[derive(Clone, Copy)]
pub struct PoissonSpec<'a> {
    /// Size of the canvas in mm, > 0.
    pub size: Vec2,
    /// Wanted mean distance of neighbours in mm, > 0.
    pub pitch: f32,
    /// Aspect ratio of the discs, length over width, ≥ 1.
    pub aspect: f32,
    /// Direction of their long axis in radians, from +x towards +y.
    pub angle: f32,
    /// Distances are measured across the canvas' edges.
    pub periodic: bool,
    /// Factor on the radius by position, clamped to 1..=`most`: sparser where it is large.
    pub factor: Option<&'a (dyn Fn(Vec2) -> f32 + Sync)>,
    /// Aspect ratio of the discs, 1 to `aspect`, and direction of their long axis in radians, by position; replaces
    /// `angle`. Two points are far enough apart if neither lies in the disc of the other.
    pub shape: Option<&'a (dyn Fn(Vec2) -> (f32, f32) + Sync)>,
    /// Largest factor, 1 to 8; cost grows with its square.
    pub most: f32,
}

/// The grid of cells with its points.
struct BackgroundGrid<'a> {
    spec: PoissonSpec<'a>,
    /// Cells per side.
    cells: IVec2,
    cell: Vec2,
    /// Direction of the discs' long axis.
    axis: Vec2,
    /// Cells that may hold a point too near, nearest first.
    reach: Vec<IVec2>,
    /// The same as differences of indices, and their extent, for cells away from the canvas' edges.
    steps: Vec<isize>,
    span: IVec2,
    /// Per cell the point and its factor; the factor is 0 in free cells.
    held: Vec<(Vec2, f32)>,
}

/// A dart: position, factor, and priority, which is above 0.
type Dart = (Vec2, f32, u32);

/// Points on the canvas, `0 ≤ p < size`, by cells from the top. O(darts); about two microseconds a point.
pub fn poisson(spec: &PoissonSpec<'_>, hash: Hash) -> Vec<Vec2> {
    poisson_until(spec, hash, NEVER)
}

/// Like [`poisson`]; returns fewer points if stopped.
pub fn poisson_until(spec: &PoissonSpec<'_>, hash: Hash, until: Until<'_>) -> Vec<Vec2> {
    let mut grid = BackgroundGrid::new(spec);
    let columns = grid.cells.as_usizevec2().x;
    let mut darts: Vec<Dart> = vec![(Vec2::ZERO, 0.0, 0); grid.held.len()];
    for (round, share) in (0..).zip(ROUNDS) {
        let hash = hash.with(round);
        let throw = |(row, y): (&mut [Dart], i32)| {
            if !until() {
                grid.throw_row(y, share, hash, row);
            }
        };
        darts.par_chunks_mut(columns).zip(0..grid.cells.y).for_each(throw);
        if until() {
            break;
        }
        let lands = |(y, row): (i32, &mut [(Vec2, f32)])| {
            for (held, x) in row.iter_mut().zip(0..) {
                let at = IVec2::new(x, y);
                let dart = darts[grid.index(at)];
                if dart.2 > 0 && grid.is_highest(at, dart, &darts) {
                    *held = (dart.0, dart.1);
                }
            }
        };
        let mut next = grid.held.clone();
        (0..grid.cells.y).into_par_iter().zip(next.par_chunks_mut(columns)).for_each(lands);
        grid.held = next;
    }
    grid.held.iter().filter(|h| h.1 > 0.0).map(|h| h.0).collect()
}

/// Estimates the number of points of [`poisson`] for a factor of 1.
pub fn poisson_estimate(spec: &PoissonSpec<'_>) -> f64 {
    0.97 * f64::from(spec.size.x) * f64::from(spec.size.y)
        / (f64::from(spec.aspect) * f64::from(spec.pitch) * f64::from(spec.pitch))
}

impl<'a> BackgroundGrid<'a> {
    fn new(spec: &PoissonSpec<'a>) -> Self {
        let spec = PoissonSpec { most: if spec.factor.is_some() { spec.most.clamp(1.0, 8.0) } else { 1.0 }, ..*spec };
        let radius = RADIUS * spec.pitch;
        let side = radius * std::f32::consts::FRAC_1_SQRT_2;
        let (long, short) = (radius * spec.aspect * spec.most, radius * spec.most);
        // The bounding box of the largest disc.
        let axis = Vec2::new(crate::ground::math::cos(spec.angle), crate::ground::math::sin(spec.angle));
        let half = match spec.shape {
            None => {
                let [along, across] = [axis * long, axis.perp() * short];
                (along * along + across * across).map(f32::sqrt)
            }
            Some(_) => Vec2::splat(long),
        };
        let fit = |length: f32| whole((length / side).ceil()).max(1);
        let cells = IVec2::new(fit(spec.size.x), fit(spec.size.y));
        let cell = spec.size / cells.as_vec2();
        let span = (half / cell).ceil().as_ivec2();
        let (reach, steps) = (Vec::new(), Vec::new());
        let mut grid = Self { spec, cells, cell, axis, reach, steps, span, held: Vec::new() };
        for y in -span.y..=span.y {
            for x in -span.x..=span.x {
                let gap = (IVec2::new(x, y).abs() - 1).max(IVec2::ZERO).as_vec2() * cell;
                if gap.length() < long {
                    grid.reach.push(IVec2::new(x, y));
                }
            }
        }
        grid.reach.sort_by_key(|r| (r.length_squared(), r.y, r.x));
        grid.steps = grid.reach.iter().map(|r| (r.y * cells.x + r.x) as isize).collect();
        grid.held = vec![(Vec2::ZERO, 0.0); cells.as_usizevec2().element_product()];
        grid
    }

    /// Throws darts at a share of the free cells of row `y`, and keeps those that are not too near to a point.
    fn throw_row(&self, y: i32, share: f32, hash: Hash, row: &mut [Dart]) {
        for (dart, x) in row.iter_mut().zip(0..) {
            let at = IVec2::new(x, y);
            let cell = self.index(at);
            dart.2 = 0;
            let n = 4 * cell as u64;
            if self.held[cell].1 > 0.0 || hash.unit_f32(n + 2) >= share {
                continue;
            }
            let rnd = Vec2::new(hash.unit_f32(n), hash.unit_f32(n + 1));
            // Rounding must not move a point beyond the canvas, into the next cell.
            let point = ((at.as_vec2() + rnd) * self.cell).min(self.spec.size * (1.0 - f32::EPSILON));
            let factor = self.spec.factor.map_or(1.0, |f| f(point).clamp(1.0, self.spec.most));
            let free = self.all_near(at, |other, turn| {
                let (other, its) = self.held[other];
                its == 0.0 || self.is_apart(point, other + turn, factor.max(its))
            });
            if free {
                let number = u32::try_from(hash.u64(n + 3) >> 33).unwrap_or(0) + 1;
                *dart = (point, factor, number);
            }
        }
    }

    /// Returns whether the dart has the highest priority among the darts too near to it; a tie goes to the later cell.
    fn is_highest(&self, at: IVec2, (point, factor, number): Dart, darts: &[Dart]) -> bool {
        let cell = self.index(at);
        self.all_near(at, |other, turn| {
            let (place, its, rival) = darts[other];
            (rival, other) <= (number, cell) || self.is_apart(point, place + turn, factor.max(its))
        })
    }

    /// Returns whether `holds` is true for all cells that may hold a point too near to one in cell `at`. Its arguments
    /// are the cell, and the shift of the cell's points across the canvas' edges.
    fn all_near(&self, at: IVec2, holds: impl Fn(usize, Vec2) -> bool) -> bool {
        let (low, high) = (at - self.span, at + self.span);
        if low.min_element() >= 0 && high.x < self.cells.x && high.y < self.cells.y {
            let here = self.index(at);
            return self.steps.iter().all(|step| holds(here.wrapping_add_signed(*step), Vec2::ZERO));
        }
        self.reach.iter().all(|reach| {
            let cell = at + *reach;
            let turn = cell.div_euclid(self.cells);
            if !self.spec.periodic && turn != IVec2::ZERO {
                return true;
            }
            holds(self.index(cell - turn * self.cells), turn.as_vec2() * self.spec.size)
        })
    }

    /// Returns whether the distance of two points is at least a disc's radius times `factor`.
    fn is_apart(&self, a: Vec2, b: Vec2, factor: f32) -> bool {
        let limit = RADIUS * self.spec.pitch * factor;
        let lies_beyond = |aspect: f32, axis: Vec2| {
            let (u, v) = ((b - a).dot(axis) / aspect, (b - a).perp_dot(axis));
            u * u + v * v >= limit * limit
        };
        let Some(shape) = self.spec.shape else { return lies_beyond(self.spec.aspect, self.axis) };
        [a, b].into_iter().all(|place| {
            let (aspect, angle) = shape(place);
            let (sin, cos) = crate::ground::math::sin_cos(angle);
            lies_beyond(aspect.clamp(1.0, self.spec.aspect), Vec2::new(cos, sin))
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
