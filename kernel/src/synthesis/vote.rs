//! Votes on the pixels of a result: each patch found in the exemplar proposes values for the pixels that it covers.
use super::patches::Patches;
use super::plane::PixelPlane;
use super::region::Region;
use crate::ground::math::exp;
use crate::ground::simd;
use crate::ground::window::{index, offset};
use rayon::prelude::*;

/// Maximum distance of the patches that vote.
pub(super) const REACH: i32 = 2;

/// Weight of continuing a piece of the exemplar, relative to matching the mean colour of the votes. Lower values make
/// smaller pieces, higher ones leave joints in place.
const TOGETHER: f32 = 0.05;

/// The exemplar patch found for a pixel of the result, and the weight of its votes; 0 if none was looked up.
#[derive(Clone, Copy)]
pub(super) struct FoundPatch {
    pub(super) at: u32,
    pub(super) weight: f32,
}

/// Returns whether only every second patch of every second row of a region is looked up: at the finest level this is
/// enough.
pub(super) fn sparse(region: &Region) -> bool {
    region.h == 1
}

/// Replaces every pixel that is `near` a joint and not `fixed` by the vote of the patches around it.
pub(super) fn vote(
    patches: &Patches,
    region: &Region,
    found: &[FoundPatch],
    (near, fixed): (&[bool], &[bool]),
    map: &mut [u32],
) {
    let w = region.plane.w;
    let reach = REACH.min(index(patches.reach));
    let square: Vec<[i32; 2]> = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y])).collect();
    let around = |to: [i32; 2]| Around {
        to,
        away: (to[1] as isize * w as isize + to[0] as isize).cast_unsigned(),
        step: patches.step(to[0], to[1]),
        bell: exp(-((to[0] * to[0] + to[1] * to[1]) as f32) / 8.0),
    };
    // At the finest level only every second patch of every second row was looked up.
    let lists = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|odd: [i32; 2]| {
        let votes = |to: &[i32; 2]| !sparse(region) || [0, 1].iter().all(|&d| (to[d] + odd[d]) & 1 == 0);
        square.iter().filter(|to| votes(to)).map(|to| around(*to)).collect()
    });
    let all: Vec<Around> = square.iter().map(|to| around(*to)).collect();
    let election = Election { patches, region, found, lists: &lists, square: &all, reach: offset(reach) };
    map.par_chunks_mut(w).with_min_len(4).enumerate().for_each(|(y, row)| {
        simd::dispatch(
            #[inline(always)]
            || {
                for (x, out) in row.iter_mut().enumerate().filter(|(x, _)| near[y * w + x]) {
                    if !fixed.get(y * w + x).is_some_and(|fixed| *fixed) {
                        *out = election.elect((x, y), *out);
                    }
                }
            },
        );
    });
}

struct Election<'a> {
    patches: &'a Patches,
    region: &'a Region,
    found: &'a [FoundPatch],
    /// The voting patches for pixels in even and odd columns of even rows, then of odd rows.
    lists: &'a [Vec<Around>; 4],
    /// All patches within reach.
    square: &'a [Around],
    reach: usize,
}

/// A voting patch: `to` in columns and rows; `away` is the difference of map indices away from the sides; `step` is the
/// difference of exemplar indices; `bell` is the weight by distance.
struct Around {
    to: [i32; 2],
    away: usize,
    step: u32,
    bell: f32,
}

/// Proposed exemplar pixels, and the sum of their weights.
type Votes = [(u32, f32); 25];

impl Election<'_> {
    #[inline(always)]
    fn elect(&self, (x, y): (usize, usize), own: u32) -> u32 {
        let PixelPlane { w, h, .. } = self.region.plane;
        let inner = x >= self.reach && y >= self.reach && x + self.reach < w && y + self.reach < h;
        let [first, top] = self.region.start;
        let list = &self.lists[offset(((first + index(x)) & 1) + 2 * ((top + index(y)) & 1))];
        let mut votes: Votes = [(0, 0.0); 25];
        let (count, total) = if inner {
            let said = |around: &Around| self.found[(y * w + x).wrapping_add(around.away)].at.wrapping_sub(around.step);
            let at = said(&list[0]);
            if list.iter().fold(true, |same, around| same & (said(around) == at)) {
                let at = self.patches.home(at);
                return if self.patches.worth(at) == f32::INFINITY { own } else { at };
            }
            self.inner(y * w + x, list, &mut votes)
        } else {
            self.border([index(x), index(y)], &mut votes)
        };
        match &votes[..count] {
            [] => own,
            [(at, _)] => *at,
            votes => self.best(votes, total),
        }
    }

    /// Collects the votes of a pixel away from the sides, where no patch is missing.
    #[inline(always)]
    fn inner(&self, p: usize, list: &[Around], votes: &mut Votes) -> (usize, f32) {
        let (mut count, mut total, mut last) = (0, 0.0, 0);
        for around in list {
            let found = &self.found[p.wrapping_add(around.away)];
            let at = self.patches.home(found.at.wrapping_sub(around.step));
            self.add((at, found.weight * around.bell), votes, &mut count, &mut total, &mut last);
        }
        (count, total)
    }

    #[cold]
    #[inline(never)]
    fn border(&self, [x, y]: [i32; 2], votes: &mut Votes) -> (usize, f32) {
        let PixelPlane { w, h, wrap } = self.region.plane;
        let outside = |k: i32, n: usize, wrap: bool| !wrap && !(0..index(n)).contains(&k);
        let (mut count, mut total, mut last) = (0, 0.0, 0);
        for &Around { to: [dx, dy], bell, .. } in self.square {
            if outside(x + dx, w, wrap[0]) || outside(y + dy, h, wrap[1]) {
                continue;
            }
            let weight = self.found[PixelPlane::bring(y + dy, h, wrap[1]) * w + PixelPlane::bring(x + dx, w, wrap[0])]
                .weight
                * bell;
            if weight > 0.0 {
                let at = self.patches.continued(self.region, [x, y], [dx, dy], |q| self.found[q].at);
                self.add((at, weight), votes, &mut count, &mut total, &mut last);
            }
        }
        (count, total)
    }

    #[inline(always)]
    fn add(&self, (at, weight): (u32, f32), votes: &mut Votes, count: &mut usize, total: &mut f32, last: &mut usize) {
        if *count > 0 && votes[*last].0 == at {
            votes[*last].1 += weight;
        } else if let Some(k) = votes[..*count].iter().position(|vote| vote.0 == at) {
            votes[k].1 += weight;
            *last = k;
        } else if self.patches.worth(at) == f32::INFINITY {
            return;
        } else {
            votes[*count] = (at, weight);
            *last = *count;
            *count += 1;
        }
        *total += weight;
    }

    /// The vote closest to the weighted mean; frequent votes are preferred.
    #[inline(always)]
    fn best(&self, votes: &[(u32, f32)], total: f32) -> u32 {
        let (scale, unit) = (1.0 / total, self.patches.unit());
        let mut mean = [0.0f32; 4];
        for &(at, weight) in votes {
            mean.iter_mut().zip(self.patches.shade(at)).for_each(|(mean, v)| *mean += weight * f32::from(*v));
        }
        let mean = mean.map(|v| v * scale);
        let (mut best, mut least) = (votes[0].0, f32::INFINITY);
        for &(at, weight) in votes {
            let mut off = [0.0f32; 4];
            for ((off, v), mean) in off.iter_mut().zip(self.patches.shade(at)).zip(&mean) {
                let d = f32::from(*v) - mean;
                *off = d * d;
            }
            let cost = TOGETHER * (1.0 - weight * scale) + unit * ((off[0] + off[2]) + (off[1] + off[3]));
            if cost < least {
                (best, least) = (at, cost);
            }
        }
        best
    }
}
