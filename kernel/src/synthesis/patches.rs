//! Patches around each exemplar pixel of a level, for comparison with patches of a result.
use super::candidates::narrow;
use super::pca::principal;
use super::plane::PixelPlane;
use super::region::Region;
use super::table::Table;
use super::texels::{Texels, mirrored};
use crate::ground::window::{index, offset};

/// The compared values of a pixel: its channels or, if there are more than four, their principal components; quantised
/// to steps.
pub(super) type Shade = [i16; 4];

/// Largest absolute value of a [`Shade`]: sums over a patch of 7×7 pixels then fit 32 bits.
const MOST: f32 = 1600.0;

/// The most pixels on a side of a patch.
pub(super) const SIDE: usize = 7;

/// A patch of the result: its rows, each padded to a whole number of vectors. The padding is not compared.
pub(super) type ShownPatch = [[i16; 32]; SIDE];

/// Factor on the distance of patches that reach beyond the exemplar.
const BEYOND: f32 = 1.5;

/// A level's picture, padded so that every patch that a neighbour predicts can be read whole. Pixels at multiples of
/// the spacing from each other are stored side by side: one grid for each of the `h`² offsets.
pub(super) struct Patches {
    /// Reach of a patch, in pixels of the level.
    pub(super) reach: usize,
    /// The logarithm of the spacing in finest pixels.
    log: u32,
    /// Columns of a grid (`stride`), and its pixels (`cells`).
    stride: usize,
    cells: usize,
    pad: usize,
    /// Squared difference of two pixels that differ by one step.
    unit: f32,
    shades: Vec<Shade>,
    /// Factor on the distance of each patch; infinite for pixels that must not be shown.
    worth: Vec<f32>,
    /// Index in the level's tables; in the padding, the one of the border.
    known: Vec<u32>,
    /// Bin of each pixel for counting uses.
    bins: Vec<u32>,
    /// Wrapped index of each pixel; empty if no side wraps.
    home: Vec<u32>,
}

impl Patches {
    /// Builds the patches of a level from its picture.
    pub(super) fn new(image: &Texels<f32>, table: &Table, reach: usize) -> Self {
        let PixelPlane { w, h: rows, wrap } = image.plane;
        let (h, pad) = (table.h, 2 * reach);
        let (stride, lines) = (w.div_ceil(h) + 2 * pad, rows.div_ceil(h) + 2 * pad);
        let cells = stride * lines;
        let count = h * h * cells;
        let (shades, unit) = shades(image);
        let margin = index(reach * h);
        let whole = |k: i32, n: usize, wrap: bool| wrap || (margin..index(n) - margin).contains(&k);
        let mut made = Self {
            reach,
            log: h.ilog2(),
            stride,
            cells,
            pad,
            unit,
            shades: Vec::with_capacity(count),
            worth: Vec::with_capacity(count),
            known: Vec::with_capacity(count),
            bins: Vec::with_capacity(count),
            home: Vec::new(),
        };
        for p in 0..count {
            let [x, y] = made.place(p);
            made.shades.push(shades[mirrored(y, rows, wrap[1]) * w + mirrored(x, w, wrap[0])]);
            let at = table.at(image.plane.inside([x, y]));
            made.known.push(at);
            made.bins.push(narrow(table.bin_at(at)));
            made.worth.push(if !table.holds([x, y]) || !table.is_valid(at) {
                f32::INFINITY
            } else if whole(x, w, wrap[0]) && whole(y, rows, wrap[1]) {
                1.0
            } else {
                BEYOND
            });
        }
        if wrap != [false; 2] {
            made.home = (0..count).map(|p| made.at(image.plane.joined(made.place(p)))).collect();
        }
        made
    }

    fn place(&self, p: usize) -> [i32; 2] {
        let (grid, cell) = (p / self.cells, p % self.cells);
        let axis = |k: usize, first: usize| ((index(k) - index(self.pad)) << self.log) + index(first);
        let first = [grid & ((1 << self.log) - 1), grid >> self.log];
        [axis(cell % self.stride, first[0]), axis(cell / self.stride, first[1])]
    }

    /// The index of exemplar pixel (x, y), which may lie in the padding.
    #[inline(always)]
    pub(super) fn at(&self, [x, y]: [i32; 2]) -> u32 {
        let last = (1 << self.log) - 1;
        let grid = (offset(y & last) << self.log) + offset(x & last);
        let cell = |k: i32| offset((k >> self.log) + index(self.pad));
        narrow(grid * self.cells + cell(y) * self.stride + cell(x))
    }

    /// The exemplar pixel of an index.
    #[inline(always)]
    pub(super) fn pixel(&self, at: u32) -> [i32; 2] {
        self.place(at as usize)
    }

    /// Index of the same pixel in the level's tables.
    #[inline(always)]
    pub(super) fn known(&self, at: u32) -> u32 {
        self.known[at as usize]
    }

    /// Bin for counting uses.
    #[inline(always)]
    pub(super) fn bin(&self, at: u32) -> usize {
        self.bins[at as usize] as usize
    }

    /// Index difference for a step of (x, y) pixels of the level.
    #[inline(always)]
    pub(super) fn step(&self, x: i32, y: i32) -> u32 {
        (y * index(self.stride) + x).cast_unsigned()
    }

    /// Wraps an index of the padding to the inside.
    #[inline(always)]
    pub(super) fn home(&self, at: u32) -> u32 {
        if self.home.is_empty() { at } else { self.home[at as usize] }
    }

    /// Index that continues, at pixel (x, y), the neighbour at offset (dx, dy); `at` returns the neighbour's index.
    #[inline(always)]
    pub(super) fn continued(
        &self,
        region: &Region,
        [x, y]: [i32; 2],
        [dx, dy]: [i32; 2],
        at: impl Fn(usize) -> u32,
    ) -> u32 {
        let PixelPlane { w, h, wrap } = region.plane;
        let near = PixelPlane::bring(y + dy, h, wrap[1]) * w + PixelPlane::bring(x + dx, w, wrap[0]);
        // Across wrapping sides, the neighbour may be nearer than a whole pixel.
        let beyond = region.beyond(x + dx, y + dy);
        if beyond == [0, 0] {
            return self.home(at(near).wrapping_sub(self.step(dx, dy)));
        }
        let from = self.pixel(at(near));
        self.home(self.at([0, 1].map(|d| from[d] + beyond[d] - ([dx, dy][d] << self.log))))
    }

    /// Factor on the distance of the patch around an index; infinite if it must not be shown.
    #[inline(always)]
    pub(super) fn worth(&self, at: u32) -> f32 {
        self.worth[at as usize]
    }

    /// The compared values of a pixel.
    #[inline(always)]
    pub(super) fn shade(&self, at: u32) -> &Shade {
        &self.shades[at as usize]
    }

    /// Squared difference of two pixels that differ by one step in one number of a [`Shade`].
    #[inline(always)]
    pub(super) fn unit(&self) -> f32 {
        self.unit
    }

    /// Number of squared steps that make a squared difference of 1.
    #[inline(always)]
    pub(super) fn per_unit(&self) -> f32 {
        1.0 / self.unit
    }

    /// Squared distance, in steps, between the patch of `N`² pixels around an index and a `shown` patch. Stops after
    /// the first rows whose sum is above `most`. `L` is the padded length of a row, a whole number of vectors.
    #[inline(always)]
    pub(super) fn distance<const N: usize, const L: usize>(&self, shown: &[[i16; L]], at: u32, most: i32) -> i32 {
        let mask: [i16; L] = const { mask(N) };
        let mut first = at as usize - (N / 2) * (self.stride + 1);
        let mut sum = 0i32;
        for (k, row) in shown.iter().enumerate().take(N) {
            let own = self.shades[first..first + L / 4].as_flattened();
            let mut off = 0i32;
            for ((a, b), mask) in row.iter().zip(own).zip(&mask) {
                let d = i32::from(a.wrapping_sub(*b) & mask);
                off += d * d;
            }
            // A row fits 32 bits, and so do seven.
            sum = sum.saturating_add(off);
            if k & 1 == 1 && sum > most {
                break;
            }
            first += self.stride;
        }
        sum
    }
}

/// Mask of the numbers of a row that belong to a patch of `n` columns.
const fn mask<const L: usize>(n: usize) -> [i16; L] {
    let mut mask = [0; L];
    let mut k = 0;
    while k < 4 * n {
        mask[k] = -1;
        k += 1;
    }
    mask
}

/// The compared values of all pixels of a picture, and the squared difference of one step.
fn shades(image: &Texels<f32>) -> (Vec<Shade>, f32) {
    let pixels = image.data.chunks_exact(image.channels);
    let values: Vec<[f32; 4]> = if image.channels <= 4 {
        pixels.map(|v| std::array::from_fn(|c| v.get(c).copied().unwrap_or(0.0))).collect()
    } else {
        let matrix = principal(&image.data, image.channels, 4);
        let projected = |v: &[f32]| {
            let mut out = [0.0; 4];
            for (v, row) in v.iter().zip(&matrix) {
                out.iter_mut().zip(row).for_each(|(out, m)| *out += v * m);
            }
            out
        };
        pixels.map(projected).collect()
    };
    let most = values.as_flattened().iter().fold(0.0f32, |most, v| most.max(v.abs()));
    let scale = if most > 0.0 { MOST / most } else { 1.0 };
    #[expect(clippy::cast_possible_truncation, reason = "at most MOST")]
    let rounded = |v: &[f32; 4]| v.map(|v| (v * scale).round() as i16);
    (values.iter().map(rounded).collect(), 1.0 / (scale * scale))
}
