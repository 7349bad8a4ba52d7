//! Even use of the exemplar: what is shown much already costs more.
//!
//! Used positions are counted in bins of 4×4 exemplar pixels, smoothed, and compared with their mean `c`; the cost of a
//! position is multiplied by `1 + λ·clamp(c - 1, -¼, 4)`. Counted over the whole output, or over tiles of it that lie
//! where they do whatever the window, which keeps every dependency local.
use super::Plane;
use super::region::Region;
use crate::kernel::window::{index, offset};
use rayon::prelude::*;

/// Width and height of a bin in exemplar pixels.
pub const BIN: usize = 4;

/// How use is counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvenUse {
    /// How much is asked for, λ.
    pub amount: f32,
    /// Side of a local tile in finest output pixels; all of the output if none.
    pub tile: Option<usize>,
}

/// Factors for every bin of every tile of a level.
pub struct Factors {
    /// The tile that each column lies in, and that each row lies in.
    columns: Vec<usize>,
    rows: Vec<usize>,
    across: usize,
    bins: usize,
    factors: Vec<f32>,
}

/// The bin of an exemplar pixel.
pub fn bin(plane: Plane, x: usize, y: usize) -> usize {
    (y / BIN) * plane.w.div_ceil(BIN) + x / BIN
}

impl Factors {
    /// Counts what a level shows: `bin_of` gives the bin of each pixel of `region`.
    pub fn count(
        use_: &EvenUse,
        exemplar: Plane,
        usable_bins: usize,
        region: &Region,
        bin_of: impl Fn(usize) -> usize + Sync,
    ) -> Self {
        let side = use_.tile.map_or(usize::MAX, |tile| (tile / region.h).max(1));
        let axis = |start: i32, n: usize, wrap: bool| -> Vec<usize> {
            if side == usize::MAX {
                return vec![0; n];
            }
            if wrap {
                // As many tiles as fit, all alike.
                let tiles = (n / side).max(1);
                return (0..n).map(|k| k * tiles / n).collect();
            }
            let tile = |k: usize| (start + index(k)).div_euclid(index(side));
            (0..n).map(|k| offset(tile(k) - tile(0))).collect()
        };
        let Plane { w, h, wrap } = region.plane;
        let (columns, rows) = (axis(region.start[0], w, wrap[0]), axis(region.start[1], h, wrap[1]));
        let (across, down) = (columns[w - 1] + 1, rows[h - 1] + 1);
        let (bw, bh) = (exemplar.w.div_ceil(BIN), exemplar.h.div_ceil(BIN));
        let bins = bw * bh;
        let mut factors = vec![0.0; across * down * bins];
        factors.par_chunks_mut(bins * across).enumerate().for_each(|(tile_row, factors)| {
            for y in (0..h).filter(|&y| rows[y] == tile_row) {
                for (x, tile) in columns.iter().enumerate() {
                    factors[tile * bins + bin_of(y * w + x)] += 1.0;
                }
            }
            for counts in factors.chunks_exact_mut(bins) {
                let total: f32 = counts.iter().sum();
                let mean = total / usable_bins.max(1) as f32;
                smooth(counts, bw, bh, exemplar.wrap);
                for count in counts {
                    *count = 1.0 + use_.amount * (*count / mean.max(1e-6) - 1.0).clamp(-0.25, 4.0);
                }
            }
        });
        Self { columns, rows, across, bins, factors }
    }

    /// The factors of the tile of pixel (x, y), by bin.
    #[inline(always)]
    pub fn of(&self, x: usize, y: usize) -> &[f32] {
        let tile = self.rows[y] * self.across + self.columns[x];
        &self.factors[tile * self.bins..(tile + 1) * self.bins]
    }
}

/// A Gaussian of σ 1.2 bins.
fn smooth(counts: &mut [f32], w: usize, h: usize, wrap: [bool; 2]) {
    let weights: Vec<f32> = (-3i32..=3).map(|d| crate::kernel::math::exp(-(d * d) as f32 / 2.88)).collect();
    let sum: f32 = weights.iter().sum();
    let mut blurred = vec![0.0; counts.len()];
    for across in [true, false] {
        for y in 0..h {
            for x in 0..w {
                let mut value = 0.0;
                for (d, weight) in (-3..=3).zip(&weights) {
                    let (x, y) = if across { (index(x) + d, index(y)) } else { (index(x), index(y) + d) };
                    let (x, y) = (super::texels::mirrored(x, w, wrap[0]), super::texels::mirrored(y, h, wrap[1]));
                    value += weight * counts[y * w + x];
                }
                blurred[y * w + x] = value / sum;
            }
        }
        counts.copy_from_slice(&blurred);
    }
}
