//! Reads a growth at any point: cubic B-splines over the cells, which round off the cells.
use super::Plan;
use crate::ground::cubic::bspline;
use crate::ground::number::narrow;
use glam::{DVec2, Vec2};

/// The least slope of the time at a front, so that flat places have no wide border.
const FLAT: f32 = 0.3;

/// A cell of a growth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// The moment at which the front comes.
    pub time: f32,
    /// Distance from the margin of the colony, mm.
    pub edge: f32,
    /// Strength of run-off, 0..1.
    pub run: f32,
    /// Number of the colony, 0 if none comes.
    pub owner: u32,
}

/// A growth at a moment.
#[derive(Clone, Debug)]
pub struct Drawing {
    pub(super) plan: Plan,
    pub(super) cells: Vec<Cell>,
    pub(super) amount: f32,
    /// Times farther from the moment than this do not shape the front.
    pub(super) soft: f32,
}

/// The front at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spot {
    /// Time from the moment to the arrival: below 0 where the point is grown over. It is limited to twice a grain.
    pub late: f32,
    /// The share of a pixel that is grown over.
    pub mask: f32,
    /// Distance from the margin of the colony, mm, from 0 on.
    pub edge: f32,
    /// Number of the colony, 0 beyond the front.
    pub owner: u32,
}

/// The 16 cells around a point.
struct Taps {
    xs: [usize; 4],
    rows: [usize; 4],
    share: Vec2,
}

impl Drawing {
    /// Approximate memory in bytes.
    pub const fn bytes(&self) -> usize {
        self.cells.len() * size_of::<Cell>()
    }

    /// The cells, row by row.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    fn taps(&self, place: DVec2) -> Taps {
        let at = place / self.plan.cell - 0.5;
        let base = at.floor();
        let (share, base) = ((at - base).as_vec2(), base.as_i64vec2());
        let axis = |from: i64, count: u32, repeats: bool| {
            let count = i64::from(count);
            [-1, 0, 1, 2].map(|k| {
                let n = from.saturating_add(k);
                let n = if repeats { n.rem_euclid(count) } else { n.clamp(0, count - 1) };
                usize::try_from(n).unwrap_or(0)
            })
        };
        let Plan { counts, tiling, .. } = self.plan;
        let xs = axis(base.x, counts.x, tiling.x);
        let rows = axis(base.y, counts.y, tiling.y).map(|y| y * counts.x as usize);
        Taps { xs, rows, share }
    }

    /// The moment at which the front comes to a place in mm, and the strength of run-off there.
    pub fn history(&self, place: DVec2) -> [f32; 2] {
        let Taps { xs, rows, share } = self.taps(place);
        let (wx, wy) = (bspline(share.x), bspline(share.y));
        let (mut time, mut run) = (0.0, 0.0);
        for (row, wy) in rows.iter().zip(wy) {
            for (x, wx) in xs.iter().zip(wx) {
                let (cell, weight) = (&self.cells[row + x], wx * wy);
                time += weight * cell.time;
                run += weight * cell.run;
            }
        }
        [time, run]
    }

    /// The front at a place in mm, for a pixel that is `pixel` mm wide.
    pub fn front(&self, place: DVec2, pixel: f64) -> Spot {
        let Taps { xs, rows, share } = self.taps(place);
        let (wx, wy) = (bspline(share.x), bspline(share.y));
        let (sx, sy) = (slopes(share.x), slopes(share.y));
        let mut spot = Spot::default();
        let (mut dx, mut dy) = (0.0, 0.0);
        let mut owners = [(0, 0.0); 16];
        let mut count = 0;
        for (row, (wy, sy)) in rows.iter().zip(wy.iter().zip(sy)) {
            for (x, (wx, sx)) in xs.iter().zip(wx.iter().zip(sx)) {
                let (cell, weight) = (&self.cells[row + x], wx * wy);
                let late = (cell.time - self.amount).clamp(-self.soft, self.soft);
                spot.late += weight * late;
                spot.edge += weight * cell.edge;
                dx += sx * wy * late;
                dy += wx * sy * late;
                if cell.owner == 0 || cell.time > self.amount {
                    continue;
                }
                match owners[..count].iter_mut().find(|(owner, _)| *owner == cell.owner) {
                    Some((_, sum)) => *sum += weight,
                    None => {
                        owners[count] = (cell.owner, weight);
                        count += 1;
                    }
                }
            }
        }
        let cell = self.plan.cell.as_vec2();
        let slope = ((dx / cell.x) * (dx / cell.x) + (dy / cell.y) * (dy / cell.y)).sqrt().max(FLAT);
        spot.mask = (0.5 - spot.late / (slope * narrow(pixel).max(1e-9))).clamp(0.0, 1.0);
        spot.edge = spot.edge.max(0.0);
        if spot.late <= 0.0 {
            let larger = |a: (u32, f32), b: &(u32, f32)| if b.1 > a.1 || (b.1 == a.1 && b.0 < a.0) { *b } else { a };
            spot.owner = owners[..count].iter().fold((0, 0.0), larger).0;
        }
        spot
    }
}

/// Derivatives of the weights of the cubic B-spline.
fn slopes(t: f32) -> [f32; 4] {
    let u = 1.0 - t;
    [-0.5 * u * u, t * (1.5 * t - 2.0), u * (2.0 - 1.5 * u), 0.5 * t * t]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_the_derivatives_of_the_weights() {
        for k in 1..40u8 {
            let t = f32::from(k) / 40.0;
            let (low, high) = (bspline(t - 0.01), bspline(t + 0.01));
            for (n, slope) in slopes(t).iter().enumerate() {
                assert!(((high[n] - low[n]) / 0.02 - slope).abs() < 1e-3, "{t} {n}");
            }
        }
    }
}
