//! The levels of a synthesis with a Jacobian: real positions, upsampled and corrected.
use super::aniso::{self, Jacobians, Position};
use super::coverage::Factors;
use super::driver::{Inputs, SynthesisRun};
use super::jacobian::{self, IDENTITY};
use super::region::{Planned, Region};
use super::table::Table;
use rayon::prelude::*;

impl<I: Inputs> SynthesisRun<'_, I> {
    pub(super) fn anisometric(&self, tables: &[Table], planned: &[Planned]) -> Result<Vec<Position>, I::Stop> {
        let once = self.counts_once(planned);
        let mut map: Vec<Position> = Vec::new();
        for (k, Planned { region, wanted }) in planned.iter().enumerate() {
            let level = tables.len() - 1 - k;
            let table = &tables[level];
            let finer: Vec<&Table> = tables[..=level].iter().rev().collect();
            let jacobians = match self.bent {
                Some(j) => Jacobians::Constant(j),
                None => self.inputs.jacobians(region)?.unwrap_or(Jacobians::Constant(IDENTITY)),
            };
            let guide = self.inputs.guide(region)?;
            if k == 0 {
                map = self.start(table, region, &guide)?;
            } else {
                let mask = self.shaken(region)?;
                map = self.upsample((&planned[k - 1].wanted, &map), table, (region, &jacobians), mask.as_deref());
            }
            let mut fixed = Vec::new();
            if let Some((is_fixed, positions)) = self.inputs.fixed(region)? {
                let given = map.iter_mut().zip(&is_fixed).zip(positions).filter(|((_, fixed), _)| **fixed);
                given.for_each(|((map, _), at)| *map = at);
                fixed = is_fixed;
            }
            let mut factors = None;
            self.passes((k, planned.len()), once, |count| {
                if count {
                    factors = self.even(region).map(|even| {
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
            region.keep(wanted, &mut map);
        }
        Ok(map)
    }

    pub(super) fn upsample(
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
