//! Looks up patches of a result in the exemplar.
//!
//! Candidate patches are continuations of the neighbours, patches that look like those, and random patches around the
//! best one (C. Barnes et al., 2009).
use super::coverage::Factors;
use super::patches::{Patches, SIDE, Shade, ShownPatch};
use super::phase::{self, Phase};
use super::plane::PixelPlane;
use super::region::Region;
use super::table::Table;
use super::vote::{self, FoundPatch};
use crate::ground::hash::Hash;
use crate::ground::math::pow;
use crate::ground::simd;
use crate::ground::window::index;
use rayon::prelude::*;

/// The terms of the cost of a patch.
#[derive(Clone, Copy)]
pub(super) struct Terms<'a> {
    /// Factors for even use.
    pub(super) factors: Option<&'a Factors>,
    /// Target guide values by pixel; empty for none.
    pub(super) guide: &'a [f32],
    /// Weight of `guide`; 1 equals the mean difference of two patches.
    pub(super) guide_weight: f32,
    /// Pixels that must not change; empty for none.
    pub(super) fixed: &'a [bool],
    /// Target lattice phase of each pixel; empty if no phase is kept.
    pub(super) phases: &'a [Phase],
    /// Squared difference per pixel below which a patch is good enough after the first round. The difference is
    /// invisible, and better patches would only make more of the result alike.
    pub(super) enough: f32,
}

impl<'a> Terms<'a> {
    /// Cost terms of pixel (x, y), index `p`, for a patch of `pixels` pixels.
    #[inline(always)]
    pub(super) fn known(&self, table: &Table, (x, y): (usize, usize), p: usize, pixels: usize) -> Known<'a> {
        let whole = 2.0 * pixels as f32;
        let guide = self.guide.get(p).filter(|_| table.has_guide());
        Known {
            factors: self.factors.map(|factors| factors.of(x, y)),
            guide: guide.map(|guide| (*guide, whole * self.guide_weight)),
            phase: self.phases.get(p).map(|phase| (*phase, whole * phase::COST)),
        }
    }
}

/// The adjacent neighbours of a pixel, and those at the rim of its patch.
pub(super) fn ways(patches: &Patches, plane: PixelPlane) -> [Way; 16] {
    let reach = index(patches.reach);
    std::array::from_fn(|k| {
        let by = if k & 1 == 0 { 1 } else { reach };
        let to = NEAR[k / 2].map(|d| d * by);
        let away = (to[1] as isize * plane.w as isize + to[0] as isize).cast_unsigned();
        Way { to, away, step: patches.step(to[0], to[1]) }
    })
}

/// Looks up the patches of a result.
pub(super) struct Search<'a> {
    pub(super) table: &'a Table,
    pub(super) patches: &'a Patches,
    pub(super) region: &'a Region,
    pub(super) terms: &'a Terms<'a>,
    pub(super) hash: Hash,
    pub(super) map: &'a [u32],
    /// Pixels near a joint, whose patch is not a plain part of the exemplar.
    pub(super) near: &'a [bool],
    /// Matches of the previous round; empty in the first.
    pub(super) last: &'a [FoundPatch],
    /// Neighbours whose continuations are tried.
    pub(super) ways: [Way; 16],
}

/// A neighbour: `to` in columns and rows; `away` is the difference of map indices away from the sides; `step` is the
/// difference of exemplar indices.
#[derive(Clone, Copy)]
pub(super) struct Way {
    to: [i32; 2],
    away: usize,
    step: u32,
}

/// Cost terms of a pixel, apart from its patch.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    /// Factors for even use, by bin.
    pub(super) factors: Option<&'a [f32]>,
    /// Target guide value, and the weight of its squared difference.
    pub(super) guide: Option<(f32, f32)>,
    /// Target phase, and the cost of a full phase error.
    pub(super) phase: Option<(Phase, f32)>,
}

/// State of the search for a pixel's best patch.
struct Query<'a> {
    shown: ShownPatch,
    known: Known<'a>,
    best: u32,
    least: f32,
    /// Indices tried so far.
    tried: [u32; 32],
    count: usize,
}

/// The immediate neighbours, by rows.
const NEAR: [[i32; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// Squared difference per pixel that counts as none; and the exponent by which worse matches count less.
const NONE: f32 = 0.003;
const POWER: f32 = -0.6;

/// Weight of a patch with squared difference `fit` per pixel.
#[inline(always)]
pub(super) fn weight(fit: f32) -> f32 {
    pow(fit + NONE, POWER)
}

/// Cost of an exemplar patch: its distance in steps, times the factor for its use, plus the weighted guide and phase
/// errors. `distance` receives the largest distance that matters. Infinite for patches that must not be shown; above
/// `least`, the result may be too small.
#[inline(always)]
pub(super) fn cost(
    (table, patches): (&Table, &Patches),
    known: &Known<'_>,
    at: u32,
    least: f32,
    distance: impl FnOnce(i32) -> i32,
) -> f32 {
    let mut factor = patches.worth(at);
    if factor == f32::INFINITY {
        return factor;
    }
    if let Some(factors) = known.factors {
        factor *= factors[patches.bin(at)];
    }
    let added = known.guide.map_or(0.0, |(wanted, weight)| {
        let off = wanted - table.guide(patches.known(at));
        weight * (off * off)
    });
    let added = added + known.phase.map_or(0.0, |(wanted, weight)| weight * table.off(patches.known(at), wanted));
    #[expect(clippy::cast_possible_truncation, reason = "it saturates")]
    let most = ((least / factor - added) * patches.per_unit()) as i32;
    (distance(most) as f32 * patches.unit() + added) * factor
}

/// Number of random searches.
const SEARCHES: u64 = 2;

impl Search<'_> {
    /// The best patch of each pixel: looked up for `fresh` pixels, else kept, or the shown patch itself.
    pub(super) fn all(&self, fresh: &[bool]) -> Vec<FoundPatch> {
        let w = self.region.plane.w;
        let mut seen: Vec<Shade> = vec![Shade::default(); self.map.len()];
        let shade = |(seen, at): (&mut Shade, &u32)| *seen = *self.patches.shade(*at);
        seen.par_iter_mut().zip(self.map).with_min_len(1024).for_each(shade);
        let sure = weight(0.0);
        let mut found: Vec<FoundPatch> = vec![FoundPatch { at: 0, weight: 0.0 }; self.map.len()];
        found.par_chunks_mut(w).with_min_len(4).enumerate().for_each(|(y, row)| {
            simd::dispatch(
                #[inline(always)]
                || {
                    for (x, out) in row.iter_mut().enumerate() {
                        let p = y * w + x;
                        let skips = self.skips(x, y);
                        *out = if fresh[p] && !skips {
                            if self.patches.reach == 3 {
                                self.find::<7>((x, y), &seen)
                            } else {
                                self.find::<5>((x, y), &seen)
                            }
                        } else if self.near[p] && !self.last.is_empty() {
                            self.last[p]
                        } else {
                            FoundPatch { at: self.map[p], weight: if skips { 0.0 } else { sure } }
                        };
                    }
                },
            );
        });
        found
    }

    /// At the finest level, every second patch of every second row is enough.
    #[inline(always)]
    fn skips(&self, x: usize, y: usize) -> bool {
        let [first, top] = self.region.start;
        vote::sparse(self.region) && ((first + index(x)) | (top + index(y))) & 1 == 1
    }

    /// The patch of the result around a pixel.
    #[inline(always)]
    fn show<const N: usize>(&self, seen: &[Shade], (x, y): (usize, usize)) -> ShownPatch {
        let PixelPlane { w, h, wrap } = self.region.plane;
        let reach = N / 2;
        let mut shown = [[0; 32]; SIDE];
        for (k, out) in shown.iter_mut().enumerate().take(N) {
            let row = &seen[PixelPlane::bring(index(y + k) - index(reach), h, wrap[1]) * w..][..w];
            if x >= reach && x + reach < w {
                out[..4 * N].copy_from_slice(row[x - reach..][..N].as_flattened());
            } else {
                for k in 0..N {
                    out[4 * k..][..4].copy_from_slice(&row[PixelPlane::bring(index(x + k) - index(reach), w, wrap[0])]);
                }
            }
        }
        shown
    }

    /// Finds the exemplar patch most like the patch shown around a pixel.
    #[inline(always)]
    fn find<const N: usize>(&self, (x, y): (usize, usize), seen: &[Shade]) -> FoundPatch {
        let (patches, p) = (self.patches, y * self.region.plane.w + x);
        let own = self.map[p];
        let mut query = Query {
            shown: self.show::<N>(seen, (x, y)),
            known: self.terms.known(self.table, (x, y), p, N * N),
            best: own,
            least: f32::INFINITY,
            tried: [u32::MAX; 32],
            count: 0,
        };
        self.test::<N>(&mut query, own);
        let enough = if self.last.is_empty() { 0.0 } else { self.terms.enough };
        if query.least >= enough * (N * N) as f32 {
            self.neighbours::<N>((x, y), &mut query);
            for from in [query.best, own] {
                for other in self.table.alike(patches.known(from)) {
                    self.test::<N>(&mut query, patches.at(self.table.pixel(other)));
                }
            }
            self.wander::<N>((x, y), &mut query);
        }
        let fit = if query.least < f32::INFINITY { query.least / (N * N) as f32 } else { 1e6 };
        FoundPatch { at: query.best, weight: weight(fit) }
    }

    /// Tries the continuations of the neighbours, and the match of the previous round.
    #[inline(always)]
    fn neighbours<const N: usize>(&self, (x, y): (usize, usize), query: &mut Query<'_>) {
        let (patches, PixelPlane { w, h, .. }, reach) = (self.patches, self.region.plane, N / 2);
        let (p, place) = (y * w + x, [index(x), index(y)]);
        let inner = x >= reach && y >= reach && x + reach < w && y + reach < h;
        for way in &self.ways {
            let at = if inner {
                patches.home(self.map[p.wrapping_add(way.away)].wrapping_sub(way.step))
            } else {
                patches.continued(self.region, place, way.to, |q| self.map[q])
            };
            self.test::<N>(query, at);
        }
        if let Some(last) = self.last.get(p) {
            self.test::<N>(query, last.at);
            for to in [[0, -1], [-1, 0], [1, 0], [0, 1]] {
                self.test::<N>(query, patches.continued(self.region, place, to, |q| self.last[q].at));
            }
        }
    }

    /// Tries a patch unless it was tried before.
    #[inline(always)]
    fn test<const N: usize>(&self, query: &mut Query<'_>, at: u32) {
        if query.tried.iter().fold(false, |tried, other| tried | (*other == at)) {
            return;
        }
        query.tried[query.count & 31] = at;
        query.count += 1;
        let distance = simd::inlined(
            #[inline(always)]
            |most| self.patches.distance::<N, 32>(&query.shown, at, most),
        );
        let cost = cost((self.table, self.patches), &query.known, at, query.least, distance);
        if cost < query.least {
            (query.best, query.least) = (at, cost);
        }
    }

    /// Tries random patches around the best one, with decreasing radius.
    #[inline(always)]
    fn wander<const N: usize>(&self, (x, y): (usize, usize), query: &mut Query<'_>) {
        let PixelPlane { w, h, wrap } = self.table.plane;
        let hash = self.hash.with(self.region.name(x, y));
        let mut radius = index(w.max(h)) / 2;
        for k in 0..SEARCHES {
            let word = hash.u64(k);
            let [bx, by] = self.patches.pixel(query.best);
            let to = [bx + within(word, radius), by + within(word >> 32, radius)];
            if self.table.holds(to) {
                let to = [PixelPlane::bring(to[0], w, wrap[0]), PixelPlane::bring(to[1], h, wrap[1])];
                self.test::<N>(query, self.patches.at(to.map(index)));
            }
            radius = (radius / 2).max(1);
        }
    }
}

/// Maps the lower half of a word to `-radius..=radius`.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the lower half is meant, and the result is below the radius")]
fn within(word: u64, radius: i32) -> i32 {
    let count = u64::from((2 * radius + 1).unsigned_abs());
    ((u64::from(word as u32) * count) >> 32) as i32 - radius
}
