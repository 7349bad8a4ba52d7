//! The stages as in the source, on real coordinates: upsample (3), jitter, neighbourhood (1), (2), candidates, correct.
//! Generic over [`Real`] so that the tests run the shipped code in double precision.
//!
//! Compares any features: colours, as in the source, or appearance vectors; with or without candidate sets.
use super::jacobian::{self, OCTANTS};
use super::plane::{Lookup, Neighbours, PixelPlane};
use super::texels::{Fetch, Texels, floor};
use crate::ground::hash::Hash;
use crate::ground::real::Real;
use crate::ground::window::index;
use rayon::prelude::*;

/// A level of the exemplar.
pub struct Features<'a, T> {
    /// The compared features, on the grid of the finest level or on a coarser one.
    pub texels: &'a Texels<T>,
    /// Finest pixels per pixel of `texels`: 1 for a stack, `h` for a pyramid.
    pub ratio: T,
    /// Indices of pixels that look alike: first one candidate per finest pixel, then a second one per pixel, and so on;
    /// empty for none.
    pub second: &'a [u32],
    /// The finest grid, for `second`.
    pub plane: PixelPlane,
}

/// Settings of a correction.
#[derive(Clone, Copy, Debug)]
pub struct CorrectionRule<T> {
    /// Neighbourhood: 4 for the diagonal offsets, else the side of a square (3 or 5), in pixels of the level.
    pub square: u8,
    /// True if three predictions are averaged per Δ.
    pub averaged: bool,
    /// Filter for reading features.
    pub fetch: Fetch,
    /// Spacing of the level in finest pixels.
    pub h: T,
    /// Cost factor of candidates that look alike, compared with coherent ones.
    pub kappa: T,
    /// Number of interleaved groups in which pixels are corrected, a square number: 1 reads only the old map.
    pub sub_passes: u32,
}

/// Offsets of a neighbourhood: 4 diagonal ones, or a square of side 3 or 5 with its middle, by rows.
pub fn offsets(square: u8) -> Vec<[i32; 2]> {
    let all = |r: i32| (-r..=r).flat_map(move |y| (-r..=r).map(move |x| [x, y])).collect();
    match square {
        3 => all(1),
        5 => all(2),
        _ => vec![[-1, -1], [1, -1], [-1, 1], [1, 1]],
    }
}

/// Octants (see [`OCTANTS`]) of the eight neighbours, by rows.
const NEAR: [usize; 8] = [5, 6, 7, 4, 0, 3, 2, 1];

/// `J v` in any precision.
fn apply<T: Real>(j: &[T; 4], v: [T; 2]) -> [T; 2] {
    [j[0] * v[0] + j[1] * v[1], j[2] * v[0] + j[3] * v[1]]
}

fn real<T: Real>(v: [i32; 2]) -> [T; 2] {
    v.map(|v| T::of(f64::from(v)))
}

/// The octant (see [`OCTANTS`]) nearest to the direction of `J⁻¹Δ` (2).
fn toward<T: Real>(j: &[T; 4], delta: [i32; 2]) -> usize {
    let j = j.map(Real::wide);
    let [x, y] = delta.map(f64::from);
    let sign = if j[0] * j[3] - j[1] * j[2] < 0.0 { -1.0 } else { 1.0 };
    jacobian::octant((j[3] * x - j[1] * y) * sign, (j[0] * y - j[2] * x) * sign)
}

/// Upsamples to twice as many columns and rows: child = parent + h J Δ (3), with Δ = ±½.
pub fn upsample<T: Real>(
    parent: &[[T; 2]],
    plane: PixelPlane,
    h: T,
    j: impl Fn(usize, usize) -> [T; 4],
) -> Vec<[T; 2]> {
    let mut out = Vec::with_capacity(4 * parent.len());
    for y in 0..2 * plane.h {
        for x in 0..2 * plane.w {
            let half = |k: usize| if k.is_multiple_of(2) { -T::HALF } else { T::HALF };
            let step = apply(&j(x, y), [half(x) * h, half(y) * h]);
            let from = parent[(y / 2) * plane.w + x / 2];
            out.push([from[0] + step[0], from[1] + step[1]]);
        }
    }
    out
}

/// Moves each position at random by at most `reach` finest pixels, scaled by `mask` (empty for 1).
pub fn jitter<T: Real>(map: &mut [[T; 2]], reach: T, mask: &[f32], hash: Hash) {
    for (p, at) in map.iter_mut().enumerate() {
        let scale = reach * T::of(f64::from(mask.get(p).copied().unwrap_or(1.0)));
        for (d, v) in at.iter_mut().enumerate() {
            *v += scale * T::of(hash.unit(2 * p as u64 + d as u64) * 2.0 - 1.0);
        }
    }
}

/// Corrects a map against one level of the exemplar.
pub struct Corrector<'a, T, L, J> {
    /// The level of the exemplar.
    pub features: &'a Features<'a, T>,
    /// Settings.
    pub rule: &'a CorrectionRule<T>,
    /// Finds neighbours.
    pub lookup: &'a L,
    /// The Jacobian of a pixel.
    pub jacobian: J,
}

impl<T: Real, L: Neighbours, J: Fn(usize) -> [T; 4] + Sync> Corrector<'_, T, L, J> {
    fn read(&self, at: [T; 2], weight: T, out: &mut [T]) {
        let r = self.features.ratio;
        self.features.texels.add([at[0] / r, at[1] / r], self.rule.fetch, weight, out);
    }

    /// Position of the pixel as predicted by its neighbour in `octant`; the pixel's own position if it has no such
    /// neighbour.
    fn predicted(&self, map: &[[T; 2]], (x, y): (i32, i32), octant: usize, j: &[T; 4]) -> [T; 2] {
        let Some((near, residue)) = self.lookup.near((x, y), octant) else { return map[self.lookup.index(x, y)] };
        let mut at = map[near];
        if residue != [0.0; 2] {
            // The target lies beside the centre of the neighbour by a residue.
            let off = apply(&(self.jacobian)(near), residue.map(|v| T::of(f64::from(v))));
            at = [at[0] + self.rule.h * off[0], at[1] + self.rule.h * off[1]];
        }
        let step = apply(j, real(OCTANTS[octant]));
        [at[0] - self.rule.h * step[0], at[1] - self.rule.h * step[1]]
    }

    /// Octants in the order in which they are tried: by rows. On charts, by rows of the exemplar, so that the
    /// orientation of a chart decides no tie; octants missed by the first eight follow.
    fn tried(j: &[T; 4]) -> impl Iterator<Item = usize> {
        let first = if L::CHARTS { NEAR.map(|k| toward(j, OCTANTS[k])) } else { NEAR };
        let turn = if toward(j, OCTANTS[2]) == (toward(j, OCTANTS[0]) + 2) & 7 { 1 } else { 7 };
        let rest = (0..8).map(move |k| (first[0] + k * turn) & 7).filter(move |k| !first.contains(k));
        first.into_iter().chain(rest)
    }

    /// The features that the output shows at every offset around pixel (x, y) (1), concatenated.
    pub fn neighbourhood(&self, map: &[[T; 2]], (x, y): (i32, i32)) -> Vec<T> {
        let j = (self.jacobian)(self.lookup.index(x, y));
        let channels = self.features.texels.channels;
        let deltas = offsets(self.rule.square);
        let mut out = vec![T::default(); deltas.len() * channels];
        for (delta, out) in deltas.into_iter().zip(out.chunks_exact_mut(channels)) {
            let parts = [delta, [delta[0], 0], [0, delta[1]]];
            let used = if self.rule.averaged { 3 } else { 1 };
            let seen: Vec<[i32; 2]> = parts[..used].iter().copied().filter(|m| *m != [0, 0]).collect();
            let weight = T::ONE / T::of(seen.len().max(1) as f64);
            let ahead = real::<T>(delta).map(|d| self.rule.h * d);
            if seen.is_empty() {
                self.read(map[self.lookup.index(x, y)], T::ONE, out);
            }
            for part in seen {
                let at = self.predicted(map, (x, y), toward(&j, part), &j);
                self.read([at[0] + ahead[0], at[1] + ahead[1]], weight, out);
            }
        }
        out
    }

    /// The pixel's own position and the predictions of its neighbours, by rows.
    pub fn candidates(&self, map: &[[T; 2]], (x, y): (i32, i32)) -> Vec<[T; 2]> {
        let own = self.lookup.index(x, y);
        let j = (self.jacobian)(own);
        let near = NEAR.iter().map(|octant| self.predicted(map, (x, y), *octant, &j));
        std::iter::once(map[own]).chain(near).collect()
    }

    /// Sum of squared differences between a neighbourhood and the exemplar around `at`; infinite beyond the exemplar.
    pub fn error(&self, wanted: &[T], at: [T; 2]) -> T {
        let PixelPlane { w, h, wrap } = self.features.plane;
        let channels = self.features.texels.channels;
        let mut seen = vec![T::default(); channels];
        let mut sum = T::default();
        for (delta, wanted) in offsets(self.rule.square).into_iter().zip(wanted.chunks_exact(channels)) {
            let delta = real::<T>(delta);
            let place = [at[0] + self.rule.h * delta[0], at[1] + self.rule.h * delta[1]];
            let inside = |v: T, n: usize, wrap: bool| wrap || (0..index(n)).contains(&floor(v));
            if !inside(place[0], w, wrap[0]) || !inside(place[1], h, wrap[1]) {
                return T::of(f64::INFINITY);
            }
            seen.fill(T::default());
            self.read(place, T::ONE, &mut seen);
            for (seen, wanted) in seen.iter().zip(wanted) {
                let off = *seen - *wanted;
                sum += off * off;
            }
        }
        sum
    }

    /// Best position of pixel (x, y); `more` holds further candidates, tried last.
    pub fn best(&self, map: &[[T; 2]], at: (i32, i32), more: &[[T; 2]]) -> [T; 2] {
        let wanted = self.neighbourhood(map, at);
        let own = self.lookup.index(at.0, at.1);
        let j = (self.jacobian)(own);
        let near = Self::tried(&j).map(|octant| self.predicted(map, at, octant, &j));
        let candidates = std::iter::once(map[own]).chain(near).chain(more.iter().copied());
        let mut best = map[own];
        let mut least = T::of(f64::INFINITY);
        for u in candidates {
            let error = self.error(&wanted, u);
            if error < least {
                (best, least) = (u, error);
            }
            for second in self.alike(u) {
                let error = self.rule.kappa * self.error(&wanted, second);
                if error < least {
                    (best, least) = (second, error);
                }
            }
        }
        best
    }

    fn alike(&self, u: [T; 2]) -> impl Iterator<Item = [T; 2]> {
        let cell = u.map(floor);
        let plane = self.features.plane;
        self.features.second.chunks_exact(plane.w * plane.h).map(move |others| {
            let at = others[plane.index(cell[0], cell[1])] as usize;
            let to = [at % plane.w, at / plane.w];
            [0, 1].map(|d| T::of(to[d] as f64) + (u[d] - T::of(f64::from(cell[d]))))
        })
    }

    /// Runs one pass over all pixels of a map.
    pub fn pass(&self, plane: PixelPlane, more: &[[T; 2]], map: &mut [[T; 2]]) {
        let side = (1..=16).find(|s| s * s >= self.rule.sub_passes as usize).unwrap_or(16);
        for (gy, gx) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let old = &map[..];
            let rows: Vec<Vec<[T; 2]>> = (gy..plane.h)
                .step_by(side)
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(|y| {
                    let one = |x: usize| match self.lookup.holds(y * plane.w + x) {
                        true => self.best(old, (index(x), index(y)), more),
                        false => old[y * plane.w + x],
                    };
                    (gx..plane.w).step_by(side).map(one).collect()
                })
                .collect();
            for (y, row) in (gy..plane.h).step_by(side).zip(rows) {
                for (x, fresh) in (gx..plane.w).step_by(side).zip(row) {
                    map[y * plane.w + x] = fresh;
                }
            }
        }
    }
}
