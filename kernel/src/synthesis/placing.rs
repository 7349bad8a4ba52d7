//! Positions for pixels at the start, when they leave the exemplar, and when they are jittered.
use super::aniso::Position;
use super::driver::{Inputs, Start, SynthesisRun};
use super::region::Region;
use super::table::Table;
use crate::ground::hash::Hash;
use crate::ground::window::index;
use rayon::prelude::*;

impl<I: Inputs> SynthesisRun<'_, I> {
    /// Start positions in the exemplar: the centres of the footprints of a region's pixels.
    pub(super) fn start(&self, table: &Table, region: &Region, guide: &[f32]) -> Result<Vec<Position>, I::Stop> {
        if self.settings.start == Start::Given {
            return self.inputs.start(region);
        }
        let plane = self.exemplar.plane;
        let half = region.h as f64 / 2.0;
        let room = |n: usize, wrap: bool| {
            let half = if wrap { 0.0 } else { half.min((n as f64 - 1.0) / 2.0) };
            (half, n as f64 - half)
        };
        let (x, y) = (room(plane.w, plane.wrap[0]), room(plane.h, plane.wrap[1]));
        let (low, high) = ([x.0, y.0], [x.1, y.1]);
        let weight = self.weight(table);
        let place = |k: usize| -> Position {
            let (px, py) = (k % region.plane.w, k / region.plane.w);
            let hash = self.settings.hash.with(region.name(px, py));
            let tries = if guide.is_empty() { 8 } else { 48 };
            let mut best: Option<(f32, Position)> = None;
            for t in 0..tries {
                let hash = hash.with(t);
                let at = match &self.fitted {
                    Some(fitted) => fitted.place(region.center(px, py), low, high, hash),
                    None => [0, 1].map(|d| low[d] + (high[d] - low[d]) * hash.unit(d as u64)),
                };
                #[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar")]
                let at = at.map(|v| v as f32);
                let cell = table.at(self.inside(table, self.anchor(at, region.h)));
                let cost = if !table.is_valid(cell) {
                    f32::MAX
                } else if guide.is_empty() {
                    0.0
                } else {
                    weight * (guide[k] - table.guide(cell)).powi(2)
                };
                if best.is_none_or(|b| cost < b.0) {
                    best = Some((cost, at));
                }
                if cost <= 0.0 {
                    break;
                }
            }
            best.map_or([0.5; 2], |b| b.1)
        };
        Ok((0..region.plane.w * region.plane.h).into_par_iter().with_min_len(64).map(place).collect())
    }

    /// The exemplar pixel of a position in the tables: for `J = 1` the corner of a level's pixel.
    #[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar")]
    pub(super) fn anchor(&self, at: Position, h: usize) -> [i32; 2] {
        let shift = if self.isometric { (h as f32 - 1.0) / 2.0 } else { 0.0 };
        at.map(|v| (v - shift).floor() as i32)
    }

    /// Moves exemplar pixel (x, y) inside: wraps along axes that wrap, else clamps to the border.
    pub(super) fn inside(&self, table: &Table, at: [i32; 2]) -> [i32; 2] {
        table.plane.inside(at)
    }

    /// Moves a pixel that left the exemplar back: to the same phase of the lattice, or to a pixel that looks like the
    /// border where it left, or inwards by half the exemplar. Axes that wrap only wrap.
    pub(super) fn jump(&self, table: &Table, at: [i32; 2], hash: Hash) -> [i32; 2] {
        if table.holds(at) {
            return self.inside(table, at);
        }
        let at = table.plane.joined(at);
        let border = self.inside(table, at);
        let size = [table.plane.w, table.plane.h].map(index);
        if let Some(fitted) = &self.fitted {
            let half = (table.h as f64 / 2.0).min(f64::from(size[0].min(size[1])) / 4.0);
            for k in 0..8 {
                let wish = [0, 1].map(|d| half + (f64::from(size[d]) - 2.0 * half) * hash.unit(2 * k + d as u64));
                #[expect(clippy::cast_possible_truncation, reason = "a pixel of an exemplar")]
                let to = fitted.moved(at.map(f64::from), wish).map(|v| v.round() as i32);
                let to = table.plane.joined(to);
                if table.holds(to) && table.is_valid(table.at(to)) {
                    return to;
                }
            }
        } else if self.isometric
            && let Some(second) = table.second(border)
        {
            let to = [second[0] + at[0] - border[0], second[1] + at[1] - border[1]];
            if table.holds(to) {
                return self.inside(table, to);
            }
        }
        table.plane.inwards(at)
    }

    /// Random displacement of a pixel, in finest exemplar pixels.
    pub(super) fn shake(&self, region: &Region, mask: &[f32], pixel: usize) -> [f32; 2] {
        let (x, y) = (pixel % region.plane.w, pixel / region.plane.w);
        let hash = self.settings.hash.with(0x4A17).with(region.h as u64).with(region.name(x, y));
        let reach = self.settings.jitter * region.h as f32 * mask.get(pixel).copied().unwrap_or(1.0);
        [0, 1].map(|n| (hash.unit_f32(n) * 2.0 - 1.0) * reach)
    }

    pub(super) fn shaken(&self, region: &Region) -> Result<Option<Vec<f32>>, I::Stop> {
        if self.settings.jitter <= 0.0 || region.h <= 2 {
            return Ok(None);
        }
        self.inputs.jitter(region).map(Some)
    }
}
