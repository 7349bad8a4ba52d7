//! Replaces torn spots: places of a result that still do not occur in the exemplar after the rounds of lookup and vote.
//!
//! The spot and its surroundings are compared with thousands of exemplar positions, and the middle of the best match is
//! pasted over the spot. Spots are so far apart that no two overlap; their selection depends on near pixels only.
use super::patches::Patches;
use super::plane::PixelPlane;
use super::region::Region;
use super::rematch::{Terms, cost, weight};
use super::table::Table;
use super::vote::FoundPatch;
use crate::ground::hash::Hash;
use crate::ground::simd;
use crate::ground::window::index;
use rayon::prelude::*;

/// Reach of the comparison around a spot, in pixels of the level.
const COMPARED: usize = 5;

/// Reach of the pasted square.
const PASTED: i32 = 3;

/// Minimum distance between spots, in columns or in rows.
const APART: i32 = 2 * PASTED + 1;

/// Reach of a replacement: a pixel's spot lies within the pasted square, and other spots suppress it within [`APART`].
pub(super) const READS: i32 = PASTED + APART - 1;

/// Squared difference per pixel, in units of the exemplar's variance, from which a spot is replaced.
const TORN: f32 = 0.2;

/// Maximum number of exemplar positions tried, before the refinement around the best one.
const TRIED: usize = 8192;

/// Side of the compared square in pixels.
const SIDE: usize = 2 * COMPARED + 1;

/// The surroundings of a spot: rows, each padded to a whole number of vectors.
type Shown = [[i16; WIDTH]; SIDE];
const WIDTH: usize = 48;

/// Step between tried exemplar positions, in columns and rows.
fn step(plane: PixelPlane) -> usize {
    (1..).find(|n| (plane.w / n) * (plane.h / n) <= TRIED).unwrap_or(1)
}

/// Replaces the torn spots of a level, given the patches `found`. Returns marks of the replaced pixels.
pub(super) fn replace(
    (table, patches): (&Table, &Patches),
    region: &Region,
    (terms, hash): (&Terms<'_>, Hash),
    found: &[FoundPatch],
    map: &mut [u32],
) -> Vec<bool> {
    let PixelPlane { w, h, wrap } = region.plane;
    let spots = worst(region, found);
    let search = Search { table, patches, region, terms, map, step: step(table.plane), hash: hash.with(0x7370_6F74) };
    let best: Vec<u32> = spots.par_iter().with_min_len(4).map(|p| search.find(*p, found[*p].at)).collect();
    let inside = |k: i32, n: usize, wrap: bool| wrap || (0..index(n)).contains(&k);
    let mut pasted = vec![false; w * h];
    for (&p, &best) in spots.iter().zip(&best) {
        let at = [index(p % w), index(p / w)];
        for dy in -PASTED..=PASTED {
            for dx in -PASTED..=PASTED {
                let [x, y] = [at[0] + dx, at[1] + dy];
                if !inside(x, w, wrap[0]) || !inside(y, h, wrap[1]) {
                    continue;
                }
                let [x, y] = [PixelPlane::bring(x, w, wrap[0]), PixelPlane::bring(y, h, wrap[1])];
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

/// The torn pixels whose patch fits worst among those near.
fn worst(region: &Region, found: &[FoundPatch]) -> Vec<usize> {
    let PixelPlane { w, h, wrap } = region.plane;
    let limit = weight(TORN);
    let worst = |p: usize| {
        let (own, x, y) = (found[p].weight, index(p % w), index(p / w));
        for dy in -APART + 1..APART {
            if !wrap[1] && !(0..index(h)).contains(&(y + dy)) {
                continue;
            }
            let row = PixelPlane::bring(y + dy, h, wrap[1]) * w;
            for dx in -APART + 1..APART {
                if !wrap[0] && !(0..index(w)).contains(&(x + dx)) {
                    continue;
                }
                let other = found[row + PixelPlane::bring(x + dx, w, wrap[0])].weight;
                let first = (dy, dx) < (0, 0);
                if other > 0.0 && (other < own || first && other <= own) {
                    return false;
                }
            }
        }
        true
    };
    let torn = |p: &usize| found[*p].weight > 0.0 && found[*p].weight < limit;
    (0..found.len()).into_par_iter().with_min_len(4096).filter(torn).filter(|p| worst(*p)).collect()
}

/// Searches exemplar positions to paste.
struct Search<'a> {
    table: &'a Table,
    patches: &'a Patches,
    region: &'a Region,
    terms: &'a Terms<'a>,
    map: &'a [u32],
    /// Step between the positions tried first, in columns and rows.
    step: usize,
    hash: Hash,
}

impl Search<'_> {
    /// The exemplar position most like the surroundings of a pixel.
    fn find(&self, p: usize, found: u32) -> u32 {
        let (w, patches) = (self.region.plane.w, self.patches);
        let (x, y) = (p % w, p / w);
        let known = self.terms.known(self.table, (x, y), p, SIDE * SIDE);
        let shown = self.show(x, y);
        let (mut best, mut least) = (found, f32::INFINITY);
        let mut test = simd::inlined(
            #[inline(always)]
            |at: u32, best: &mut u32| {
                let distance = |most| patches.distance::<SIDE, WIDTH>(&shown, at, most);
                let cost = cost((self.table, patches), &known, at, least, distance);
                if cost < least {
                    (*best, least) = (at, cost);
                }
            },
        );
        let PixelPlane { w, h, wrap } = self.table.plane;
        let word = self.hash.with(self.region.name(x, y)).u64(0);
        #[expect(clippy::cast_possible_truncation, reason = "less than a step")]
        let first = [word & 0xFFFF_FFFF, word >> 32].map(|word| (word % self.step as u64) as usize);
        simd::dispatch(
            #[inline(always)]
            || {
                test(found, &mut best);
                for y in (first[1]..h).step_by(self.step) {
                    for x in (first[0]..w).step_by(self.step) {
                        test(patches.at([index(x), index(y)]), &mut best);
                    }
                }
                // Refine between the tried positions.
                let ([x, y], by) = (patches.pixel(best), index(self.step) - 1);
                for (x, y) in (-by..=by).flat_map(|dy| (-by..=by).map(move |dx| (x + dx, y + dy))) {
                    if self.table.holds([x, y]) {
                        let place = [PixelPlane::bring(x, w, wrap[0]), PixelPlane::bring(y, h, wrap[1])];
                        test(patches.at(place.map(index)), &mut best);
                    }
                }
            },
        );
        best
    }

    /// The surroundings of a pixel of the result.
    fn show(&self, x: usize, y: usize) -> Shown {
        let PixelPlane { w, h, wrap } = self.region.plane;
        let reach = index(COMPARED);
        let mut shown = [[0; WIDTH]; SIDE];
        for (k, out) in shown.iter_mut().enumerate() {
            let row = PixelPlane::bring(index(y + k) - reach, h, wrap[1]) * w;
            for k in 0..SIDE {
                let at = self.map[row + PixelPlane::bring(index(x + k) - reach, w, wrap[0])];
                out[4 * k..][..4].copy_from_slice(self.patches.shade(at));
            }
        }
        shown
    }
}
