//! The fast corrector for `J = 1`: each pixel holds one integer.
//!
//! A position is an index into tables that are padded by `h` on all sides, so that a neighbour's prediction is one
//! subtraction. Padding of sides that do not wrap never wins. If all compared neighbours predict the pixel's own
//! position, its error is 0, the minimum.
use super::analysis::Hood;
use super::candidates::distance;
use super::coverage::Factors;
use super::pca::DIMS;
use super::phase::{self, Phase};
use super::plane::PixelPlane;
use super::region::Region;
use super::table::Table;
use crate::ground::simd;
use crate::ground::window::{index, offset};
use rayon::prelude::*;

/// The terms of the cost.
pub struct Terms<'a> {
    /// Cost factor κ of candidates that look alike, compared with coherent ones.
    pub kappa: f32,
    /// True if three predictions are averaged per diagonal neighbour, so that adjacent pixels influence each other too.
    pub averaged: bool,
    /// Factors for even use.
    pub factors: Option<&'a Factors>,
    /// Target guide values by pixel; empty for none.
    pub guide: &'a [f32],
    /// Weight of `guide`.
    pub guide_weight: f32,
    /// Pixels that must not change; empty for none.
    pub fixed: &'a [bool],
    /// Target lattice phase of each pixel; empty if no phase is kept.
    pub(super) phases: &'a [Phase],
}

/// Factor on the reach of a pass: each of its four quarters reads the result of the one before.
pub(super) const QUARTERS: i32 = 4;

/// Runs one pass: the four quarters of pixels in the order (0,0), (1,1), (1,0), (0,1); each quarter is read completely
/// before any of it is written.
pub fn correct(table: &Table, region: &Region, terms: &Terms<'_>, map: &mut [u32]) {
    let mut fresh = Vec::new();
    for quarter in [[0, 0], [1, 1], [1, 0], [0, 1]] {
        let first = [0, 1].map(|d| offset((quarter[d] - region.start[d]).rem_euclid(2)));
        let PixelPlane { w, h, .. } = region.plane;
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

/// Reach of [`break_runs`] around a pixel.
pub const RUN_REACH: i32 = 4;

/// Breaks up runs of three equal exemplar pixels in a row or column: each inner pixel of a run moves by one pixel,
/// alternately forwards and backwards. Runs twice, since the first time may, rarely, make a new run.
pub fn break_runs(table: &Table, region: &Region, fixed: &[bool], map: &mut [u32]) {
    for _ in 0..2 {
        break_runs_once(table, region, fixed, map);
    }
}

fn break_runs_once(table: &Table, region: &Region, fixed: &[bool], map: &mut [u32]) {
    let PixelPlane { w, h, wrap } = region.plane;
    let old: &[u32] = map;
    let (one, stride) = (index(table.h), index(table.h * table.stride));
    let parted = |y: usize| {
        let rows: [usize; 5] = std::array::from_fn(|k| PixelPlane::bring(index(y + k) - 2, h, wrap[1]) * w);
        let moved = move |x: usize| {
            let p = rows[2] + x;
            let across = |d: i32| old[rows[2] + PixelPlane::bring(index(x) + d, w, wrap[0])];
            let down = |d: i32| old[rows[offset(d + 2)] + x];
            let inner = |to: u32| (across(-1) == to && across(1) == to, down(-1) == to && down(1) == to);
            let run = |to: u32| {
                let ends = |at: &dyn Fn(i32) -> u32| [-1, 1].iter().any(|d| at(*d) == to && at(2 * d) == to);
                inner(to) != (false, false) || ends(&across) || ends(&down)
            };
            let own = old[p];
            let (flat, upright) = inner(own);
            if !flat && !upright || fixed.get(p).is_some_and(|fixed| *fixed) {
                return None;
            }
            let turn = |k: i32, step: i32| if k & 1 == 0 { [step, -step] } else { [-step, step] };
            let (x, y) = (turn(region.start[0] + index(x), one), turn(region.start[1] + index(y), stride));
            let steps = if flat { [x[0], x[1], y[0], y[1]] } else { [y[0], y[1], x[0], x[1]] };
            let places = steps.map(|step| {
                let at = own.wrapping_add(step.cast_unsigned());
                table.home.get(at as usize).copied().unwrap_or(at)
            });
            places.into_iter().find(|&to| table.is_valid(to) && !run(to)).map(|to| (p, to))
        };
        (0..w).filter_map(moved)
    };
    let parted: Vec<(usize, u32)> = (0..h).into_par_iter().with_min_len(16).flat_map_iter(parted).collect();
    parted.into_iter().for_each(|(p, to)| map[p] = to);
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
        let (from, to) = self.middle(first, out.len());
        let (left, rest) = out.split_at_mut(from);
        let (middle, right) = rest.split_at_mut(to - from);
        simd::dispatch(
            #[inline(always)]
            || self.span::<false>(first + 2 * from, middle),
        );
        for (first, out) in [(first, left), (first + 2 * to, right)] {
            if !out.is_empty() {
                self.sides(first, out);
            }
        }
    }

    /// Range of the pixels (out of `count`) whose neighbours are all at regular distances, not across a short wrapping
    /// side.
    fn middle(&self, first: usize, count: usize) -> (usize, usize) {
        let Region { plane, short, .. } = self.region;
        if short[1] != 0 && (self.y < 2 || self.y + 2 >= plane.h) {
            return (count, count);
        }
        if short[0] == 0 {
            return (0, count);
        }
        let from = usize::from(first < 2).min(count);
        (from, (plane.w.saturating_sub(2).saturating_sub(first)).div_ceil(2).clamp(from, count))
    }

    #[cold]
    #[inline(never)]
    fn sides(&self, first: usize, out: &mut [u32]) {
        self.span::<true>(first, out);
    }

    #[inline(always)]
    fn span<const SIDE: bool>(&self, first: usize, out: &mut [u32]) {
        let guided = !self.table.guide.is_empty() && !self.terms.guide.is_empty();
        let plain = self.table.home.is_empty() && !guided;
        match (self.table.hood, plain) {
            (Hood::Diagonal4, true) => self.each::<4, true, SIDE>(first, out),
            (Hood::Diagonal4, false) => self.each::<4, false, SIDE>(first, out),
            (Hood::Square3, _) => self.each::<8, false, SIDE>(first, out),
            (Hood::Square5, true) => self.each::<24, true, SIDE>(first, out),
            (Hood::Square5, false) => self.each::<24, false, SIDE>(first, out),
        }
    }

    #[inline(always)]
    fn each<const N: usize, const PLAIN: bool, const SIDE: bool>(&self, first: usize, out: &mut [u32]) {
        let PixelPlane { w, h, wrap } = self.region.plane;
        let rows: [usize; 5] = std::array::from_fn(|k| PixelPlane::bring(index(self.y + k) - 2, h, wrap[1]) * w);
        let stride = index(self.table.stride);
        let step = index(self.table.h);
        let offsets = hood_offsets::<N>();
        // Offset subtracted from a neighbour's index to predict this pixel.
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
                std::array::from_fn(|k| PixelPlane::bring(index(x + k) - 2, w, wrap[0]))
            };
            let read = |[dx, dy]: [i32; 2]| {
                let at = self.map[rows[offset(dy + 2)] + columns[offset(dx + 2)]];
                if !SIDE {
                    return at;
                }
                let beyond = self.region.beyond(index(x) + dx, index(self.y) + dy);
                at.wrapping_add((beyond[1] * stride + beyond[0]).cast_unsigned())
            };
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

    /// Neighbourhood vector of the 4 diagonals around a pixel: each as shown, averaged with the predictions of its two
    /// neighbours.
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

    /// Neighbourhood vector of the output around a pixel.
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

    /// Best of the pixel's own position, its neighbours' predictions, and the candidates that look like them.
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
        let phase = terms.phases.get(self.y * self.region.plane.w + x);
        let cost = |at: u32| {
            let mut cost = distance(wanted, &table.hoods[at as usize]);
            if !PLAIN && !table.guide.is_empty() {
                let off = guide - table.guide[at as usize];
                cost += terms.guide_weight * (off * off);
            }
            if let Some(&phase) = phase {
                cost += phase::COST * table.spread * table.off(at, phase);
            }
            if let Some(factors) = factors {
                cost *= factors[table.bin[at as usize] as usize];
            }
            cost
        };
        let (mut best, mut least) = (own, cost(own));
        let alike = |at: u32, best: &mut u32, least: &mut f32| {
            let mut weigh = |other: u32| {
                let cost = terms.kappa * cost(other);
                if cost < *least {
                    (*best, *least) = (other, cost);
                }
            };
            if let Some(&second) = table.second.get(at as usize) {
                weigh(second);
                table.more.iter().for_each(|more| weigh(more[at as usize]));
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

/// Offsets of a neighbourhood of `N` pixels, by rows.
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
