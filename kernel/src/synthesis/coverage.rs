//! Even use of the exemplar: positions that are shown often cost more.
//!
//! Uses are counted in bins of 4×4 exemplar pixels, smoothed by about the footprint of a pixel of the level, and
//! compared with their mean. With `c` = count / mean (mean at least one use), the cost of a position is multiplied by
//! `1 + λ·clamp(c - 1, -¼, 4)`. Uses are counted over the whole output, or over tiles at fixed positions whatever the
//! window, which keeps every dependency local.
use super::plane::PixelPlane;
use super::region::Region;
use super::texels::mirrored;
use crate::ground::simd;
use crate::ground::window::{index, offset};
use rayon::prelude::*;

/// Width and height of a bin in exemplar pixels.
pub const BIN: usize = 4;

/// Settings of the count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvenUse {
    /// The weight λ.
    pub amount: f32,
    /// Side of a local tile in finest output pixels; `None` counts over the whole output.
    pub tile: Option<usize>,
    /// True if wrapping sides run through the middle of tiles, since slightly more pieces end where tiles meet. Set by
    /// the run, not by its settings.
    pub halved: bool,
}

/// Cost factors for each bin of each tile of a level.
pub struct Factors {
    /// Tile index of each column, and of each row.
    columns: Vec<usize>,
    rows: Vec<usize>,
    across: usize,
    bins: usize,
    factors: Vec<f32>,
    /// Tile index of each pixel, if tiles are not rectangles; else empty.
    each: Vec<u32>,
}

/// The pixels of a surface level, to count the exemplar positions they show.
pub struct SurfaceUses<'a> {
    /// The counted pixels.
    pub sites: &'a [u32],
    /// Tile index of each pixel (of all pixels, not only `sites`); empty if there is one tile.
    pub tiles: &'a [u32],
    /// Number of tiles.
    pub count: usize,
    /// Spacing of the level in finest pixels.
    pub h: usize,
}

/// Weight of a surface pixel whose footprint is one exemplar pixel; at most 64 times as much is counted.
const SHARES: f32 = 64.0;

/// Bin index of an exemplar pixel.
pub fn bin(plane: PixelPlane, x: usize, y: usize) -> usize {
    (y / BIN) * plane.w.div_ceil(BIN) + x / BIN
}

impl Factors {
    /// Counts the uses of a level: `bin_of` returns the bin of each pixel of `region`.
    pub fn count(
        even: &EvenUse,
        exemplar: PixelPlane,
        usable_bins: usize,
        region: &Region,
        bin_of: impl Fn(usize) -> usize + Sync,
    ) -> Self {
        let side = even.tile.map_or(usize::MAX, |tile| (tile / region.h).max(1));
        let axis = |start: i32, n: usize, wrap: bool| -> Vec<usize> {
            if side == usize::MAX {
                return vec![0; n];
            }
            if wrap {
                // As many tiles as fit, all of one size up to rounding.
                let tiles = (n / side).max(1);
                let before = if even.halved { n / (2 * tiles) } else { 0 };
                return (0..n).map(|k| (k + before) * tiles / n % tiles).collect();
            }
            let tile = |k: usize| (start + index(k)).div_euclid(index(side));
            (0..n).map(|k| offset(tile(k) - tile(0))).collect()
        };
        let PixelPlane { w, h, wrap } = region.plane;
        let (columns, rows) = (axis(region.start[0], w, wrap[0]), axis(region.start[1], h, wrap[1]));
        let [across, down] = [&columns, &rows].map(|tiles| tiles.iter().max().map_or(1, |last| last + 1));
        let (bw, bh) = (exemplar.w.div_ceil(BIN), exemplar.h.div_ceil(BIN));
        let bins = bw * bh;
        let gaussian = Gaussian::new(region.h);
        // A bin that is used once is not overused, however small the tile.
        let once = (BIN * BIN) as f32 / (region.h * region.h) as f32;
        let mut factors = vec![0.0; across * down * bins];
        factors.par_chunks_mut(bins * across).enumerate().for_each(|(tile_row, factors)| {
            for y in (0..h).filter(|&y| rows[y] == tile_row) {
                for (x, tile) in columns.iter().enumerate() {
                    factors[tile * bins + bin_of(y * w + x)] += 1.0;
                }
            }
            for counts in factors.chunks_exact_mut(bins) {
                let total: f32 = counts.iter().sum();
                let mean = (total / usable_bins.max(1) as f32).max(once);
                gaussian.smooth(counts, bw, bh, exemplar.wrap);
                for count in counts {
                    *count = 1.0 + even.amount * (*count / mean.max(1e-6) - 1.0).clamp(-0.25, 4.0);
                }
            }
        });
        Self { columns, rows, across, bins, factors, each: Vec::new() }
    }

    /// Counts the uses of a surface level. `seen` returns a pixel's bin and its footprint in exemplar pixels, which is
    /// its weight. Weights are rounded to whole numbers, so that sums do not depend on their order.
    pub fn of_surface(
        even: &EvenUse,
        exemplar: PixelPlane,
        usable_bins: usize,
        shown: &SurfaceUses<'_>,
        seen: impl Fn(usize) -> (usize, f32),
    ) -> Self {
        let (bw, bh) = (exemplar.w.div_ceil(BIN), exemplar.h.div_ceil(BIN));
        let bins = bw * bh;
        let mut counts = vec![0u32; shown.count * bins];
        for &site in shown.sites {
            let tile = shown.tiles.get(site as usize).copied().unwrap_or(0) as usize;
            let (bin, area) = seen(site as usize);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited just before")]
            let weight = (SHARES * area).round().clamp(1.0, 4096.0) as u32;
            let count = &mut counts[tile * bins + bin];
            *count = count.saturating_add(weight);
        }
        let gaussian = Gaussian::new(shown.h);
        let once = SHARES * (BIN * BIN) as f32 / (shown.h * shown.h) as f32;
        let mut factors: Vec<f32> = counts.iter().map(|count| *count as f32).collect();
        factors.par_chunks_mut(bins).for_each(|factors| {
            let total: f32 = factors.iter().sum();
            let mean = (total / usable_bins.max(1) as f32).max(once);
            gaussian.smooth(factors, bw, bh, exemplar.wrap);
            for count in factors {
                *count = 1.0 + even.amount * (*count / mean.max(1e-6) - 1.0).clamp(-0.25, 4.0);
            }
        });
        Self { columns: Vec::new(), rows: Vec::new(), across: 0, bins, factors, each: shown.tiles.to_vec() }
    }

    /// Crops the factors from the counted `region` to a `part` of it.
    pub fn keep(&mut self, region: &Region, part: &Region) {
        let sides = [part.plane.w, part.plane.h];
        for (d, tiles) in [&mut self.columns, &mut self.rows].into_iter().enumerate() {
            tiles.drain(..offset(part.start[d] - region.start[d]));
            tiles.truncate(sides[d]);
        }
    }

    /// Factors by bin, of the tile of a surface pixel.
    #[inline(always)]
    pub fn of_site(&self, pixel: usize) -> &[f32] {
        let tile = self.each.get(pixel).copied().unwrap_or(0) as usize;
        &self.factors[tile * self.bins..(tile + 1) * self.bins]
    }

    /// Factors by bin, of the tile of pixel (x, y).
    #[inline(always)]
    pub fn of(&self, x: usize, y: usize) -> &[f32] {
        let tile = self.rows[y] * self.across + self.columns[x];
        &self.factors[tile * self.bins..(tile + 1) * self.bins]
    }
}

/// A Gaussian over bins.
struct Gaussian {
    radius: i32,
    weights: Vec<f32>,
}

impl Gaussian {
    /// σ is the larger of 1.2 bins and 0.3 of the footprint of a pixel of spacing `h`.
    fn new(h: usize) -> Self {
        let sigma = (0.3 * (h as f32 / BIN as f32)).max(1.2);
        #[expect(clippy::cast_possible_truncation, reason = "a few bins")]
        let radius = (2.5 * sigma).ceil() as i32;
        let weight = |d: i32| crate::ground::math::exp(-(d * d) as f32 / (2.0 * sigma * sigma));
        let sum: f32 = (-radius..=radius).map(weight).sum();
        Self { radius, weights: (-radius..=radius).map(|d| weight(d) / sum).collect() }
    }

    fn smooth(&self, counts: &mut [f32], w: usize, h: usize, wrap: [bool; 2]) {
        let line = |n: usize, wrap: bool| -> Vec<usize> {
            (-self.radius..index(n) + self.radius).map(|k| mirrored(k, n, wrap)).collect()
        };
        let (across, down) = (line(w, wrap[0]), line(h, wrap[1]));
        let mut rows = vec![0.0f32; w * h];
        let mut padded = vec![0.0f32; across.len()];
        simd::dispatch(
            #[inline(always)]
            || {
                for (out, row) in rows.chunks_exact_mut(w).zip(counts.chunks_exact(w)) {
                    padded.iter_mut().zip(&across).for_each(|(v, from)| *v = row[*from]);
                    for (k, weight) in self.weights.iter().enumerate() {
                        out.iter_mut().zip(&padded[k..]).for_each(|(out, v)| *out += weight * v);
                    }
                }
                for (y, out) in counts.chunks_exact_mut(w).enumerate() {
                    out.fill(0.0);
                    for (from, weight) in down[y..].iter().zip(&self.weights) {
                        out.iter_mut().zip(&rows[from * w..(from + 1) * w]).for_each(|(out, v)| *out += weight * v);
                    }
                }
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(n: usize) -> PixelPlane {
        PixelPlane { w: n, h: n, wrap: [true; 2] }
    }

    #[test]
    fn keeps_cost_of_bins_used_once() {
        let exemplar = plane(128);
        let region = Region { h: 1, start: [0, 0], plane: plane(32), short: [0; 2] };
        let even = EvenUse { amount: 1.0, tile: None, halved: false };
        let count = |bin_of: &(dyn Fn(usize) -> usize + Sync)| Factors::count(&even, exemplar, 1024, &region, bin_of);
        let copied = count(&|p| bin(exemplar, 40 + p % 32, 40 + p / 32));
        let of = |factors: &Factors, x: usize, y: usize| factors.of(0, 0)[bin(exemplar, x, y)];
        for k in 0..8 {
            assert!(of(&copied, 40 + 4 * k, 40 + 4 * (7 - k)) <= 1.0 + 1e-5);
        }
        let twice = count(&|p| bin(exemplar, 40 + p % 16, 40 + p / 32));
        assert!(of(&twice, 48, 48) > 1.5);
        assert!((of(&twice, 100, 100) - 0.75).abs() < 1e-5);
    }

    #[test]
    fn smoothing_keeps_the_sum_at_every_level() {
        for h in [2, 16, 32, 128] {
            for wrap in [[true; 2], [false; 2], [true, false]] {
                let mut counts: Vec<f32> = (0..15 * 9u8).map(|k| f32::from(k % 7)).collect();
                let sum: f32 = counts.iter().sum();
                Gaussian::new(h).smooth(&mut counts, 15, 9, wrap);
                assert!((counts.iter().sum::<f32>() / sum - 1.0).abs() < 1e-4, "{h} {wrap:?}");
            }
        }
    }
}
