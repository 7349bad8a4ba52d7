//! Growth: colonies that spread over a surface from seeds, as rust, patina, lichen and moss do.
//!
//! The time at which a front reaches a place is the least time over all ways to it, where each grain of the surface
//! delays the front by a hashed time (first-passage percolation; with random delays the clusters are those of M. Eden,
//! "A two-dimensional growth process", 1961). The front is marched over a grid in mm ([`march`]), so it is the same at
//! all resolutions of the picture, and a later moment contains all earlier ones. Run-off goes down from the growth
//! ([`runs`]); all of it is read smoothly at any point ([`read`]).
pub mod delays;
#[cfg(test)]
mod laws;
pub mod march;
pub mod margin;
pub mod read;
pub mod runs;

use crate::ground::hash::Hash;
use crate::ground::number::narrow;
use crate::ground::stop::Until;
use glam::{DVec2, I64Vec2, UVec2};
use march::{Arrival, Seed};
use read::{Cell, Drawing};
use shibo_value::Tiling;

/// Maximum number of cells of a grid.
pub const MOST: usize = 1 << 20;

/// Cells along a grain.
pub const CELLS: f64 = 2.0;

/// The least speed: slower places are not grown over.
pub const SLOWEST: f64 = 0.02;

/// A grid over the canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Columns and rows.
    pub counts: UVec2,
    /// The size of a cell in mm.
    pub cell: DVec2,
    /// The directions in which the canvas repeats.
    pub tiling: Tiling,
}

impl Plan {
    /// The grid for a canvas of `size` mm and grains of `grain` mm.
    pub fn new(size: DVec2, grain: f64, tiling: Tiling) -> Self {
        let counts = Self::counts(size, grain).min(DVec2::splat(MOST as f64));
        Self { counts: counts.as_uvec2(), cell: size / counts, tiling }
    }

    /// Columns and rows of such a grid.
    pub fn counts(size: DVec2, grain: f64) -> DVec2 {
        (size / grain * CELLS).ceil().max(DVec2::splat(8.0))
    }

    /// Number of cells.
    pub const fn len(&self) -> usize {
        self.counts.x as usize * self.counts.y as usize
    }

    /// True if there is no cell.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The centre of a cell in mm.
    pub fn centre(&self, index: usize) -> DVec2 {
        let columns = self.counts.x as usize;
        (DVec2::new((index % columns) as f64, (index / columns) as f64) + 0.5) * self.cell
    }

    /// The cell that contains a place.
    pub fn at(&self, place: DVec2) -> Option<usize> {
        self.index((place / self.cell).floor().as_i64vec2())
    }

    /// Index of a cell by column and row, if the canvas goes on there.
    #[inline]
    pub fn index(&self, at: I64Vec2) -> Option<usize> {
        let counts = self.counts.as_i64vec2();
        let axis = |at: i64, count: i64, repeats: bool| {
            if (0..count).contains(&at) { Some(at) } else { repeats.then(|| at.rem_euclid(count)) }
        };
        let (x, y) = (axis(at.x, counts.x, self.tiling.x)?, axis(at.y, counts.y, self.tiling.y)?);
        usize::try_from(y * counts.x + x).ok()
    }

    /// Index of the cell `by` columns and rows from another one, if the canvas goes on there.
    #[inline]
    pub fn beside(&self, index: usize, by: I64Vec2) -> Option<usize> {
        let columns = self.counts.x as usize;
        let at = UVec2::new(narrow_index(index % columns), narrow_index(index / columns));
        self.index(at.as_i64vec2() + by)
    }
}

fn narrow_index(n: usize) -> u32 {
    crate::ground::number::index_u32(n)
}

/// The rules by which colonies grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Size of a grain, mm.
    pub grain: f64,
    /// Spread of the delays, 0..1.
    pub roughness: f64,
    /// Mean distance of seeds, mm; no seeds if 0.
    pub spacing: f64,
    /// Time from the first to the last start of a colony, mm.
    pub stagger: f64,
    /// The moment that is drawn: the distance that an even front has gone, mm.
    pub amount: f64,
    /// Length of run-off, mm.
    pub drip: f64,
    /// The unit vector in which run-off goes.
    pub down: DVec2,
}

/// The surface at the cells of a grid.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// Speed of the front, as a multiple of the usual one.
    pub speeds: &'a [f32],
    /// Share of seeds that start a colony, 0..1.
    pub fertile: &'a [f32],
    /// True for cells that are grown over at time 0.
    pub started: &'a [bool],
}

impl Law {
    /// Grows colonies. `None` if stopped.
    pub fn grow(&self, plan: &Plan, ground: &Ground<'_>, hash: Hash, until: Until<'_>) -> Option<Drawing> {
        let delays = delays::delays(plan, self.roughness, hash.with(1));
        let slowness: Vec<f32> = delays
            .iter()
            .zip(ground.speeds)
            .map(|(delay, speed)| if f64::from(*speed) < SLOWEST { f32::INFINITY } else { delay / speed.min(1e3) })
            .collect();
        let seeds = self.seeds(plan, ground.fertile, hash.with(2));
        let Arrival { mut times, owners } = march::march(plan, &slowness, (ground.started, &seeds), until)?;
        let last = times.iter().filter(|time| time.is_finite()).fold(narrow(self.amount), |a, b| a.max(*b));
        let far = last + narrow(8.0 * self.grain);
        times.iter_mut().filter(|time| !time.is_finite()).for_each(|time| *time = far);
        let edges = margin::margin(plan, (&times, &owners), self.amount);
        let runs = runs::runs(plan, self, (&times, &edges), hash.with(3), until)?;
        let all = times.iter().zip(owners).zip(edges).zip(runs);
        let cells = all.map(|(((time, owner), edge), run)| Cell { time: *time, edge, run, owner }).collect();
        Some(Drawing { plan: *plan, cells, amount: narrow(self.amount), soft: narrow(2.0 * self.grain) })
    }

    /// The seeds: one in each square of `spacing`, where the ground is fertile.
    fn seeds(&self, plan: &Plan, fertile: &[f32], hash: Hash) -> Vec<Seed> {
        if self.spacing <= 0.0 {
            return Vec::new();
        }
        let size = plan.counts.as_dvec2() * plan.cell;
        let counts = (size / self.spacing).round().clamp(DVec2::ONE, plan.counts.as_dvec2());
        let counts = counts.as_uvec2();
        let mut seeds = Vec::new();
        for n in 0..counts.x * counts.y {
            let draw = |k: u64| hash.with(u64::from(n)).unit(k);
            let square = DVec2::new(f64::from(n % counts.x), f64::from(n / counts.x));
            let place = (square + DVec2::new(draw(0), draw(1))) / counts.as_dvec2() * size;
            let Some(cell) = plan.at(place) else { continue };
            if draw(2) < f64::from(fertile[cell]) {
                seeds.push(Seed { place, start: self.stagger * draw(3), owner: n + 2 });
            }
        }
        seeds
    }
}
