//! A pass over the pixels of a surface level: [`aniso`](super::aniso) with pointers across borders of charts.
use super::aniso::{Position, Terms};
use super::jacobian::{self, Jacobian};
use super::plane::PixelPlane;
use super::settle::{Geometry, Matcher};
use super::sheet::Sheet;
use super::table::Table;
use crate::ground::simd;
use crate::ground::window::{OCTANTS, index, offset};
use rayon::prelude::*;
use shibo_value::{IndirectionLevel, Jump8};

/// Inputs of a pass.
pub(super) struct Pass<'a> {
    /// The tables of the level and all finer ones, the level's first.
    pub(super) tables: &'a [&'a Table],
    pub(super) sheet: &'a Sheet<'a>,
    pub(super) jacobians: &'a [Jacobian],
    pub(super) terms: &'a Terms<'a>,
}

/// The order of the quarters, by the parity of columns and rows.
const QUARTERS: [[usize; 2]; 4] = [[0, 0], [1, 1], [1, 0], [0, 1]];

/// Corrects all pixels, one quarter after another.
pub(super) fn correct(pass: &Pass<'_>, map: &mut [Position]) {
    let PixelPlane { w, h, .. } = pass.sheet.plane();
    let mut fresh = Vec::new();
    for first in QUARTERS {
        if first[0] >= w || first[1] >= h {
            continue;
        }
        let (columns, rows) = ((w - first[0]).div_ceil(2), (h - first[1]).div_ceil(2));
        fresh.clear();
        fresh.resize(columns * rows, [0.0f32; 2]);
        let old: &[Position] = map;
        fresh.par_chunks_mut(columns).with_min_len(4).enumerate().for_each(|(row, out)| {
            let y = first[1] + 2 * row;
            simd::dispatch(
                #[inline(always)]
                || pass.row(old, (first[0], y), out),
            );
        });
        map.par_chunks_mut(w).skip(first[1]).step_by(2).zip(fresh.par_chunks(columns)).with_min_len(8).for_each(
            |(map, fresh)| {
                map[first[0]..].iter_mut().step_by(2).zip(fresh).for_each(|(map, fresh)| *map = *fresh);
            },
        );
    }
}

/// Corrects the pixels near borders, one quarter after another.
pub(super) fn correct_border(pass: &Pass<'_>, map: &mut [Position]) {
    let w = pass.sheet.plane().w;
    let level = pass.sheet.level;
    for first in QUARTERS {
        let old: &[Position] = map;
        let own = |pixel: u32| {
            let (x, y) = (pixel as usize % w, pixel as usize / w);
            [x & 1, y & 1] == first
        };
        let one = |(pixel, jumps): (&u32, &Jump8)| {
            let pixel = *pixel as usize;
            simd::dispatch(
                #[inline(always)]
                || pass.pixel(old, pixel, Some(jumps)),
            )
        };
        let quarter: Vec<(&u32, &Jump8)> =
            level.border.iter().zip(&level.jumps).filter(|(pixel, _)| own(**pixel)).collect();
        let fresh: Vec<Position> = quarter.par_iter().with_min_len(64).map(|site| one(*site)).collect();
        quarter.iter().zip(fresh).for_each(|((pixel, _), at)| map[**pixel as usize] = at);
    }
}

impl Pass<'_> {
    #[inline(always)]
    fn row(&self, map: &[Position], (first, y): (usize, usize), out: &mut [Position]) {
        let w = self.sheet.plane().w;
        let (border, jumps) = self.sheet.border(y);
        let mut next = 0;
        for (k, out) in out.iter_mut().enumerate() {
            let pixel = y * w + first + 2 * k;
            let owner = self.sheet.level.owner[pixel];
            if owner == 0 {
                *out = map[pixel];
                continue;
            }
            let mut pointers = None;
            if owner & IndirectionLevel::BORDER != 0 {
                while (border[next] as usize) < pixel {
                    next += 1;
                }
                pointers = Some(&jumps[next]);
            }
            *out = self.pixel(map, pixel, pointers);
        }
    }

    #[inline(always)]
    fn pixel(&self, map: &[Position], pixel: usize, jumps: Option<&Jump8>) -> Position {
        let (own, terms) = (map[pixel], self.terms);
        if !terms.fixed.is_empty() && terms.fixed[pixel] {
            return own;
        }
        let level = self.sheet.level;
        let geometry = Geometry::new(self.tables, level.h as usize, &self.jacobians[pixel]);
        let mut near = [own; 8];
        for (k, near) in near.iter_mut().enumerate() {
            let [sx, sy] = geometry.step(k);
            let Some(jumps) = jumps else {
                let [dx, dy] = OCTANTS[k];
                let at = map[offset(index(pixel) + dy * level.size[0].cast_signed() + dx)];
                *near = [at[0] - sx, at[1] - sy];
                continue;
            };
            let jump = jumps[k];
            // Beyond the end of the surface, the pixel's own position is used.
            if !jump.is_some() {
                continue;
            }
            let mut at = map[jump.to as usize];
            if jump.residue != [0; 2] {
                let residue = jump.offset().map(|v| v * level.h as f32);
                let by = jacobian::apply(&self.jacobians[jump.to as usize], residue);
                at = [at[0] + by[0], at[1] + by[1]];
            }
            *near = [at[0] - sx, at[1] - sy];
        }
        let factors = terms.factors.map(|factors| factors.of_site(pixel));
        let guide = if terms.guide.is_empty() { None } else { Some(terms.guide[pixel]) };
        Matcher { terms }.settle(&geometry, own, &near, (factors, guide))
    }
}
