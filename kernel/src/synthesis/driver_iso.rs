//! The levels of a synthesis where `J = 1`: whole numbers, upsampled and corrected.
use super::analysis::Level;
use super::aniso::Position;
use super::coverage::{EvenUse, Factors};
use super::driver::{Inputs, Run};
use super::iso;
use super::levels::image;
use super::mend;
use super::region::Region;
use super::rematch;
use super::table::Table;
use crate::ground::window::index;
use rayon::prelude::*;

impl<I: Inputs> Run<'_, I> {
    pub(super) fn isometric(&self, levels: &[&Level], regions: &[Region]) -> Result<Vec<Position>, I::Stop> {
        let once = self.counts_once(regions);
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
            self.passes((k, regions.len()), once, |count| {
                if count {
                    factors = self.even(region).map(|even| table.factors(&even, region, &map));
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
            if mend::rounds(self.settings.rounds, region.h) > 0 {
                // Where use need not be counted once, it is before every round, and at the finest level too.
                let even = if once { None } else { self.even_from(region, 1) };
                self.mend((table, region), (even, factors.as_ref()), (&guide, &fixed), &mut map);
            }
            if region.h == 1 {
                iso::break_runs(table, region, &fixed, &mut map);
            }
            if let Some(fresh) = fresh {
                coarser = fresh;
            }
        }
        Ok(map.par_iter().map(|&at| coarser.pixel(at).map(|v| v as f32 + 0.5)).collect())
    }

    /// Mends where pieces meet.
    fn mend(
        &self,
        (table, region): (&Table, &Region),
        (even, factors): (Option<EvenUse>, Option<&Factors>),
        (guide, fixed): (&[f32], &[bool]),
        map: &mut [u32],
    ) {
        let Some((picture, pyramid)) = self.exemplar.picture else { return };
        let terms = rematch::Terms {
            factors,
            even,
            guide,
            guide_weight: self.settings.guide_weight * (region.h as f32 / 8.0).min(1.0),
            fixed,
            enough: self.settings.enough,
            hash: self.settings.hash.with(0x6D65_6E64).with(region.h as u64),
        };
        let image = image(picture, region.h, pyramid);
        mend::mend((table, &image), region, &terms, self.settings.rounds, map);
    }

    pub(super) fn upsample_iso(
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
                    // The four children of a pixel are jittered together.
                    let hash = self.settings.hash.with(0x7074).with(region.h as u64);
                    let sibling = parents.name(parent % parents.plane.w, parent / parents.plane.w);
                    table.at(self.jump(table, at, hash.with(sibling)))
                };
            }
        });
        out
    }
}
