//! The levels of a synthesis where `J = 1`: integer positions, upsampled and corrected.
use super::analysis::Level;
use super::aniso::Position;
use super::coverage::EvenUse;
use super::driver::{Inputs, SynthesisRun};
use super::iso;
use super::layer::Layer;
use super::levels::image;
use super::mend;
use super::region::{Needs, Planned, Region};
use super::table::Table;
use crate::ground::window::index;
use rayon::prelude::*;

impl<I: Inputs> SynthesisRun<'_, I> {
    pub(super) fn isometric(
        &self,
        levels: &[&Level],
        planned: &[Planned],
        needs: &[Needs],
    ) -> Result<Vec<Position>, I::Stop> {
        let once = self.counts_once(planned);
        let mut map: Vec<u32> = Vec::new();
        // Build the tables level by level: all of them at once would take much memory.
        let mut coarser = self.table(levels[levels.len() - 1]);
        for (k, (planned_here, needs)) in planned.iter().zip(needs).enumerate() {
            let region = &planned_here.region;
            let fresh = if k == 0 { None } else { Some(self.table(levels[levels.len() - 1 - k])) };
            let table = fresh.as_ref().unwrap_or(&coarser);
            let guide = self.inputs.guide(region)?;
            if k == 0 {
                let start = self.start(table, region, &guide)?;
                map = start.iter().map(|&at| table.at(self.inside(table, self.anchor(at, region.h)))).collect();
            } else {
                let mask = self.shaken(region)?;
                let parents = (&coarser, &planned[k - 1].wanted, &map[..]);
                map = self.upsample_iso(parents, table, region, mask.as_deref());
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
            let mut layer = Layer::new(planned_here, needs.reach, map, guide, fixed);
            if let Some(fitted) = &self.in_step {
                layer.phases = fitted.phases(region);
            }
            self.passes((k, planned.len()), once, |count| {
                if count {
                    layer.factors =
                        self.even(&layer.region).map(|even| table.factors(&even, &layer.region, &layer.map));
                }
                layer.trim();
                let terms = iso::Terms {
                    kappa: self.settings.kappa,
                    averaged: self.settings.averaged,
                    factors: layer.factors.as_ref(),
                    guide: &layer.guide,
                    guide_weight: self.weight(table),
                    fixed: &layer.fixed,
                    phases: &layer.phases,
                };
                iso::correct(table, &layer.region, &terms, &mut layer.map);
                layer.spend(iso::QUARTERS * table.hood.reach());
            })?;
            if mend::rounds(self.settings.rounds, table.h) > 0 {
                // If uses need not be counted once per level, they are counted before every round, at the finest level
                // too.
                let even = if once { None } else { self.even_from(&layer.region, 1) };
                self.mend(table, even, &mut layer);
            }
            layer.trim();
            if table.h == 1 {
                iso::break_runs(table, &layer.region, &layer.fixed, &mut layer.map);
            }
            map = layer.result();
            if let Some(fresh) = fresh {
                coarser = fresh;
            }
        }
        Ok(map.par_iter().map(|&at| coarser.pixel(at).map(|v| v as f32 + 0.5)).collect())
    }

    /// Mends the joints between pieces.
    fn mend(&self, table: &Table, even: Option<EvenUse>, layer: &mut Layer) {
        let Some((picture, pyramid)) = self.exemplar.picture else { return };
        let how = mend::How {
            rounds: self.settings.rounds,
            even,
            guide_weight: self.settings.guide_weight * (table.h as f32 / 8.0).min(1.0),
            enough: self.settings.enough,
            hash: self.settings.hash.with(0x6D65_6E64).with(table.h as u64),
        };
        let image = image(picture, table.h, pyramid);
        mend::mend((table, &image), &how, layer);
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
