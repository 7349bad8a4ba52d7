//! Mends where pieces meet: what the result shows around every pixel near a joint is looked up in the exemplar, and every
//! pixel then takes, of what the patches around it say of it, what agrees best with all of them.
//!
//! Texture optimisation (V. Kwatra et al., 2005) with a vote that chooses (J. Han et al., 2006): no pixel is ever mixed of
//! others, so the result is as sharp as the exemplar. Patches are searched for among those that neighbours continue, those
//! that look like them, and at random around the best one (C. Barnes et al., 2009). Nothing far away is read, and a pass
//! writes nothing that it reads. Cost: O(pixels near joints · patches tried · pixels of a patch).
use super::coverage::Factors;
use super::patches::{Patches, Shade};
use super::plane::Plane;
use super::region::Region;
use super::table::Table;
use super::texels::Texels;
use super::vote::{self, Found};
use crate::ground::hash::Hash;
use crate::ground::math::pow;
use crate::ground::simd;
use crate::ground::window::index;
use rayon::prelude::*;

/// The coarsest level at which patches are looked up.
const COARSEST: usize = 8;

/// How many rounds there are at the level of spacing `h`, if there are `rounds` at the finest: coarse levels decide where
/// features are, and are cheap.
pub(super) fn rounds(rounds: u32, h: usize) -> u32 {
    match h {
        _ if rounds == 0 || h > COARSEST => 0,
        1 => rounds,
        2 => rounds + 1,
        _ => rounds + 2,
    }
}

/// How far patches of the level of spacing `h` reach, in its pixels.
const fn reach(h: usize) -> usize {
    if h < 8 { 3 } else { 2 }
}

/// How far away a level is read in so many rounds, in its pixels.
pub(super) fn reads(rounds: u32, h: usize) -> i32 {
    let reach = index(reach(h));
    i32::try_from(rounds).unwrap_or(64) * (reach + 1 + reach.min(vote::REACH)) + 1
}

/// What patches are compared by.
pub(super) struct Terms<'a> {
    /// Factors for even use.
    pub(super) factors: Option<&'a Factors>,
    /// Wanted guide values by pixel and their weight, where 1 is as much as a patch differs from any other; empty for none.
    pub(super) guide: &'a [f32],
    /// See `guide`.
    pub(super) guide_weight: f32,
    /// Pixels that stay as they are; empty for none.
    pub(super) fixed: &'a [bool],
    /// Random numbers.
    pub(super) hash: Hash,
}

/// Mends a level in so many rounds: `image` is its picture, `map` holds indices of its tables.
pub(super) fn mend(
    (table, image): (&Table, &Texels<f32>),
    region: &Region,
    terms: &Terms<'_>,
    rounds: u32,
    map: &mut [u32],
) {
    let patches = Patches::new(image, table, reach(table.h));
    map.par_iter_mut().with_min_len(1024).for_each(|at| *at = patches.at(table.pixel(*at)));
    let mut found: Vec<Found> = Vec::new();
    for k in 0..rounds {
        let hash = terms.hash.with(u64::from(k));
        let active = spread(&torn(&patches, region, map), region.plane, index(patches.reach));
        let search = Search { table, patches: &patches, region, terms, hash, map, active: &active, last: &found };
        found = search.all();
        let near = spread(&active, region.plane, vote::REACH.min(index(patches.reach)));
        vote::vote(&patches, region, &found, (&near, terms.fixed), map);
    }
    map.par_iter_mut().with_min_len(1024).for_each(|at| *at = patches.known(*at));
}

/// The pixels that the one to the right or below does not continue.
fn torn(patches: &Patches, region: &Region, map: &[u32]) -> Vec<bool> {
    let Plane { w, h, wrap } = region.plane;
    let (right, down) = (patches.step(1, 0), patches.step(0, 1));
    let goes_on = |at: u32, step: u32, to: u32| patches.home(at.wrapping_add(step)) == to;
    let mut torn = vec![false; w * h];
    torn.par_chunks_mut(w).with_min_len(16).enumerate().for_each(|(y, torn)| {
        let row = &map[y * w..(y + 1) * w];
        let below = if y + 1 < h { Some(y + 1) } else { wrap[1].then_some(0) };
        for (x, torn) in torn.iter_mut().enumerate() {
            let beside = if x + 1 < w { Some(x + 1) } else { wrap[0].then_some(0) };
            *torn = beside.is_some_and(|beside| !goes_on(row[x], right, row[beside]))
                || below.is_some_and(|below| !goes_on(row[x], down, map[below * w + x]));
        }
    });
    torn
}

/// Whether anything is marked at most `r` columns and rows away.
fn spread(marked: &[bool], plane: Plane, r: i32) -> Vec<bool> {
    let Plane { w, h, wrap } = plane;
    let mut rows = vec![false; w * h];
    rows.par_chunks_mut(w).zip(marked.par_chunks(w)).with_min_len(16).for_each(|(out, row)| {
        for x in (0..w).filter(|x| row[*x]) {
            for k in index(x) - r..=index(x) + r {
                if wrap[0] || (0..index(w)).contains(&k) {
                    out[Plane::bring(k, w, wrap[0])] = true;
                }
            }
        }
    });
    let mut out = vec![false; w * h];
    out.par_chunks_mut(w).with_min_len(16).enumerate().for_each(|(y, out)| {
        for k in index(y) - r..=index(y) + r {
            if wrap[1] || (0..index(h)).contains(&k) {
                let from = Plane::bring(k, h, wrap[1]) * w;
                out.iter_mut().zip(&rows[from..from + w]).for_each(|(out, marked)| *out |= marked);
            }
        }
    });
    out
}

/// Looks up what the result shows.
struct Search<'a> {
    table: &'a Table,
    patches: &'a Patches,
    region: &'a Region,
    terms: &'a Terms<'a>,
    hash: Hash,
    map: &'a [u32],
    /// The pixels whose patch is not simply a part of the exemplar.
    active: &'a [bool],
    /// What was found in the round before; empty in the first.
    last: &'a [Found],
}

/// The best patch so far.
struct Best {
    at: u32,
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

/// How many patches are tried at random.
const SEARCHES: u64 = 2;

impl Search<'_> {
    fn all(&self) -> Vec<Found> {
        let w = self.region.plane.w;
        let seen: Vec<Shade> = self.map.iter().map(|&at| *self.patches.shade(at)).collect();
        let sure = pow(NONE, POWER);
        let mut found: Vec<Found> = self.map.iter().map(|&at| Found { at, weight: sure }).collect();
        found.par_chunks_mut(w).with_min_len(4).enumerate().for_each(|(y, row)| {
            simd::dispatch(
                #[inline(always)]
                || {
                    let mut shown = Vec::new();
                    for (x, out) in row.iter_mut().enumerate().filter(|(x, _)| self.active[y * w + x]) {
                        if self.skips(x, y) {
                            out.weight = 0.0;
                            continue;
                        }
                        self.show(&seen, (x, y), &mut shown);
                        *out = self.find((x, y), &shown);
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
        self.region.h == 1 && ((first + index(x)) & 1 == 1 || (top + index(y)) & 1 == 1)
    }

    /// What the result shows around a pixel.
    #[inline(always)]
    fn show(&self, seen: &[Shade], (x, y): (usize, usize), shown: &mut Vec<Shade>) {
        let Plane { w, h, wrap } = self.region.plane;
        let reach = self.patches.reach;
        let r = index(reach);
        shown.clear();
        for dy in -r..=r {
            let row = &seen[Plane::bring(index(y) + dy, h, wrap[1]) * w..][..w];
            if x >= reach && x + reach < w {
                shown.extend_from_slice(&row[x - reach..=x + reach]);
            } else {
                shown.extend((-r..=r).map(|dx| row[Plane::bring(index(x) + dx, w, wrap[0])]));
            }
        }
    }

    /// The patch of the exemplar that is most like what is shown around a pixel.
    #[inline(always)]
    fn find(&self, (x, y): (usize, usize), shown: &[Shade]) -> Found {
        let (patches, plane) = (self.patches, self.region.plane);
        let (p, place, r) = (y * plane.w + x, [index(x), index(y)], index(patches.reach));
        let own = self.map[p];
        let factors = self.terms.factors.map(|factors| factors.of(x, y));
        let guide = self.terms.guide.get(p).copied().filter(|_| self.table.has_guide());
        let weight = 2.0 * shown.len() as f32 * self.terms.guide_weight;
        let mut best = Best { at: own, least: f32::INFINITY, tried: [u32::MAX; 32], count: 0 };
        let test = simd::inlined(
            #[inline(always)]
            |best: &mut Best, at: u32| {
                let mut factor = patches.worth(at);
                if factor == f32::INFINITY || best.tried[..best.count].contains(&at) {
                    return;
                }
                if best.count < best.tried.len() {
                    best.tried[best.count] = at;
                    best.count += 1;
                }
                if let Some(factors) = factors {
                    factor *= factors[self.table.bin_at(patches.known(at))];
                }
                let off = guide.map_or(0.0, |guide| guide - self.table.guide(patches.known(at)));
                let added = weight * (off * off);
                let cost = (patches.distance(shown, at, best.least / factor - added) + added) * factor;
                if cost < best.least {
                    (best.at, best.least) = (at, cost);
                }
            },
        );
        test(&mut best, own);
        for [dx, dy] in NEAR {
            test(&mut best, patches.continued(self.region, place, [dx, dy], |q| self.map[q]));
            test(&mut best, patches.continued(self.region, place, [dx * r, dy * r], |q| self.map[q]));
            if !self.last.is_empty() && (dx == 0 || dy == 0) {
                test(&mut best, patches.continued(self.region, place, [dx, dy], |q| self.last[q].at));
            }
        }
        if let Some(last) = self.last.get(p) {
            test(&mut best, last.at);
        }
        for from in [best.at, own] {
            for other in self.table.alike(patches.known(from)) {
                test(&mut best, patches.at(self.table.pixel(other)));
            }
        }
        self.wander((x, y), &mut best, test);
        let fit = if best.least < f32::INFINITY { best.least / shown.len() as f32 } else { 1e6 };
        Found { at: best.at, weight: pow(fit + NONE, POWER) }
    }

    /// Tries patches at random around the best one, nearer each time.
    #[inline(always)]
    fn wander(&self, (x, y): (usize, usize), best: &mut Best, test: impl Fn(&mut Best, u32)) {
        let Plane { w, h, wrap } = self.table.plane;
        let hash = self.hash.with(self.region.name(x, y));
        let mut radius = index(w.max(h)) / 2;
        for k in 0..SEARCHES {
            let word = hash.u64(k);
            let [bx, by] = self.patches.pixel(best.at);
            let to = [bx + within(word, radius), by + within(word >> 32, radius)];
            if self.table.holds(to) {
                let to = [Plane::bring(to[0], w, wrap[0]), Plane::bring(to[1], h, wrap[1])];
                test(best, self.patches.at(to.map(index)));
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
