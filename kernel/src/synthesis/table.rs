//! The tables of a level, padded by `h` on all sides, so that a neighbour's prediction never has to be brought inside.
use super::analysis::{Hood, Level};
use super::coverage::{self, Factors};
use super::lattice::Basis;
use super::pca::DIMS;
use super::phase::{Metric, Phase, phase};
use super::plane::{Lookup, PixelPlane};
use super::region::Region;
use crate::ground::simd;
use crate::ground::window::{index, offset};
use rayon::prelude::*;

/// The tables of a level, padded.
pub struct Table {
    /// Spacing in finest pixels.
    pub h: usize,
    /// Size of the exemplar, and the axes that wrap.
    pub plane: PixelPlane,
    pub(super) stride: usize,
    pub(super) hood: Hood,
    pub(super) matrix: Vec<[f32; DIMS]>,
    pub(super) appearance: Vec<[f32; DIMS]>,
    pub(super) hoods: Vec<[f32; DIMS]>,
    pub(super) second: Vec<u32>,
    /// Further candidates that look alike; usually none.
    pub(super) more: Vec<Vec<u32>>,
    pub(super) bin: Vec<u32>,
    /// Wrapped index of each pixel; empty if no side wraps.
    pub(super) home: Vec<u32>,
    pub(super) guide: Vec<f32>,
    /// Lattice phase of each pixel; empty if no phase is kept.
    phases: Vec<Phase>,
    metric: Metric,
    /// Number of bins with a pixel that can win.
    pub usable_bins: usize,
    /// Mean squared difference of two neighbourhoods.
    pub spread: f32,
}

impl Table {
    /// Builds the tables of an analysed level. Only `valid` pixels may win; `guide` is empty or holds the exemplar's
    /// guide.
    pub fn new(level: &Level, plane: PixelPlane, valid: &[bool], guide: &[f32]) -> Self {
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
        let narrow = super::candidates::narrow;
        let padded = |p: usize| (p / w + h) * stride + p % w + h;
        // Along axes that do not wrap, padding keeps its own index: it never wins.
        let home = |p: usize| {
            let [x, y] = plane.joined([index(p % stride) - index(h), index(p / stride) - index(h)]);
            narrow(offset(y + index(h)) * stride + offset(x + index(h)))
        };
        let hoods = &level.neighborhoods;
        let wraps = plane.wrap[0] || plane.wrap[1];
        let alike = |others: &[u32]| source.iter().map(|&(_, p)| narrow(padded(others[p] as usize))).collect();
        let mut others = level.second.chunks_exact(hoods.len());
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
            second: others.next().map_or_else(Vec::new, alike),
            more: others.map(alike).collect(),
            bin: source.iter().map(|&(_, p)| narrow(coverage::bin(plane, p % w, p / w))).collect(),
            home: if wraps { (0..n).map(home).collect() } else { Vec::new() },
            guide: if guide.is_empty() { Vec::new() } else { source.iter().map(|&(_, p)| guide[p]).collect() },
            phases: Vec::new(),
            metric: Metric::default(),
            usable_bins: used.iter().filter(|u| **u).count(),
        }
    }

    /// Adds the lattice phase of each pixel, at the middle of its footprint where `J = 1`.
    pub(super) fn on(mut self, basis: &Basis) -> Self {
        let half = 0.5 * self.h as f64;
        let n = self.appearance.len();
        self.phases = (0..n)
            .map(|at| phase(basis, self.pixel(super::candidates::narrow(at)).map(|v| f64::from(v) + half)))
            .collect();
        self.metric = Metric::new(basis);
        self
    }

    /// Phase error of an index, 0 to 1.
    #[inline(always)]
    pub(super) fn off(&self, at: u32, wanted: Phase) -> f32 {
        self.metric.off(self.phases[at as usize], wanted)
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

    /// The first candidate that looks like (x, y), if candidates were searched for.
    pub fn second(&self, at: [i32; 2]) -> Option<[i32; 2]> {
        self.second.get(self.at(at) as usize).map(|&second| self.pixel(second))
    }

    /// Returns whether an index can win.
    pub fn is_valid(&self, at: u32) -> bool {
        self.hoods[at as usize][0].is_finite()
    }

    /// The guide's value at an index; 0 without a guide.
    pub fn guide(&self, at: u32) -> f32 {
        self.guide.get(at as usize).copied().unwrap_or(0.0)
    }

    /// Returns whether there is a guide.
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

    /// Index of exemplar pixel (x, y). Pixels outside wrap along axes that wrap; beyond the padding, returns an index
    /// that cannot win.
    #[inline(always)]
    pub(super) fn padded(&self, [x, y]: [i32; 2]) -> u32 {
        let PixelPlane { w, h, wrap } = self.plane;
        let axis = simd::inlined(
            #[inline(always)]
            |k: i32, n: usize, wrap: bool| {
                let pad = index(self.h);
                if wrap { k.rem_euclid(index(n)) + pad } else { k.clamp(-pad, index(n) + pad - 1) + pad }
            },
        );
        (axis(y, h, wrap[1]) * index(self.stride) + axis(x, w, wrap[0])).cast_unsigned()
    }

    /// Appearance of exemplar pixel (x, y); outside, that of the border.
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

    /// All candidates that look like the pixel of an index.
    #[inline(always)]
    pub(super) fn alike(&self, at: u32) -> impl Iterator<Item = u32> {
        let second = self.second.get(at as usize).copied();
        second.into_iter().chain(self.more.iter().map(move |more| more[at as usize]))
    }

    /// Wraps a position along the axes that wrap.
    #[inline(always)]
    pub(super) fn wrapped(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let axis = simd::inlined(
            #[inline(always)]
            |v: f32, n: usize, wrap: bool| {
                let n = n as f32;
                if wrap && !(0.0..n).contains(&v) { v - (v / n).floor() * n } else { v }
            },
        );
        [axis(x, self.plane.w, self.plane.wrap[0]), axis(y, self.plane.h, self.plane.wrap[1])]
    }

    /// Returns whether exemplar pixel (x, y) lies inside.
    pub(super) fn holds(&self, [x, y]: [i32; 2]) -> bool {
        let PixelPlane { w, h, wrap } = self.plane;
        (wrap[0] || (0..index(w)).contains(&x)) && (wrap[1] || (0..index(h)).contains(&y))
    }

    /// Counts the uses of a map.
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
