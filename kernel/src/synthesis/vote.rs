//! The vote over what pixels show, once it is known which part of the exemplar the patches around them are.
use super::patches::{Patches, Shade};
use super::plane::Plane;
use super::region::Region;
use crate::ground::math::exp;
use crate::ground::simd;
use crate::ground::window::{index, offset};
use rayon::prelude::*;

/// How far away patches lie that vote, at the most.
pub(super) const REACH: i32 = 2;

/// How much it counts that a piece of the exemplar is continued, beside that its colour is the mean of all that is said:
/// less makes smaller pieces, more leaves joints where they are.
const TOGETHER: f32 = 0.05;

/// What the patch around a pixel of the result is: which one of the exemplar, and how much that counts; 0 if it was not looked
/// up.
#[derive(Clone, Copy)]
pub(super) struct Found {
    pub(super) at: u32,
    pub(super) weight: f32,
}

/// Lets the patches around every pixel that is `near` a joint, and not `fixed`, say what it shows.
pub(super) fn vote(
    patches: &Patches,
    region: &Region,
    found: &[Found],
    (near, fixed): (&[bool], &[bool]),
    map: &mut [u32],
) {
    let w = region.plane.w;
    let reach = REACH.min(index(patches.reach));
    let square = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y]));
    let around: Vec<([i32; 2], f32)> = square.map(|[x, y]| ([x, y], exp(-((x * x + y * y) as f32) / 8.0))).collect();
    let election = Election { patches, region, found, around: &around, reach: offset(reach) };
    map.par_chunks_mut(w).with_min_len(4).enumerate().for_each(|(y, row)| {
        simd::dispatch(
            #[inline(always)]
            || {
                let mut votes = Vec::new();
                for (x, out) in row.iter_mut().enumerate().filter(|(x, _)| near[y * w + x]) {
                    if !fixed.get(y * w + x).is_some_and(|fixed| *fixed) {
                        *out = election.elect((x, y), *out, &mut votes);
                    }
                }
            },
        );
    });
}

struct Election<'a> {
    patches: &'a Patches,
    region: &'a Region,
    found: &'a [Found],
    around: &'a [([i32; 2], f32)],
    reach: usize,
}

impl Election<'_> {
    #[inline(always)]
    fn elect(&self, (x, y): (usize, usize), own: u32, votes: &mut Vec<(u32, f32)>) -> u32 {
        let Plane { w, h, wrap } = self.region.plane;
        let patches = self.patches;
        let (ix, iy) = (index(x), index(y));
        let inner = x >= self.reach && y >= self.reach && x + self.reach < w && y + self.reach < h;
        let outside = |k: i32, n: usize, wrap: bool| !wrap && !(0..index(n)).contains(&k);
        votes.clear();
        let (mut mean, mut total) = ([0.0f32; 4], 0.0f32);
        for &([dx, dy], bell) in self.around {
            let q = if inner {
                offset(iy + dy) * w + offset(ix + dx)
            } else if outside(ix + dx, w, wrap[0]) || outside(iy + dy, h, wrap[1]) {
                continue;
            } else {
                Plane::bring(iy + dy, h, wrap[1]) * w + Plane::bring(ix + dx, w, wrap[0])
            };
            let weight = self.found[q].weight * bell;
            if weight == 0.0 {
                continue;
            }
            let at = if inner {
                patches.home(self.found[q].at.wrapping_sub(patches.step(dx, dy)))
            } else {
                patches.continued(self.region, [ix, iy], [dx, dy], |q| self.found[q].at)
            };
            if patches.worth(at) == f32::INFINITY {
                continue;
            }
            total += weight;
            mean.iter_mut().zip(patches.shade(at)).for_each(|(mean, v)| *mean += weight * v);
            match votes.iter_mut().find(|vote| vote.0 == at) {
                Some(vote) => vote.1 += weight,
                None => votes.push((at, weight)),
            }
        }
        match votes[..] {
            [] => own,
            [(at, _)] => at,
            _ => self.best(votes, &mean.map(|v| v / total), total),
        }
    }

    /// Of what was said, what is most like the mean of it, and most often said.
    #[inline(always)]
    fn best(&self, votes: &[(u32, f32)], mean: &Shade, total: f32) -> u32 {
        let (mut best, mut least) = (votes[0].0, f32::INFINITY);
        for &(at, weight) in votes {
            let mut cost = TOGETHER * (1.0 - weight / total);
            for (v, mean) in self.patches.shade(at).iter().zip(mean) {
                cost += (v - mean) * (v - mean);
            }
            if cost < least {
                (best, least) = (at, cost);
            }
        }
        best
    }
}
