//! Looks up what a result shows around its pixels in the exemplar.
//!
//! Patches are searched for among those that neighbours continue, those that look like them, and at random around the best
//! one (C. Barnes et al., 2009).
use super::coverage::Factors;
use super::patches::{Patches, SIDE, Shade, Shown};
use super::phase::{self, Phase};
use super::plane::Plane;
use super::region::Region;
use super::table::Table;
use super::vote::{self, Found};
use crate::ground::hash::Hash;
use crate::ground::math::pow;
use crate::ground::simd;
use crate::ground::window::index;
use rayon::prelude::*;

/// What patches are compared by.
#[derive(Clone, Copy)]
pub(super) struct Terms<'a> {
    /// Factors for even use.
    pub(super) factors: Option<&'a Factors>,
    /// Wanted guide values by pixel and their weight, where 1 is as much as a patch differs from any other; empty for none.
    pub(super) guide: &'a [f32],
    /// See `guide`.
    pub(super) guide_weight: f32,
    /// Pixels that stay as they are; empty for none.
    pub(super) fixed: &'a [bool],
    /// Where in a cell of the lattice what is shown should lie; empty where nothing is kept in step.
    pub(super) phases: &'a [Phase],
    /// The squared difference per pixel below which a patch is good enough after the first round: nobody sees it, and a
    /// better one would only make more of the result alike.
    pub(super) enough: f32,
}

impl<'a> Terms<'a> {
    /// What is known of pixel (x, y), number `p`, whose patch has so many pixels.
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

/// The neighbours of a pixel that are next to it, and those at the rim of its patch.
pub(super) fn ways(patches: &Patches, plane: Plane) -> [Way; 16] {
    let reach = index(patches.reach);
    std::array::from_fn(|k| {
        let by = if k & 1 == 0 { 1 } else { reach };
        let to = NEAR[k / 2].map(|d| d * by);
        let away = (to[1] as isize * plane.w as isize + to[0] as isize).cast_unsigned();
        Way { to, away, step: patches.step(to[0], to[1]) }
    })
}

/// Looks up what the result shows.
pub(super) struct Search<'a> {
    pub(super) table: &'a Table,
    pub(super) patches: &'a Patches,
    pub(super) region: &'a Region,
    pub(super) terms: &'a Terms<'a>,
    pub(super) hash: Hash,
    pub(super) map: &'a [u32],
    /// The pixels whose patch is not simply a part of the exemplar.
    pub(super) near: &'a [bool],
    /// What was found in the round before; empty in the first.
    pub(super) last: &'a [Found],
    /// The neighbours that may be continued.
    pub(super) ways: [Way; 16],
}

/// A neighbour: how many columns and rows away, what is added to the index of a pixel to get to it where no side is near,
/// and what its index in the exemplar is more by.
#[derive(Clone, Copy)]
pub(super) struct Way {
    to: [i32; 2],
    away: usize,
    step: u32,
}

/// What is known of a pixel besides what it shows.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    /// The factors for even use, by bin.
    pub(super) factors: Option<&'a [f32]>,
    /// The wanted guide value and the weight of its squared difference.
    pub(super) guide: Option<(f32, f32)>,
    /// The wanted phase, and what it costs to be out of step altogether.
    pub(super) phase: Option<(Phase, f32)>,
}

/// A pixel for which the best patch is looked for.
struct Query<'a> {
    shown: Shown,
    known: Known<'a>,
    best: u32,
    least: f32,
    /// What has been tried.
    tried: [u32; 32],
    count: usize,
}

/// The immediate neighbours, by rows.
const NEAR: [[i32; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// The squared difference per pixel that counts as none, and by which power patches that fit less count less.
const NONE: f32 = 0.003;
const POWER: f32 = -0.6;

/// How much a patch counts that differs by `fit` per pixel.
#[inline(always)]
pub(super) fn weight(fit: f32) -> f32 {
    pow(fit + NONE, POWER)
}

/// The cost of a patch of the exemplar: its distance in steps, which is asked for with the most that matters, multiplied by what is known of
/// its use, and what its guide value is off the wanted one, with a weight. Infinite where nothing may be shown; too much if it is above `least`.
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

/// How many patches are tried at random.
const SEARCHES: u64 = 2;

impl Search<'_> {
    /// What the patches around all pixels are: looked up where that is `fresh`, else as it was, or what the result shows.
    pub(super) fn all(&self, fresh: &[bool]) -> Vec<Found> {
        let w = self.region.plane.w;
        let mut seen: Vec<Shade> = vec![Shade::default(); self.map.len()];
        let shade = |(seen, at): (&mut Shade, &u32)| *seen = *self.patches.shade(*at);
        seen.par_iter_mut().zip(self.map).with_min_len(1024).for_each(shade);
        let sure = weight(0.0);
        let mut found: Vec<Found> = vec![Found { at: 0, weight: 0.0 }; self.map.len()];
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
                            Found { at: self.map[p], weight: if skips { 0.0 } else { sure } }
                        };
                    }
                },
            );
        });
        found
    }

    /// At the finest level every second patch of every second row is enough for all pixels.
    #[inline(always)]
    fn skips(&self, x: usize, y: usize) -> bool {
        let [first, top] = self.region.start;
        vote::sparse(self.region) && ((first + index(x)) | (top + index(y))) & 1 == 1
    }

    /// What the result shows around a pixel.
    #[inline(always)]
    fn show<const N: usize>(&self, seen: &[Shade], (x, y): (usize, usize)) -> Shown {
        let Plane { w, h, wrap } = self.region.plane;
        let reach = N / 2;
        let mut shown = [[0; 32]; SIDE];
        for (k, out) in shown.iter_mut().enumerate().take(N) {
            let row = &seen[Plane::bring(index(y + k) - index(reach), h, wrap[1]) * w..][..w];
            if x >= reach && x + reach < w {
                out[..4 * N].copy_from_slice(row[x - reach..][..N].as_flattened());
            } else {
                for k in 0..N {
                    out[4 * k..][..4].copy_from_slice(&row[Plane::bring(index(x + k) - index(reach), w, wrap[0])]);
                }
            }
        }
        shown
    }

    /// The patch of the exemplar that is most like what is shown around a pixel.
    #[inline(always)]
    fn find<const N: usize>(&self, (x, y): (usize, usize), seen: &[Shade]) -> Found {
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
        Found { at: query.best, weight: weight(fit) }
    }

    /// Tries what continues the neighbours of a pixel, and what was found there in the round before.
    #[inline(always)]
    fn neighbours<const N: usize>(&self, (x, y): (usize, usize), query: &mut Query<'_>) {
        let (patches, Plane { w, h, .. }, reach) = (self.patches, self.region.plane, N / 2);
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

    /// Tries a patch, if it has not been tried.
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

    /// Tries patches at random around the best one, nearer each time.
    #[inline(always)]
    fn wander<const N: usize>(&self, (x, y): (usize, usize), query: &mut Query<'_>) {
        let Plane { w, h, wrap } = self.table.plane;
        let hash = self.hash.with(self.region.name(x, y));
        let mut radius = index(w.max(h)) / 2;
        for k in 0..SEARCHES {
            let word = hash.u64(k);
            let [bx, by] = self.patches.pixel(query.best);
            let to = [bx + within(word, radius), by + within(word >> 32, radius)];
            if self.table.holds(to) {
                let to = [Plane::bring(to[0], w, wrap[0]), Plane::bring(to[1], h, wrap[1])];
                self.test::<N>(query, self.patches.at(to.map(index)));
            }
            radius = (radius / 2).max(1);
        }
    }
}

/// A number from -`radius` to `radius` from the lower half of a word.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the lower half is meant, and the result is below the radius")]
fn within(word: u64, radius: i32) -> i32 {
    let count = u64::from((2 * radius + 1).unsigned_abs());
    ((u64::from(word as u32) * count) >> 32) as i32 - radius
}
