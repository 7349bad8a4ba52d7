//! Synthesis on a surface: level by level over the charts of an atlas (rows C18, C22 to C26).
//!
//! As in the plane, but an indirection map gives the neighbours of pixels near the border of a chart, and each pixel
//! has its own Jacobian. Coordinates lie in the exemplar, so they need no change across borders. After the passes of a
//! level its border pixels are corrected again, since they converge more slowly.
use super::aniso::{Position, Terms};
use super::coverage::{EvenUse, Factors, SurfaceUses};
use super::driver::{Analysed, Inputs, Settings, Start};
use super::jacobian::{self, Jacobian};
use super::plane::PixelPlane;
use super::sheet::Sheet;
use super::surface_pass::{self, Pass};
use super::table::Table;
use super::{analysis, analysis::Level};
use glam::I64Vec3;
use rayon::prelude::*;
use shibo_value::IndirectionMap;
use std::collections::HashMap;

/// Further inputs of a synthesis on a surface.
pub struct Surfaces<'a> {
    /// The map of its pixels. The synthesis begins at the map's coarsest level.
    pub map: &'a IndirectionMap,
    /// The size of an exemplar pixel in mm.
    pub pitch: f64,
    /// Number of corrections of border pixels after each level's passes.
    pub border_passes: u32,
}

/// The inputs for each level of a surface.
pub trait SurfaceInputs: Inputs {
    /// Jacobians of a level's pixels, in exemplar pixels per finest pixel.
    ///
    /// # Errors
    /// Returns an error if a Jacobian cannot be used, or if stopped.
    fn along(&self, sheet: &Sheet<'_>) -> Result<Vec<Jacobian>, Self::Stop>;
}

/// Positions of the finest pixels, by rows, and their Jacobians; both are meaningless outside charts.
pub type Grown = (Vec<Position>, Vec<Jacobian>);

struct Run<'a, I: SurfaceInputs> {
    exemplar: &'a Analysed<'a>,
    surface: &'a Surfaces<'a>,
    settings: &'a Settings,
    inputs: &'a I,
}

/// Synthesises on a surface. The exemplar has at least as many levels as the map.
///
/// # Errors
/// Returns the stop of the inputs.
pub fn run<I: SurfaceInputs>(
    exemplar: &Analysed<'_>,
    surface: &Surfaces<'_>,
    settings: &Settings,
    inputs: &I,
) -> Result<Grown, I::Stop> {
    let run = Run { exemplar, surface, settings, inputs };
    let count = surface.map.levels.len().min(exemplar.levels.len());
    let tables: Vec<Table> = exemplar.levels[..count].par_iter().map(|level| run.table(level)).collect();
    let (mut map, mut jacobians): Grown = (Vec::new(), Vec::new());
    for l in (0..count).rev() {
        let sheet = Sheet::new(surface.map, l);
        let region = sheet.region();
        let finer = inputs.along(&sheet)?;
        let guide = inputs.guide(&region)?;
        map = match l + 1 == count {
            true => run.start(&tables[l], &sheet, &guide)?,
            false => {
                let coarse = Sheet::new(surface.map, l + 1);
                run.refined((&coarse, &map, &jacobians), &tables[l], (&sheet, &finer))?
            }
        };
        jacobians = finer;
        let mut fixed = Vec::new();
        if let Some((is_fixed, positions)) = inputs.fixed(&region)? {
            // A map of another surface may have holes: nothing is given there.
            let there = positions.iter().map(is_there);
            fixed = is_fixed.into_iter().zip(there).map(|(fixed, there)| fixed && there).collect();
            let given = map.iter_mut().zip(&fixed).zip(positions).filter(|((_, fixed), _)| **fixed);
            given.for_each(|((map, _), at)| *map = at);
        }
        run.correct((l, count), &tables, (&sheet, &jacobians), (&guide, &fixed), &mut map)?;
    }
    Ok((map, jacobians))
}

impl<I: SurfaceInputs> Run<'_, I> {
    fn table(&self, level: &Level) -> Table {
        let plane = self.exemplar.plane;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of pixels")]
        let margin = (level.h as f64 * self.settings.margin).min(plane.w.min(plane.h) as f64 / 6.0) as usize;
        let valid = analysis::valid(plane, self.exemplar.usable, margin);
        let guide = match self.exemplar.guide.is_empty() {
            true => Vec::new(),
            false => super::texels::Texels::new(plane, 1, self.exemplar.guide.to_vec()).blurred(level.h).data,
        };
        Table::new(level, plane, &valid, &guide)
    }

    /// Weight of the guide: high at coarse levels, low at fine ones, where the texture decides.
    fn weight(&self, table: &Table) -> f32 {
        self.settings.guide_weight * table.spread * (table.h as f32 / 8.0).min(1.0)
    }

    /// Start positions: the given ones, or random exemplar positions.
    fn start(&self, table: &Table, sheet: &Sheet<'_>, guide: &[f32]) -> Result<Vec<Position>, I::Stop> {
        let given = match self.settings.start {
            Start::Given => self.inputs.start(&sheet.region())?,
            _ => Vec::new(),
        };
        let weight = self.weight(table);
        let place = |pixel: usize| match sheet.level.triangle(pixel) {
            _ if given.get(pixel).is_some_and(is_there) => given[pixel],
            Some(_) => self.random(table, sheet, pixel, guide.get(pixel).map(|wanted| (*wanted, weight))),
            None => [0.5; 2],
        };
        Ok((0..sheet.level.owner.len()).into_par_iter().with_min_len(64).map(place).collect())
    }

    /// A random position for a pixel, hashed by its position on the surface.
    fn random(&self, table: &Table, sheet: &Sheet<'_>, pixel: usize, guide: Option<(f32, f32)>) -> Position {
        let PixelPlane { w, h, wrap } = table.plane;
        let half = f64::from(sheet.level.h) / 2.0;
        let room = |n: usize, wrap: bool| {
            let half = if wrap { 0.0 } else { half.min((n as f64 - 1.0) / 2.0) };
            (half, n as f64 - half)
        };
        let (x, y) = (room(w, wrap[0]), room(h, wrap[1]));
        let hash = sheet.name(self.settings.hash, pixel, self.surface.pitch);
        let mut best: Option<(f32, Position)> = None;
        for t in 0..if guide.is_none() { 8 } else { 48 } {
            let hash = hash.with(t);
            let at = [x.0 + (x.1 - x.0) * hash.unit(0), y.0 + (y.1 - y.0) * hash.unit(1)];
            #[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar")]
            let at = at.map(|v| v as f32);
            let cell = table.at(table.plane.inside(at.map(floor)));
            let cost = match guide {
                _ if !table.is_valid(cell) => f32::MAX,
                None => 0.0,
                Some((wanted, weight)) => weight * (wanted - table.guide(cell)).powi(2),
            };
            if best.is_none_or(|b| cost < b.0) {
                best = Some((cost, at));
            }
            if cost <= 0.0 {
                break;
            }
        }
        best.map_or([0.5; 2], |best| best.1)
    }

    /// Upsamples the positions of the coarser level, jitters them and brings them inside the exemplar.
    fn refined(
        &self,
        coarse: (&Sheet<'_>, &[Position], &[Jacobian]),
        table: &Table,
        (sheet, jacobians): (&Sheet<'_>, &[Jacobian]),
    ) -> Result<Vec<Position>, I::Stop> {
        let h = sheet.level.h as f32;
        let jitter = self.settings.jitter > 0.0 && sheet.level.h > 2;
        let mask = if jitter { self.inputs.jitter(&sheet.region())? } else { Vec::new() };
        let hash = self.settings.hash.with(0x4A17);
        let settled = |pixel: usize, at: Option<Position>| {
            let mut at = at.unwrap_or_else(|| self.random(table, sheet, pixel, None));
            if jitter {
                let name = sheet.name(hash, pixel, self.surface.pitch);
                let reach = self.settings.jitter * h * mask.get(pixel).copied().unwrap_or(1.0);
                at = [0, 1].map(|d| at[d] + (name.unit_f32(d as u64) * 2.0 - 1.0) * reach);
            }
            let cell = at.map(floor);
            if !table.holds(cell) {
                let to = table.plane.inwards(cell);
                at = [0, 1].map(|d| to[d] as f32 + (at[d] - cell[d] as f32).clamp(0.0, 0.99));
            }
            table.wrapped(at)
        };
        Ok(upsampled(coarse, (sheet, |pixel: usize| jacobians[pixel]), settled))
    }

    /// Runs the passes of a level.
    fn correct(
        &self,
        (l, count): (usize, usize),
        tables: &[Table],
        (sheet, jacobians): (&Sheet<'_>, &[Jacobian]),
        (guide, fixed): (&[f32], &[bool]),
        map: &mut [Position],
    ) -> Result<(), I::Stop> {
        let finer: Vec<&Table> = tables[..=l].iter().rev().collect();
        let table = finer[0];
        let even = self.settings.even.filter(|_| sheet.level.h >= 2);
        let (sites, tiles) = match even {
            Some(even) => (sheet.sites(), self.tiles(&even, sheet)),
            None => (Vec::new(), (Vec::new(), 1)),
        };
        let passes = self.settings.passes as usize;
        let mut factors = None;
        for k in 0..passes + self.surface.border_passes as usize {
            self.inputs.step((count - 1 - l) * passes + k.min(passes), count * passes)?;
            if k < passes {
                factors = even.map(|even| {
                    let shown = SurfaceUses { sites: &sites, tiles: &tiles.0, count: tiles.1, h: table.h };
                    Factors::of_surface(&even, table.plane, table.usable_bins, &shown, |p| {
                        (table.bin_at(table.padded(table.cell(map[p]))), jacobian::det(&jacobians[p]).abs())
                    })
                });
            }
            let terms = Terms {
                kappa: self.settings.kappa,
                averaged: self.settings.averaged,
                factors: factors.as_ref(),
                guide,
                guide_weight: self.weight(table),
                fixed,
            };
            let pass = Pass { tables: &finer, sheet, jacobians, terms: &terms };
            if k < passes { surface_pass::correct(&pass, map) } else { surface_pass::correct_border(&pass, map) }
        }
        Ok(())
    }

    /// For each pixel the index of the cube of space that contains it; and the number of cubes.
    fn tiles(&self, even: &EvenUse, sheet: &Sheet<'_>) -> (Vec<u32>, usize) {
        let Some(side) = even.tile.map(|tile| tile as f64 * self.surface.pitch) else { return (Vec::new(), 1) };
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
        let cube = |pixel: usize| {
            let at = (sheet.place(pixel)? / side).floor();
            Some(I64Vec3::new(at.x as i64, at.y as i64, at.z as i64))
        };
        let cubes: Vec<Option<I64Vec3>> = (0..sheet.level.owner.len()).into_par_iter().map(cube).collect();
        let mut names = HashMap::new();
        let name = |cube: Option<I64Vec3>| {
            let next = u32::try_from(names.len()).unwrap_or(u32::MAX);
            cube.map_or(0, |cube| *names.entry(cube.to_array()).or_insert(next))
        };
        let tiles = cubes.into_iter().map(name).collect();
        let count = names.len().max(1);
        (tiles, count)
    }
}

/// Returns whether a map of coordinates has a value at a pixel.
fn is_there(at: &Position) -> bool {
    at[0].is_finite() && at[1].is_finite()
}

/// Rounds a coordinate down to its exemplar pixel.
#[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar")]
fn floor(v: f32) -> i32 {
    v.floor() as i32
}

/// Equation (3): each pixel continues its parent, wherever the parent lies. `settled` finishes a position; its argument
/// is `None` if the pixel has no parent.
pub fn upsampled<T: crate::ground::real::Real, J: crate::ground::real::Real>(
    (coarse, map, before): (&Sheet<'_>, &[[T; 2]], &[[J; 4]]),
    (sheet, jacobian): (&Sheet<'_>, impl Fn(usize) -> [J; 4] + Sync),
    settled: impl Fn(usize, Option<[T; 2]>) -> [T; 2] + Sync,
) -> Vec<[T; 2]> {
    let w = sheet.level.size[0] as usize;
    let across = coarse.level.size[0] as usize;
    let h = f64::from(sheet.level.h);
    let apply = |j: &[J; 4], v: [f64; 2]| -> [T; 2] {
        let v = v.map(T::of);
        let j = j.map(|v| T::of(v.wide()));
        [j[0] * v[0] + j[1] * v[1], j[2] * v[0] + j[3] * v[1]]
    };
    let mut out = vec![[T::HALF; 2]; sheet.level.owner.len()];
    out.par_chunks_mut(w).with_min_len(8).enumerate().for_each(|(y, row)| {
        let mut parents = sheet.parents(y).iter().peekable();
        for (x, out) in row.iter_mut().enumerate() {
            let pixel = y * w + x;
            if sheet.level.owner[pixel] == 0 {
                continue;
            }
            let special = parents.next_if(|parent| parent.pixel as usize == pixel);
            let delta = [x & 1, y & 1].map(|bit| (bit as f64 - 0.5) * h);
            let (parent, residue, delta) = match special {
                None => (Some(y / 2 * across + x / 2), [0.0; 2], delta),
                Some(special) => {
                    let residue = special.jump.offset().map(|v| f64::from(v) * 2.0 * h);
                    let delta = if special.still { [0.0; 2] } else { delta };
                    (special.jump.is_some().then_some(special.jump.to as usize), residue, delta)
                }
            };
            let at = parent.map(|parent| {
                let mut at = map[parent];
                if residue != [0.0; 2] {
                    let by = apply(&before[parent], residue);
                    at = [at[0] + by[0], at[1] + by[1]];
                }
                let by = apply(&jacobian(pixel), delta);
                [at[0] + by[0], at[1] + by[1]]
            });
            *out = settled(pixel, at);
        }
    });
    out
}
