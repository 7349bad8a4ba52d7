//! Replaces the spots of a result that are nowhere in the exemplar: what rounds of looking up and voting leave torn.
//!
//! Such a spot is compared, with what lies around it, with thousands of places of the exemplar, and the middle of the best one
//! is pasted over it. Spots lie so far apart that no two overlap, and which they are depends on what is near only.
use super::patches::{Patches, Shade};
use super::plane::Plane;
use super::region::Region;
use super::rematch::{Terms, weight};
use super::table::Table;
use super::vote::Found;
use crate::ground::hash::Hash;
use crate::ground::simd;
use crate::ground::window::index;
use rayon::prelude::*;

/// How far what is compared and what is pasted reach, in pixels of the level.
const COMPARED: usize = 5;
const PASTED: i32 = 3;

/// Spots are at least this far apart, in columns or in rows.
const APART: i32 = 2 * PASTED + 1;

/// How far away what a pixel shows afterwards depends on what has been found.
pub(super) const READS: i32 = 2 * PASTED + APART;

/// From which squared difference per pixel on, in units of the exemplar's variance, a spot is replaced.
const TORN: f32 = 0.2;

/// How many places of the exemplar are tried at the most, before those beside the best one.
const TRIED: usize = 8192;

const SIDE: usize = 2 * COMPARED + 1;

/// What is shown around a spot: rows of whole vectors.
type Shown = [[i16; 48]; SIDE];

/// The places of an exemplar that are tried.
#[derive(Clone, Copy, Default)]
pub(super) struct Places {
    /// Columns and rows between two of them.
    step: usize,
    /// The exemplar's columns and rows.
    size: [usize; 2],
}

impl Places {
    pub(super) fn new(table: &Table) -> Self {
        let Plane { w, h, .. } = table.plane;
        let step = (1..).find(|n| (w / n) * (h / n) <= TRIED).unwrap_or(1);
        Self { step, size: [w, h] }
    }
}

/// Replaces the spots of a level after it was looked up what pixels show; says which pixels were.
pub(super) fn replace(
    (table, patches, places): (&Table, &Patches, &Places),
    region: &Region,
    terms: &Terms<'_>,
    found: &[Found],
    map: &mut [u32],
) -> Vec<bool> {
    let Plane { w, h, wrap } = region.plane;
    let spots = worst(region, found);
    let search = Search { table, patches, places, region, terms, map, hash: terms.hash.with(0x7370_6F74) };
    let best: Vec<u32> = spots.par_iter().with_min_len(4).map(|p| search.find(*p, found[*p].at)).collect();
    let mut pasted = vec![false; w * h];
    for (&p, &best) in spots.iter().zip(&best) {
        let at = [index(p % w), index(p / w)];
        for dy in -PASTED..=PASTED {
            for dx in -PASTED..=PASTED {
                let [x, y] = [at[0] + dx, at[1] + dy];
                let inside = |k: i32, n: usize, wrap: bool| wrap || (0..index(n)).contains(&k);
                if !inside(x, w, wrap[0]) || !inside(y, h, wrap[1]) {
                    continue;
                }
                let [x, y] = [Plane::bring(x, w, wrap[0]), Plane::bring(y, h, wrap[1])];
                let q = y * w + x;
                if terms.fixed.get(q).is_some_and(|fixed| *fixed) {
                    continue;
                }
                let shows = patches.continued(region, [index(x), index(y)], [-dx, -dy], |_| best);
                if patches.worth(shows) < f32::INFINITY {
                    (map[q], pasted[q]) = (shows, true);
                }
            }
        }
    }
    pasted
}

/// The pixels whose patch fits worst among those near, if it is torn.
fn worst(region: &Region, found: &[Found]) -> Vec<usize> {
    let Plane { w, h, wrap } = region.plane;
    let limit = weight(TORN);
    let worse = |p: usize| {
        let (own, x, y) = (found[p].weight, index(p % w), index(p / w));
        for dy in -APART + 1..APART {
            if !wrap[1] && !(0..index(h)).contains(&(y + dy)) {
                continue;
            }
            let row = Plane::bring(y + dy, h, wrap[1]) * w;
            for dx in -APART + 1..APART {
                if !wrap[0] && !(0..index(w)).contains(&(x + dx)) {
                    continue;
                }
                let other = found[row + Plane::bring(x + dx, w, wrap[0])].weight;
                let first = (dy, dx) < (0, 0);
                if other > 0.0 && (other < own || first && other <= own) {
                    return false;
                }
            }
        }
        true
    };
    let torn = |p: &usize| found[*p].weight > 0.0 && found[*p].weight < limit;
    (0..found.len()).into_par_iter().with_min_len(4096).filter(torn).filter(|p| worse(*p)).collect()
}

struct Search<'a> {
    table: &'a Table,
    patches: &'a Patches,
    places: &'a Places,
    region: &'a Region,
    terms: &'a Terms<'a>,
    map: &'a [u32],
    hash: Hash,
}

impl Search<'_> {
    /// The place of the exemplar that is most like what is shown around a pixel.
    fn find(&self, p: usize, known: u32) -> u32 {
        let (w, patches) = (self.region.plane.w, self.patches);
        let (x, y) = (p % w, p / w);
        let factors = self.terms.factors.map(|factors| factors.of(x, y));
        let wanted = self.terms.guide.get(p).copied().filter(|_| self.table.has_guide());
        let shown = self.show(x, y);
        let shows = (&shown, factors, wanted);
        let (mut best, mut least) = (known, f32::INFINITY);
        let Places { step, size } = *self.places;
        let word = self.hash.with(self.region.name(x, y)).u64(0);
        #[expect(clippy::cast_possible_truncation, reason = "less than a step")]
        let first = [word & 0xFFFF_FFFF, word >> 32].map(|word| (word % step as u64) as usize);
        simd::dispatch(
            #[inline(always)]
            || {
                self.test(shows, known, &mut best, &mut least);
                for y in (first[1]..size[1]).step_by(step) {
                    for x in (first[0]..size[0]).step_by(step) {
                        self.test(shows, patches.at([index(x), index(y)]), &mut best, &mut least);
                    }
                }
            },
        );
        // Between the places that were tried.
        let ([x, y], by) = (patches.pixel(best), index(step) - 1);
        simd::dispatch(
            #[inline(always)]
            || {
                for dy in -by..=by {
                    for dx in -by..=by {
                        if self.table.holds([x + dx, y + dy]) {
                            self.test(shows, patches.home(patches.at([x + dx, y + dy])), &mut best, &mut least);
                        }
                    }
                }
            },
        );
        best
    }

    /// Takes a place if it is more like what is shown than the best one so far.
    #[inline(always)]
    fn test(
        &self,
        (shown, factors, wanted): (&Shown, Option<&[f32]>, Option<f32>),
        at: u32,
        best: &mut u32,
        least: &mut f32,
    ) {
        let patches = self.patches;
        let mut factor = patches.worth(at);
        if factor == f32::INFINITY {
            return;
        }
        if let Some(factors) = factors {
            factor *= factors[patches.bin(at)];
        }
        let added = wanted.map_or(0.0, |wanted| {
            let off = wanted - self.table.guide(patches.known(at));
            2.0 * (SIDE * SIDE) as f32 * self.terms.guide_weight * (off * off)
        });
        #[expect(clippy::cast_possible_truncation, reason = "it saturates")]
        let most = ((*least / factor - added) * patches.per_unit()) as i32;
        let cost = (distance(shown, patches, at, most) as f32 * patches.unit() + added) * factor;
        if cost < *least {
            (*best, *least) = (at, cost);
        }
    }

    fn show(&self, x: usize, y: usize) -> Shown {
        let Plane { w, h, wrap } = self.region.plane;
        let reach = index(COMPARED);
        let mut shown = [[0; 48]; SIDE];
        for (k, out) in shown.iter_mut().enumerate() {
            let row = Plane::bring(index(y + k) - reach, h, wrap[1]) * w;
            for k in 0..SIDE {
                let at = self.map[row + Plane::bring(index(x + k) - reach, w, wrap[0])];
                let shade: &Shade = self.patches.shade(at);
                out[4 * k..][..4].copy_from_slice(shade);
            }
        }
        shown
    }
}

/// The squared distance in steps; of the first rows only where that is above `most`.
#[inline(always)]
fn distance(shown: &Shown, patches: &Patches, at: u32, most: i32) -> i32 {
    let mut sum = 0i32;
    for (k, row) in shown.iter().enumerate() {
        let own = patches.row(at, index(k) - index(COMPARED), COMPARED);
        let mut off = 0i32;
        for ((a, b), mask) in row.iter().zip(own).zip(&MASK) {
            let d = i32::from(a.wrapping_sub(*b) & mask);
            off += d * d;
        }
        sum = sum.saturating_add(off);
        if k & 1 == 1 && sum > most {
            break;
        }
    }
    sum
}

/// Which numbers of a row are compared.
const MASK: [i16; 48] = {
    let mut mask = [0; 48];
    let mut k = 0;
    while k < 4 * SIDE {
        mask[k] = -1;
        k += 1;
    }
    mask
};
