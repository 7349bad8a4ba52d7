//! From an analysed exemplar to coordinates: start, and per level upsample, jitter and correct.
use super::analysis::{self, Level};
use super::aniso::{self, Jacobians, Position};
use super::coverage::{EvenUse, Factors};
use super::iso::{self, Table};
use super::jacobian::{self, IDENTITY};
use super::lattice::Basis;
use super::lattice_start::{Fitted, fit};
use super::region::{Needs, Output, Region, plan};
use super::texels::{Texels, mirrored};
use super::{Lookup, Plane};
use crate::kernel::hash::Hash;
use crate::kernel::window::{index, offset};
use rayon::prelude::*;

/// An exemplar, analysed.
pub struct Analysed<'a> {
    /// Its size and where it joins.
    pub plane: Plane,
    /// Levels from the finest.
    pub levels: &'a [Level],
    /// Pixels that may be shown; empty for all.
    pub usable: &'a [bool],
    /// A guide value for every pixel; empty for none.
    pub guide: &'a [f32],
}

/// Where the coordinates of the first level come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Anywhere.
    Random,
    /// Anywhere in the same phase.
    Lattice(Basis),
    /// [`Inputs::start`].
    Given,
}

/// How to synthesise.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Cost factor of what merely looks alike, κ.
    pub kappa: f32,
    /// Even use of the exemplar, at levels of at least 2.
    pub even: Option<EvenUse>,
    /// Correction passes per level.
    pub passes: u32,
    /// Whether three predictions are averaged where `J` is not 1.
    pub averaged: bool,
    /// Displacement of pixels after upsampling, in pixels of the level, at levels of more than 2.
    pub jitter: f32,
    /// Weight of the guide.
    pub guide_weight: f32,
    /// Distance from borders within which nothing may be shown, in level spacings.
    pub margin: f64,
    /// Spacing of the first level.
    pub coarsest: usize,
    /// Where the first coordinates come from.
    pub start: Start,
    /// Random numbers.
    pub hash: Hash,
}

/// Pixels that are given, and what they show at their centres.
pub type Fixed = (Vec<bool>, Vec<Position>);

/// What the caller knows of each level.
pub trait Inputs: Sync {
    /// Why it stopped.
    type Stop;
    /// The Jacobians; `None` where `J = 1` everywhere.
    fn jacobians(&self, region: &Region) -> Result<Option<Jacobians>, Self::Stop>;
    /// Wanted guide values by pixel; empty for none.
    fn guide(&self, region: &Region) -> Result<Vec<f32>, Self::Stop>;
    /// Pixels that are given; `None` for none.
    fn fixed(&self, region: &Region) -> Result<Option<Fixed>, Self::Stop>;
    /// What the jitter is multiplied by, by pixel; empty for 1.
    fn jitter(&self, region: &Region) -> Result<Vec<f32>, Self::Stop>;
    /// Positions to start from, by pixel, at their centres.
    fn start(&self, region: &Region) -> Result<Vec<Position>, Self::Stop>;
    /// Called between passes.
    fn step(&self, done: usize, total: usize) -> Result<(), Self::Stop>;
}

/// What came out.
pub struct Synthesis {
    /// Positions of the output's pixels, by rows.
    pub coords: Vec<Position>,
    /// The share of pixels that continue the exemplar to the right and below.
    pub coherence: f32,
    /// The share of the exemplar that is shown, counting evenly.
    pub coverage: f32,
}

struct Run<'a, I: Inputs> {
    exemplar: &'a Analysed<'a>,
    settings: &'a Settings,
    inputs: &'a I,
    isometric: bool,
    fitted: Option<Fitted>,
}

/// Synthesises the pixels of `output`.
///
/// # Errors
/// What the inputs stopped with.
pub fn run<I: Inputs>(
    exemplar: &Analysed<'_>,
    output: &Output,
    settings: &Settings,
    inputs: &I,
) -> Result<Synthesis, I::Stop> {
    let levels: Vec<&Level> = exemplar.levels.iter().filter(|l| l.h <= settings.coarsest).collect();
    let tile = settings.even.and_then(|even| even.tile);
    let passes = i32::try_from(settings.passes).unwrap_or(64);
    let needs: Vec<Needs> = levels
        .iter()
        .rev()
        .map(|level| Needs { h: level.h, reach: passes * 4 * level.hood.reach(), tile: tile.filter(|_| level.h >= 2) })
        .collect();
    let regions = plan(output, &needs);
    let first = inputs.jacobians(&regions[0])?;
    let j = match &first {
        None => IDENTITY,
        Some(Jacobians::Constant(j)) => *j,
        Some(Jacobians::Each(list)) => list[list.len() / 2],
    };
    let fitted = match settings.start {
        Start::Lattice(basis) if !matches!(first, Some(Jacobians::Each(_))) => {
            let j = j.map(f64::from);
            let size = output.size.map(|n| n as f64);
            Some(fit(basis, [[j[0], j[1]], [j[2], j[3]]], size, output.wrap))
        }
        _ => None,
    };
    let run = Run { exemplar, settings, inputs, isometric: first.is_none(), fitted };
    let coords = if run.isometric {
        run.isometric(&levels, &regions)?
    } else {
        let tables: Vec<Table> = levels.par_iter().map(|level| run.table(level)).collect();
        run.anisometric(&tables, &regions)?
    };
    let region = &regions[regions.len() - 1];
    let coords = cut(&coords, region, output);
    let (coherence, coverage) = report(&coords, output, exemplar.plane);
    Ok(Synthesis { coords, coherence, coverage })
}

impl<I: Inputs> Run<'_, I> {
    fn table(&self, level: &Level) -> Table {
        let plane = self.exemplar.plane;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of pixels")]
        let margin = (level.h as f64 * self.settings.margin).min(plane.w.min(plane.h) as f64 / 6.0) as usize;
        let valid = analysis::valid(plane, self.exemplar.usable, margin);
        let guide = if self.exemplar.guide.is_empty() {
            Vec::new()
        } else {
            let blurred = Texels::new(plane, 1, self.exemplar.guide.to_vec()).blurred(level.h);
            // An isometric position is the corner of what a pixel stands for.
            let shift = if self.isometric { index(level.h / 2) } else { 0 };
            let at = |k: usize, n: usize, wrap: bool| mirrored(index(k) + shift, n, wrap);
            (0..plane.w * plane.h)
                .map(|p| {
                    let (x, y) = (at(p % plane.w, plane.w, plane.wrap[0]), at(p / plane.w, plane.h, plane.wrap[1]));
                    blurred.data[y * plane.w + x]
                })
                .collect()
        };
        Table::new(level, plane, &valid, &guide)
    }

    /// The guide decides at coarse levels, the texture at fine ones.
    fn weight(&self, table: &Table) -> f32 {
        self.settings.guide_weight * table.spread * (table.h as f32 / 8.0).min(1.0)
    }

    /// Exemplar pixels to start from, centres of what the pixels of a region stand for.
    fn start(&self, table: &Table, region: &Region, guide: &[f32]) -> Result<Vec<Position>, I::Stop> {
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

    /// The exemplar pixel that a position stands for in the tables: for `J = 1` the corner of a level's pixel.
    #[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar")]
    fn anchor(&self, at: Position, h: usize) -> [i32; 2] {
        let shift = if self.isometric { (h as f32 - 1.0) / 2.0 } else { 0.0 };
        at.map(|v| (v - shift).floor() as i32)
    }

    /// Exemplar pixel (x, y) brought inside: around where sides join, else to the border.
    fn inside(&self, table: &Table, [x, y]: [i32; 2]) -> [i32; 2] {
        let Plane { w, h, wrap } = table.plane;
        [index(Plane::bring(x, w, wrap[0])), index(Plane::bring(y, h, wrap[1]))]
    }

    /// Where a pixel goes that left the exemplar: to the same phase of the lattice, to what looks like the border it
    /// left by, or inwards by half the exemplar. Never to the border, which would show as streaks.
    fn jump(&self, table: &Table, at: [i32; 2], hash: Hash) -> [i32; 2] {
        if table.holds(at) {
            return self.inside(table, at);
        }
        let border = self.inside(table, at);
        let size = [table.plane.w, table.plane.h].map(index);
        if let Some(fitted) = &self.fitted {
            let half = (table.h as f64 / 2.0).min(f64::from(size[0].min(size[1])) / 4.0);
            for k in 0..8 {
                let wish = [0, 1].map(|d| half + (f64::from(size[d]) - 2.0 * half) * hash.unit(2 * k + d as u64));
                #[expect(clippy::cast_possible_truncation, reason = "a pixel of an exemplar")]
                let to = fitted.moved(at.map(f64::from), wish).map(|v| v.round() as i32);
                if table.holds(to) && table.is_valid(table.at(self.inside(table, to))) {
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
        let inwards = [0, 1].map(|d| at[d] + (border[d] - at[d]).signum() * (size[d] / 2));
        self.inside(table, inwards)
    }

    /// By how much a pixel is moved at random, in finest exemplar pixels.
    fn shake(&self, region: &Region, mask: &[f32], pixel: usize) -> [f32; 2] {
        let (x, y) = (pixel % region.plane.w, pixel / region.plane.w);
        let hash = self.settings.hash.with(0x4A17).with(region.h as u64).with(region.name(x, y));
        let reach = self.settings.jitter * region.h as f32 * mask.get(pixel).copied().unwrap_or(1.0);
        [0, 1].map(|n| (hash.unit_f32(n) * 2.0 - 1.0) * reach)
    }

    fn shaken(&self, region: &Region) -> Result<Option<Vec<f32>>, I::Stop> {
        if self.settings.jitter <= 0.0 || region.h <= 2 {
            return Ok(None);
        }
        self.inputs.jitter(region).map(Some)
    }

    fn passes(&self, (level, levels): (usize, usize), local: bool, mut pass: impl FnMut(bool)) -> Result<(), I::Stop> {
        let passes = self.settings.passes as usize;
        for k in 0..passes {
            self.inputs.step(level * passes + k, levels * passes)?;
            // Local counts are taken once per level, so that what a pixel depends on stays near.
            pass(k == 0 || !local);
        }
        Ok(())
    }

    fn isometric(&self, levels: &[&Level], regions: &[Region]) -> Result<Vec<Position>, I::Stop> {
        let local = self.settings.even.is_some_and(|even| even.tile.is_some());
        let mut map: Vec<u32> = Vec::new();
        // The tables of the level before, then those of the level: all of them at once would take much memory.
        let mut coarser = self.table(levels[levels.len() - 1]);
        for (k, region) in regions.iter().enumerate() {
            let fresh = if k == 0 { None } else { Some(self.table(levels[levels.len() - 1 - k])) };
            let table = fresh.as_ref().unwrap_or(&coarser);
            let guide = self.inputs.guide(region)?;
            if k == 0 {
                let start = self.start(table, region, &guide)?;
                map = start.iter().map(|&at| table.at(self.inside(table, self.anchor(at, region.h)))).collect();
            } else {
                let mask = self.shaken(region)?;
                map = self.upsample_iso((&coarser, &regions[k - 1], &map), table, region, mask.as_deref());
            }
            let mut fixed = Vec::new();
            if let Some((is_fixed, positions)) = self.inputs.fixed(region)? {
                for ((map, fixed), at) in map.iter_mut().zip(&is_fixed).zip(positions) {
                    if *fixed {
                        *map = table.at(self.inside(table, self.anchor(at, region.h)));
                    }
                }
                fixed = is_fixed;
            }
            let mut factors = None;
            self.passes((k, regions.len()), local, |count| {
                if count {
                    let even = self.settings.even.filter(|_| region.h >= 2);
                    factors = even.map(|even| table.factors(&even, region, &map));
                }
                let terms = iso::Terms {
                    kappa: self.settings.kappa,
                    averaged: self.settings.averaged,
                    factors: factors.as_ref(),
                    guide: &guide,
                    guide_weight: self.weight(table),
                    fixed: &fixed,
                };
                iso::correct(table, region, &terms, &mut map);
            })?;
            if let Some(fresh) = fresh {
                coarser = fresh;
            }
        }
        Ok(map.par_iter().map(|&at| coarser.pixel(at).map(|v| v as f32 + 0.5)).collect())
    }

    fn upsample_iso(
        &self,
        (coarse, parents, map): (&Table, &Region, &[u32]),
        table: &Table,
        region: &Region,
        mask: Option<&[f32]>,
    ) -> Vec<u32> {
        let w = region.plane.w;
        let mut out = vec![0; w * region.plane.h];
        out.par_chunks_mut(w).with_min_len(8).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let (parent, bits) = region.parent(parents, x, y);
                let [px, py] = coarse.pixel(map[parent]);
                let mut at = [px + index(bits[0] * table.h), py + index(bits[1] * table.h)];
                if let Some(mask) = mask {
                    let by = self.shake(region, mask, y * w + x);
                    #[expect(clippy::cast_possible_truncation, reason = "less than a level")]
                    let by = by.map(|v| v.round() as i32);
                    at = [at[0] + by[0], at[1] + by[1]];
                }
                *out = if table.holds(at) {
                    table.at(self.inside(table, at))
                } else {
                    // Siblings jump together.
                    let hash = self.settings.hash.with(0x7074).with(region.h as u64);
                    let sibling = parents.name(parent % parents.plane.w, parent / parents.plane.w);
                    table.at(self.jump(table, at, hash.with(sibling)))
                };
            }
        });
        out
    }

    fn anisometric(&self, tables: &[Table], regions: &[Region]) -> Result<Vec<Position>, I::Stop> {
        let local = self.settings.even.is_some_and(|even| even.tile.is_some());
        let mut map: Vec<Position> = Vec::new();
        for (k, region) in regions.iter().enumerate() {
            let level = tables.len() - 1 - k;
            let table = &tables[level];
            let finer: Vec<&Table> = tables[..=level].iter().rev().collect();
            let jacobians = self.inputs.jacobians(region)?.unwrap_or(Jacobians::Constant(IDENTITY));
            let guide = self.inputs.guide(region)?;
            if k == 0 {
                map = self.start(table, region, &guide)?;
            } else {
                let mask = self.shaken(region)?;
                map = self.upsample((&regions[k - 1], &map), table, (region, &jacobians), mask.as_deref());
            }
            let mut fixed = Vec::new();
            if let Some((is_fixed, positions)) = self.inputs.fixed(region)? {
                let given = map.iter_mut().zip(&is_fixed).zip(positions).filter(|((_, fixed), _)| **fixed);
                given.for_each(|((map, _), at)| *map = at);
                fixed = is_fixed;
            }
            let mut factors = None;
            self.passes((k, regions.len()), local, |count| {
                if count {
                    let even = self.settings.even.filter(|_| region.h >= 2);
                    factors = even.map(|even| {
                        Factors::count(&even, table.plane, table.usable_bins, region, |p| {
                            table.bin_at(table.padded(table.cell(map[p])))
                        })
                    });
                }
                let terms = aniso::Terms {
                    kappa: self.settings.kappa,
                    averaged: self.settings.averaged,
                    factors: factors.as_ref(),
                    guide: &guide,
                    guide_weight: self.weight(table),
                    fixed: &fixed,
                };
                aniso::correct(&finer, region, &region.plane, &jacobians, &terms, &mut map);
            })?;
        }
        Ok(map)
    }

    fn upsample(
        &self,
        (parents, map): (&Region, &[Position]),
        table: &Table,
        (region, jacobians): (&Region, &Jacobians),
        mask: Option<&[f32]>,
    ) -> Vec<Position> {
        let w = region.plane.w;
        let mut out = vec![[0.0; 2]; w * region.plane.h];
        out.par_chunks_mut(w).with_min_len(8).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let (parent, bits) = region.parent(parents, x, y);
                let delta = bits.map(|b| (b as f32 - 0.5) * region.h as f32);
                let by = jacobian::apply(jacobians.at(y * w + x), delta);
                let mut at = [map[parent][0] + by[0], map[parent][1] + by[1]];
                if let Some(mask) = mask {
                    let by = self.shake(region, mask, y * w + x);
                    at = [at[0] + by[0], at[1] + by[1]];
                }
                let cell = table.cell(at);
                if !table.holds(cell) {
                    let hash = self.settings.hash.with(0x7074).with(region.h as u64);
                    let sibling = parents.name(parent % parents.plane.w, parent / parents.plane.w);
                    let to = self.jump(table, cell, hash.with(sibling));
                    at = [0, 1].map(|d| to[d] as f32 + (at[d] - cell[d] as f32).clamp(0.0, 0.99));
                }
                *out = table.wrapped(at);
            }
        });
        out
    }
}

/// The output's part of a region.
fn cut(coords: &[Position], region: &Region, output: &Output) -> Vec<Position> {
    let skip = [0, 1].map(|d| offset(output.start[d] - region.start[d]));
    let rows = coords.chunks_exact(region.plane.w).skip(skip[1]).take(output.size[1]);
    rows.flat_map(|row| &row[skip[0]..skip[0] + output.size[0]]).copied().collect()
}

/// The shares of pixels that continue, and of exemplar pixels in use.
fn report(coords: &[Position], output: &Output, plane: Plane) -> (f32, f32) {
    let [w, h] = output.size;
    let goes_on =
        |a: Position, b: Position, step: [f32; 2]| (b[0] - a[0] - step[0]).abs() + (b[1] - a[1] - step[1]).abs() < 0.5;
    let mut coherent = 0usize;
    let mut counts = vec![0u32; plane.w * plane.h];
    for (p, &at) in coords.iter().enumerate() {
        let (x, y) = (p % w, p / w);
        if x + 1 < w && y + 1 < h {
            coherent += usize::from(goes_on(at, coords[p + 1], [1.0, 0.0]) && goes_on(at, coords[p + w], [0.0, 1.0]));
        }
        #[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar")]
        let cell = at.map(|v| v.floor() as i32);
        counts[plane.index(cell[0], cell[1])] += 1;
    }
    let n = coords.len() as f64;
    let entropy: f64 =
        counts.iter().filter(|c| **c > 0).map(|c| f64::from(*c) / n).map(|share| -share * libm::log(share)).sum();
    let used = libm::exp(entropy) / (plane.w * plane.h).min(coords.len()) as f64;
    #[expect(clippy::cast_possible_truncation, reason = "shares")]
    let used = used as f32;
    (coherent as f32 / ((w - 1).max(1) * (h - 1).max(1)) as f32, used)
}
