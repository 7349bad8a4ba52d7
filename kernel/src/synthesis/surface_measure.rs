//! Measures the continuity of a synthesis on a surface, inside charts and across their borders (row C26).
use super::aniso::Position;
use super::jacobian::{self, Jacobian};
use super::plane::Neighbours;
use super::sheet::Sheet;
use crate::ground::window::{OCTANTS, index};
use rayon::prelude::*;
use shibo_value::{IndirectionLevel, Seam};

/// Steps between neighbouring pixels: colour difference per mm, and whether the exemplar's order is broken.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    /// Steps across borders of charts.
    pub across: Vec<(f32, bool)>,
    /// Steps away from borders.
    pub inside: Vec<(f32, bool)>,
}

/// Approximate number of pixels measured away from borders, evenly spread.
const INSIDE: usize = 65_536;

/// A synthesis to measure: positions by pixel, their Jacobians, and the colour at a position.
pub struct Measured<'a, C> {
    /// The level.
    pub sheet: &'a Sheet<'a>,
    /// Positions by pixel.
    pub coords: &'a [Position],
    /// Jacobians by pixel.
    pub jacobians: &'a [Jacobian],
    /// The colour at a position.
    pub color: C,
}

impl<C: Fn(Position) -> [f32; 3] + Sync> Measured<'_, C> {
    /// The neighbour of a pixel, and the position that it predicts for the pixel; `None` without such a neighbour.
    fn predicted(&self, pixel: usize, octant: usize) -> Option<(usize, Position)> {
        let w = self.sheet.plane().w;
        let (near, residue) = self.sheet.near((index(pixel % w), index(pixel / w)), octant)?;
        let h = self.sheet.level.h as f32;
        let off = jacobian::apply(&self.jacobians[near], residue.map(|v| v * h));
        let step = jacobian::apply(&self.jacobians[pixel], OCTANTS[octant].map(|v| v as f32 * h));
        Some((near, [0, 1].map(|d| self.coords[near][d] + off[d] - step[d])))
    }

    /// Share of pixels whose right and lower neighbours continue the exemplar.
    pub fn coherence(&self) -> f32 {
        let sites = self.sheet.sites();
        let goes_on = |pixel: usize, octant: usize| {
            self.predicted(pixel, octant).is_some_and(|(_, at)| {
                let own = self.coords[pixel];
                (at[0] - own[0]).abs() + (at[1] - own[1]).abs() < 0.5
            })
        };
        let coherent = sites.par_iter().filter(|&&p| goes_on(p as usize, 0) && goes_on(p as usize, 2)).count();
        coherent as f32 / sites.len().max(1) as f32
    }

    /// Steps to the four nearest neighbours: all that cross a border, and many that are not near one.
    pub fn steps(&self) -> Steps {
        let level = self.sheet.level;
        let chart = |pixel: usize| level.triangle(pixel).map(|triangle| self.sheet.atlas.charts[triangle]);
        let of = |pixel: u32| {
            let pixel = pixel as usize;
            let border = level.jumps(pixel).is_some();
            let w = self.sheet.plane().w;
            let step = move |octant: usize| {
                let (near, at) = self.predicted(pixel, octant)?;
                let [dx, dy] = OCTANTS[octant];
                let beside = index(near) == index(pixel) + dy * index(w) + dx;
                let crosses = chart(near) != chart(pixel) || !beside;
                if border && !crosses {
                    return None;
                }
                let length = self.sheet.place(pixel)?.distance(self.sheet.place(near)?);
                let (a, b) = ((self.color)(self.coords[pixel]), (self.color)(self.coords[near]));
                let off: f32 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                let own = self.coords[pixel];
                let away = [0, 1].map(|axis| at[axis] - own[axis]);
                let torn = away[0] * away[0] + away[1] * away[1] > 0.25;
                #[expect(clippy::cast_possible_truncation, reason = "a length in mm")]
                let per_mm = off.sqrt() / length.max(1e-9) as f32;
                Some((crosses, per_mm, torn))
            };
            [0, 2, 4, 6].map(step)
        };
        let sites = self.sheet.sites();
        let every = (sites.len() / INSIDE).max(1);
        let is_border = |pixel: u32| level.owner[pixel as usize] & IndirectionLevel::BORDER != 0;
        let chosen = sites.par_iter().enumerate().filter(|(n, pixel)| n % every == 0 || is_border(**pixel));
        let found: Vec<_> = chosen.map(|(_, pixel)| of(*pixel)).collect();
        let mut steps = Steps::default();
        for (crosses, off, torn) in found.into_iter().flatten().flatten() {
            if crosses { steps.across.push((off, torn)) } else { steps.inside.push((off, torn)) }
        }
        steps
    }
}

/// Mean, 99th percentile, and share of the broken steps.
fn statistics(steps: &[(f32, bool)]) -> [f32; 3] {
    let n = steps.len().max(1);
    let mean = steps.iter().map(|step| f64::from(step.0)).sum::<f64>() / n as f64;
    let mut sorted: Vec<f32> = steps.iter().map(|step| step.0).collect();
    sorted.sort_by(f32::total_cmp);
    let p99 = sorted.get(steps.len() * 99 / 100).copied().unwrap_or(0.0);
    let torn = steps.iter().filter(|step| step.1).count() as f32 / n as f32;
    [crate::ground::number::narrow(mean), p99, torn]
}

/// Steps across borders divided by those inside.
pub fn seam(steps: &Steps) -> Seam {
    let (across, inside) = (statistics(&steps.across), statistics(&steps.inside));
    let ratio = |k: usize| if inside[k] > 0.0 { across[k] / inside[k] } else { 1.0 };
    let pairs = u32::try_from(steps.across.len()).unwrap_or(u32::MAX);
    Seam { pairs, mean: ratio(0), p99: ratio(1), torn: ratio(2) }
}
