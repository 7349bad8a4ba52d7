//! The fast corrector for `J = 1`: every pixel holds one whole number.
//!
//! A position is an index into tables that are padded by `h` on all sides, so that a neighbour's prediction is one
//! subtraction. Padding of sides that do not join never wins. If all neighbours that are compared predict what a pixel
//! already shows, its error is 0 and nothing can beat it.
use super::analysis::{Hood, Level};
use super::candidates::distance;
use super::coverage::{self, Factors};
use super::pca::DIMS;
use super::region::Region;
use super::{Lookup, Plane};
use crate::kernel::simd;
use crate::kernel::window::{index, offset};
use rayon::prelude::*;

/// A level's tables, padded.
pub struct Table {
    /// Spacing in finest pixels.
    pub h: usize,
    /// The exemplar.
    pub plane: Plane,
    stride: usize,
    hood: Hood,
    matrix: Vec<[f32; DIMS]>,
    appearance: Vec<[f32; DIMS]>,
    hoods: Vec<[f32; DIMS]>,
    second: Vec<u32>,
    bin: Vec<u32>,
    /// Where the padding of sides that join leads; empty if none do.
    home: Vec<u32>,
    guide: Vec<f32>,
    /// Bins that hold a pixel that can win.
    pub usable_bins: usize,
    /// How much neighbourhoods differ on average, squared.
    pub spread: f32,
}

impl Table {
    /// Tables of an analysed level. `valid` pixels may win; `guide` is empty or holds the exemplar's guide.
    pub fn new(level: &Level, plane: Plane, valid: &[bool], guide: &[f32]) -> Self {
        let (h, w) = (level.h, plane.w);
        let stride = w + 2 * h;
        let n = stride * (plane.h + 2 * h);
        let source: Vec<(bool, usize)> = (0..n)
            .into_par_iter()
            .map(|p| {
                let (x, y) = (index(p % stride) - index(h), index(p / stride) - index(h));
                let inside = |k: i32, n: usize, wrap: bool| wrap || (0..index(n)).contains(&k);
                (inside(x, w, plane.wrap[0]) && inside(y, plane.h, plane.wrap[1]), plane.index(x, y))
            })
            .collect();
        let padded = |p: usize| (p / w + h) * stride + p % w + h;
        let hoods = &level.neighborhoods;
        let narrow = super::candidates::narrow;
        let wraps = plane.wrap[0] || plane.wrap[1];
        let mut used = vec![false; plane.w.div_ceil(coverage::BIN) * plane.h.div_ceil(coverage::BIN)];
        valid.iter().enumerate().filter(|v| *v.1).for_each(|(p, _)| used[coverage::bin(plane, p % w, p / w)] = true);
        Self {
            h,
            plane,
            stride,
            hood: level.hood,
            matrix: level.matrix.clone(),
            appearance: source.iter().map(|&(_, p)| level.appearance[p]).collect(),
            spread: spread(hoods),
            hoods: source
                .iter()
                .map(|&(ok, p)| if ok && valid[p] { hoods[p] } else { [f32::INFINITY; DIMS] })
                .collect(),
            second: if level.second.is_empty() {
                Vec::new()
            } else {
                source.iter().map(|&(_, p)| narrow(padded(level.second[p] as usize))).collect()
            },
            bin: source.iter().map(|&(_, p)| narrow(coverage::bin(plane, p % w, p / w))).collect(),
            home: if wraps { source.iter().map(|&(_, p)| narrow(padded(p))).collect() } else { Vec::new() },
            guide: if guide.is_empty() { Vec::new() } else { source.iter().map(|&(_, p)| guide[p]).collect() },
            usable_bins: used.iter().filter(|u| **u).count(),
        }
    }

    /// The index of exemplar pixel (x, y), which lies inside.
    pub fn at(&self, [x, y]: [i32; 2]) -> u32 {
        super::candidates::narrow(offset(y + index(self.h)) * self.stride + offset(x + index(self.h)))
    }

    /// The exemplar pixel of an index.
    pub fn pixel(&self, at: u32) -> [i32; 2] {
        let at = at as usize;
        [index(at % self.stride) - index(self.h), index(at / self.stride) - index(self.h)]
    }

    /// The other pixel that looks like (x, y), if such were sought.
    pub fn second(&self, at: [i32; 2]) -> Option<[i32; 2]> {
        self.second.get(self.at(at) as usize).map(|&second| self.pixel(second))
    }

    /// Whether an index can win.
    pub fn is_valid(&self, at: u32) -> bool {
        self.hoods[at as usize][0].is_finite()
    }

    /// The guide's value there; 0 without one.
    pub fn guide(&self, at: u32) -> f32 {
        self.guide.get(at as usize).copied().unwrap_or(0.0)
    }

    /// Whether there is a guide.
    #[inline(always)]
    pub fn has_guide(&self) -> bool {
        !self.guide.is_empty()
    }

    /// The exemplar pixel that holds a position.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, and far positions are limited later")]
    pub(super) fn cell(&self, [x, y]: [f32; 2]) -> [i32; 2] {
        [x.floor() as i32, y.floor() as i32]
    }

    /// The index of exemplar pixel (x, y); of one that is farther outside than the tables reach, one that cannot win,
    /// or where sides join the one meant.
    #[inline(always)]
    pub(super) fn padded(&self, [x, y]: [i32; 2]) -> u32 {
        let Plane { w, h, wrap } = self.plane;
        let axis = |k: i32, n: usize, wrap: bool| {
            let pad = index(self.h);
            if wrap { k.rem_euclid(index(n)) + pad } else { k.clamp(-pad, index(n) + pad - 1) + pad }
        };
        (axis(y, h, wrap[1]) * index(self.stride) + axis(x, w, wrap[0])).cast_unsigned()
    }

    /// The appearance at exemplar pixel (x, y), of the border where it is outside.
    #[inline(always)]
    pub(super) fn appearance_at(&self, at: [i32; 2]) -> &[f32; DIMS] {
        &self.appearance[self.padded(at) as usize]
    }

    #[inline(always)]
    pub(super) fn hood(&self) -> Hood {
        self.hood
    }

    #[inline(always)]
    pub(super) fn matrix(&self) -> &[[f32; DIMS]] {
        &self.matrix
    }

    #[inline(always)]
    pub(super) fn hood_at(&self, at: u32) -> &[f32; DIMS] {
        &self.hoods[at as usize]
    }

    #[inline(always)]
    pub(super) fn bin_at(&self, at: u32) -> usize {
        self.bin[at as usize] as usize
    }

    #[inline(always)]
    pub(super) fn second_at(&self, at: u32) -> Option<u32> {
        self.second.get(at as usize).copied()
    }

    /// A position brought inside where sides join.
    #[inline(always)]
    pub(super) fn wrapped(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let axis = |v: f32, n: usize, wrap: bool| {
            let n = n as f32;
            if wrap && !(0.0..n).contains(&v) { v - (v / n).floor() * n } else { v }
        };
        [axis(x, self.plane.w, self.plane.wrap[0]), axis(y, self.plane.h, self.plane.wrap[1])]
    }

    /// Whether exemplar pixel (x, y) lies inside.
    pub(super) fn holds(&self, [x, y]: [i32; 2]) -> bool {
        let Plane { w, h, wrap } = self.plane;
        (wrap[0] || (0..index(w)).contains(&x)) && (wrap[1] || (0..index(h)).contains(&y))
    }

    /// Counts what a map shows.
    pub fn factors(&self, even: &coverage::EvenUse, region: &Region, map: &[u32]) -> Factors {
        Factors::count(even, self.plane, self.usable_bins, region, |p| self.bin[map[p] as usize] as usize)
    }
}

/// Twice the total variance: the mean squared distance of two vectors.
pub(super) fn spread(vectors: &[[f32; DIMS]]) -> f32 {
    let n = vectors.len().max(1) as f32;
    (0..DIMS)
        .map(|d| {
            let mean = vectors.iter().map(|v| v[d]).sum::<f32>() / n;
            2.0 * vectors.iter().map(|v| (v[d] - mean) * (v[d] - mean)).sum::<f32>() / n
        })
        .sum()
}

/// What a correction weighs.
pub struct Terms<'a> {
    /// The factor on what merely looks alike, κ.
    pub kappa: f32,
    /// Whether what lies diagonally is averaged over three predictions (S-5), which keeps neighbours in touch.
    pub averaged: bool,
    /// Factors for even use.
    pub factors: Option<&'a Factors>,
    /// Wanted guide values by pixel and their weight; empty for none.
    pub guide: &'a [f32],
    /// See `guide`.
    pub guide_weight: f32,
    /// Pixels that stay as they are; empty for none.
    pub fixed: &'a [bool],
}

/// One pass: the four quarters of pixels in the order (0,0), (1,1), (1,0), (0,1), each read before any of it is written.
pub fn correct(table: &Table, region: &Region, terms: &Terms<'_>, map: &mut [u32]) {
    let mut fresh = Vec::new();
    for quarter in [[0, 0], [1, 1], [1, 0], [0, 1]] {
        let first = [0, 1].map(|d| offset((quarter[d] - region.start[d]).rem_euclid(2)));
        let Plane { w, h, .. } = region.plane;
        if first[0] >= w || first[1] >= h {
            continue;
        }
        let (columns, rows) = ((w - first[0]).div_ceil(2), (h - first[1]).div_ceil(2));
        fresh.clear();
        fresh.resize(columns * rows, 0u32);
        let old: &[u32] = map;
        fresh.par_chunks_mut(columns).with_min_len(4).enumerate().for_each(|(row, out)| {
            let pixels = Row { table, region, terms, map: old, y: first[1] + 2 * row };
            pixels.fill(first[0], out);
        });
        map.par_chunks_mut(w).skip(first[1]).step_by(2).zip(fresh.par_chunks(columns)).with_min_len(8).for_each(
            |(map, fresh)| {
                map[first[0]..].iter_mut().step_by(2).zip(fresh).for_each(|(map, fresh)| *map = *fresh);
            },
        );
    }
}

/// Every second pixel of a row.
struct Row<'a> {
    table: &'a Table,
    region: &'a Region,
    terms: &'a Terms<'a>,
    map: &'a [u32],
    y: usize,
}

/// The immediate neighbours, by rows.
const NEAR: [[i32; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

impl Row<'_> {
    fn fill(&self, first: usize, out: &mut [u32]) {
        let guided = !self.table.guide.is_empty() && !self.terms.guide.is_empty();
        let plain = self.table.home.is_empty() && !guided;
        simd::dispatch(
            #[inline(always)]
            || match (self.table.hood, plain) {
                (Hood::Diagonal4, true) => self.each::<4, 1, true>(first, out),
                (Hood::Diagonal4, false) => self.each::<4, 1, false>(first, out),
                (Hood::Square3, _) => self.each::<8, 1, false>(first, out),
                (Hood::Square5, true) => self.each::<24, 2, true>(first, out),
                (Hood::Square5, false) => self.each::<24, 2, false>(first, out),
            },
        );
    }

    #[inline(always)]
    fn each<const N: usize, const R: usize, const PLAIN: bool>(&self, first: usize, out: &mut [u32]) {
        let Plane { w, h, wrap } = self.region.plane;
        let rows: [usize; 5] = std::array::from_fn(|k| Plane::bring(index(self.y + k) - 2, h, wrap[1]) * w);
        let stride = index(self.table.stride);
        let step = index(self.table.h);
        let offsets = hood_offsets::<N>();
        // What a neighbour's index must be lessened by.
        let shift = |[x, y]: [i32; 2]| (step * (y * stride + x)).cast_unsigned();
        let shifts: [u32; N] = offsets.map(shift);
        let near: [u32; 8] = NEAR.map(shift);
        for (k, out) in out.iter_mut().enumerate() {
            let x = first + 2 * k;
            let own = self.map[rows[2] + x];
            if !self.terms.fixed.is_empty() && self.terms.fixed[rows[2] + x] {
                *out = own;
                continue;
            }
            let columns: [usize; 5] = if x >= 2 && x + 2 < w {
                std::array::from_fn(|k| x + k - 2)
            } else {
                std::array::from_fn(|k| Plane::bring(index(x + k) - 2, w, wrap[0]))
            };
            let read = |[dx, dy]: [i32; 2]| self.map[rows[offset(dy + 2)] + columns[offset(dx + 2)]];
            let around: [u32; N] = offsets.map(read);
            let close = NEAR.map(read);
            let mut same = PLAIN;
            for (a, s) in around.iter().zip(&shifts) {
                same &= a.wrapping_sub(*s) == own;
            }
            let averaged = N == 4 && self.terms.averaged;
            if averaged {
                for (a, s) in close.iter().zip(&near) {
                    same &= a.wrapping_sub(*s) == own;
                }
            }
            if same && self.table.is_valid(own) {
                *out = own;
                continue;
            }
            let wanted = if averaged { self.diagonals(&close) } else { self.neighbourhood(&around) };
            *out = self.best::<PLAIN>(own, &wanted, &close, &near, x);
        }
    }

    /// What the output shows diagonally around a pixel: each place as it is, and as its two neighbours predict it.
    #[inline(always)]
    fn diagonals(&self, close: &[u32; 8]) -> [f32; DIMS] {
        let table = self.table;
        let (across, down) = (index(table.h).cast_unsigned(), index(table.h * table.stride).cast_unsigned());
        let (left, up) = (across.wrapping_neg(), down.wrapping_neg());
        let parts = [
            [close[0], close[3].wrapping_add(up), close[1].wrapping_add(left)],
            [close[2], close[4].wrapping_add(up), close[1].wrapping_add(across)],
            [close[5], close[3].wrapping_add(down), close[6].wrapping_add(left)],
            [close[7], close[4].wrapping_add(down), close[6].wrapping_add(across)],
        ];
        let mut wanted = [0.0f32; DIMS];
        for (part, matrix) in parts.into_iter().zip(table.matrix.chunks_exact(DIMS)) {
            let [a, b, c] = part.map(|at| &table.appearance[at as usize]);
            let mut mean = [0.0f32; DIMS];
            for d in 0..DIMS {
                mean[d] = (a[d] + (b[d] + c[d])) * (1.0 / 3.0);
            }
            for (v, row) in mean.iter().zip(matrix) {
                wanted.iter_mut().zip(row).for_each(|(wanted, m)| *wanted += v * m);
            }
        }
        wanted
    }

    /// What the output shows around a pixel.
    #[inline(always)]
    fn neighbourhood<const N: usize>(&self, around: &[u32; N]) -> [f32; DIMS] {
        let mut wanted = [0.0f32; DIMS];
        for (at, matrix) in around.iter().zip(self.table.matrix.chunks_exact(DIMS)) {
            for (v, row) in self.table.appearance[*at as usize].iter().zip(matrix) {
                wanted.iter_mut().zip(row).for_each(|(wanted, m)| *wanted += v * m);
            }
        }
        wanted
    }

    /// The best of the pixel's own position, its neighbours' predictions, and what looks like those.
    #[inline(always)]
    fn best<const PLAIN: bool>(
        &self,
        own: u32,
        wanted: &[f32; DIMS],
        near: &[u32; 8],
        shifts: &[u32; 8],
        x: usize,
    ) -> u32 {
        let (table, terms) = (self.table, self.terms);
        let factors = terms.factors.map(|factors| factors.of(x, self.y));
        let guide = if PLAIN || terms.guide.is_empty() { 0.0 } else { terms.guide[self.y * self.region.plane.w + x] };
        let cost = |at: u32| {
            let mut cost = distance(wanted, &table.hoods[at as usize]);
            if !PLAIN && !table.guide.is_empty() {
                let off = guide - table.guide[at as usize];
                cost += terms.guide_weight * (off * off);
            }
            if let Some(factors) = factors {
                cost *= factors[table.bin[at as usize] as usize];
            }
            cost
        };
        let (mut best, mut least) = (own, cost(own));
        let alike = |at: u32, best: &mut u32, least: &mut f32| {
            if let Some(&second) = table.second.get(at as usize) {
                let cost = terms.kappa * cost(second);
                if cost < *least {
                    (*best, *least) = (second, cost);
                }
            }
        };
        alike(own, &mut best, &mut least);
        let mut last = own;
        for (at, shift) in near.iter().zip(shifts) {
            let mut at = at.wrapping_sub(*shift);
            if !PLAIN && !table.home.is_empty() {
                at = table.home[at as usize];
            }
            if at == own || at == last {
                continue;
            }
            last = at;
            let cost = cost(at);
            if cost == f32::INFINITY {
                continue;
            }
            if cost < least {
                (best, least) = (at, cost);
            }
            alike(at, &mut best, &mut least);
        }
        best
    }
}

/// The offsets of the neighbourhood of `N` pixels, by rows.
#[inline(always)]
fn hood_offsets<const N: usize>() -> [[i32; 2]; N] {
    let mut offsets = [[0; 2]; N];
    let (mut k, reach) = (0, if N == 24 { 2 } else { 1 });
    for y in -reach..=reach {
        for x in -reach..=reach {
            let wanted = if N == 4 { x != 0 && y != 0 } else { x != 0 || y != 0 };
            if wanted && k < N {
                offsets[k] = [x, y];
                k += 1;
            }
        }
    }
    offsets
}
