//! The integer grid of noise cells, of any size, stretch and angle, with an exact period of one canvas.
//!
//! The wanted cells have `size` mm, and are `aspect` times longer along `angle`. On a canvas that tiles, the canvas'
//! sides must be integer vectors of the grid: side x is A = (a, b) cells and side y is B = (c, d) cells, with integers
//! next to the wanted values (the rounding that best keeps the cells' shape). So a feature's size, aspect and angle
//! deviate by up to half a cell per canvas side; with ten or more cells on a side this is invisible. Where the canvas
//! does not tile, a side of at least 1024 cells and two canvases replaces it, so that the rounding is negligible.
//!
//! A cell (u, v) is identified by the integers `e = d·u - c·v` and `f = a·v - b·u` modulo the determinant D = ad - bc:
//! e/D and f/D are the cell's position on the canvas as fractions of the sides, and two cells have the same identifier
//! exactly if they are the same cell of the torus. The random key is linear in e and f, so inside the canvas (without a
//! wrap) it is linear in u and v and costs two products.

use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::window::Frame;
use glam::DVec2;
use shibo_value::Tiling;

/// Number of pixels evaluated at once. Runs of this length begin at absolute columns that are multiples of it, so
/// positions within a run are the same in every window.
pub const LANES: usize = 64;

/// Numbers 0, 1, 2 …, which are cheaper to load than to convert.
pub(crate) const RAMP: [f32; LANES] = {
    let mut ramp = [0.0; LANES];
    let mut k = 0;
    while k < LANES {
        ramp[k] = k as f32;
        k += 1;
    }
    ramp
};

/// The wanted size and direction of features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellShape {
    /// Extent across the long axis, mm, > 0.
    pub size: f64,
    /// Extent along the long axis divided by `size`, > 0.
    pub aspect: f64,
    /// Direction of the long axis, radians from +x towards +y.
    pub angle: f64,
}

impl CellShape {
    /// Round cells of `size` mm.
    pub const fn round(size: f64) -> Self {
        Self { size, aspect: 1.0, angle: 0.0 }
    }

    /// Rows (u, v) of the wanted map from mm to cells.
    pub(crate) fn wanted(&self) -> [[f64; 2]; 2] {
        let (sin, cos) = (libm::sin(self.angle), libm::cos(self.angle));
        let (along, across) = (1.0 / (self.size * self.aspect), 1.0 / self.size);
        [[cos * along, sin * along], [-sin * across, cos * across]]
    }
}

/// A periodic grid of cells with random words, in affine coordinates.
#[derive(Clone, Debug)]
pub struct CellGrid {
    /// Sides of the torus, mm.
    sides: [f64; 2],
    /// Cells per side: [[a, c], [b, d]].
    cells: [[i64; 2]; 2],
    /// Number of cells on the torus.
    count: i64,
    /// Map from mm to cells, and the offset in cells.
    to_cell: [[f64; 2]; 2],
    shift: [f64; 2],
    /// The multipliers of e and f, and the constant.
    keys: [u32; 3],
}

/// 1/√3.
const FRAC_1_SQRT_3: f64 = 0.577_350_269_189_625_8;

/// One over the side of an equilateral rhombus of area 1, (√3/2)^½.
const SIDE_INVERSE: f64 = 0.930_604_859_102_099_6;

/// Maps square cells of area 1 to rhombic cells of two equilateral triangles.
pub(super) const RHOMBIC: [[f64; 2]; 2] =
    [[SIDE_INVERSE, -SIDE_INVERSE * FRAC_1_SQRT_3], [0.0, 2.0 * SIDE_INVERSE * FRAC_1_SQRT_3]];

/// With more cells than this, identifiers and wraps would not fit into 32 bits.
const MOST_CELLS: f64 = 1e9;

impl CellGrid {
    /// The grid nearest to `shape` with a period of the canvas (its size in mm) in the directions in which that tiles.
    /// `None` if it has more than 10^9 cells, or if a number is not positive and finite.
    pub fn new(canvas: (DVec2, Tiling), shape: &CellShape, hash: Hash) -> Option<Self> {
        Self::turned(canvas, shape, 0.0, hash)
    }

    /// Like [`new`](Self::new), with the cells turned by an angle in radians before `shape` stretches and turns them.
    /// So features keep their size, stretch and direction, and only the grid under them is turned.
    pub fn turned(canvas: (DVec2, Tiling), shape: &CellShape, turn: f64, hash: Hash) -> Option<Self> {
        Self::of(canvas, shape, turned(shape.wanted(), turn), hash)
    }

    /// Like [`turned`](Self::turned), with rhombic cells of the same area: both halves of a cell are equilateral
    /// triangles if `shape` is round.
    pub fn triangular(canvas: (DVec2, Tiling), shape: &CellShape, turn: f64, hash: Hash) -> Option<Self> {
        let [u, v] = turned(shape.wanted(), turn);
        let wanted = RHOMBIC.map(|[by_u, by_v]| [0, 1].map(|k| by_u * u[k] + by_v * v[k]));
        Self::of(canvas, shape, wanted, hash)
    }

    fn of((size_mm, tiling): (DVec2, Tiling), shape: &CellShape, wanted: [[f64; 2]; 2], hash: Hash) -> Option<Self> {
        let longest = shape.size * shape.aspect.max(1.0);
        let side = |size: f64, tiles: bool| if tiles { size } else { (2.0 * size).max(1024.0 * longest) };
        let sides = [side(size_mm.x, tiling.x), side(size_mm.y, tiling.y)];
        let real =
            [[wanted[0][0] * sides[0], wanted[0][1] * sides[1]], [wanted[1][0] * sides[0], wanted[1][1] * sides[1]]];
        let det = real[0][0] * real[1][1] - real[0][1] * real[1][0];
        if !(det.is_finite() && det < MOST_CELLS && real.iter().flatten().all(|x| x.abs() < 1e9)) {
            return None;
        }
        let cells = nearest_cells(&real);
        let count = cells[0][0] * cells[1][1] - cells[0][1] * cells[1][0];
        let to_cell = cells.map(|row| [row[0] as f64 / sides[0], row[1] as f64 / sides[1]]);
        let shift = [hash.unit(0), hash.unit(1)];
        #[expect(clippy::cast_possible_truncation, reason = "32 random bits are wanted")]
        let keys = [hash.u64(2) as u32 | 1, hash.u64(3) as u32 | 1, hash.u64(4) as u32];
        Some(Self { sides, cells, count, to_cell, shift, keys })
    }

    /// Number of cells on the torus.
    pub const fn count(&self) -> i64 {
        self.count
    }

    /// Map from mm to cells, without the offset.
    pub const fn to_cell(&self) -> [[f64; 2]; 2] {
        self.to_cell
    }

    /// Map from cells to mm.
    pub fn to_mm(&self) -> [[f64; 2]; 2] {
        let [[a, b], [c, d]] = self.to_cell;
        let det = a * d - b * c;
        [[d / det, -b / det], [-c / det, a / det]]
    }

    /// A position on the torus in cells; the integer parts identify the cell.
    pub(crate) fn place(&self, p: [f64; 2]) -> [f64; 2] {
        let p = [0, 1].map(|k| p[k] - self.sides[k] * (p[k] / self.sides[k]).floor());
        [0, 1].map(|k| self.to_cell[k][0] * p[0] + self.to_cell[k][1] * p[1] + self.shift[k])
    }

    /// The random word of any cell.
    #[expect(clippy::cast_possible_truncation, reason = "remainders of at most 10^9")]
    pub(crate) fn word(&self, u: i64, v: i64) -> u32 {
        let [[a, c], [b, d]] = self.cells;
        let (e, f) = ((d * u - c * v).rem_euclid(self.count) as u32, (a * v - b * u).rem_euclid(self.count) as u32);
        let [p, q, constant] = self.keys;
        scramble(e.wrapping_mul(p).wrapping_add(f.wrapping_mul(q)).wrapping_add(constant))
    }

    /// Pixels per cell in the direction in which the cells are densest.
    pub fn pixels_per_cell(&self, step: [f64; 2]) -> f64 {
        let rate = |row: [f64; 2]| libm::hypot(row[0] * step[0], row[1] * step[1]);
        1.0 / rate(self.to_cell[0]).max(rate(self.to_cell[1]))
    }

    /// Like [`pixels_per_cell`](Self::pixels_per_cell), for a grid that is [turned](Self::turned) within a stretch.
    pub fn pixels_per_turned_cell(&self, step: [f64; 2]) -> f64 {
        let [a, b] = self.to_cell.map(|row| [row[0] * step[0], row[1] * step[1]]);
        let (squares, det) = (a[0] * a[0] + a[1] * a[1] + b[0] * b[0] + b[1] * b[1], a[0] * b[1] - a[1] * b[0]);
        // The larger singular value of the map from pixels to cells.
        let rest = (squares * squares - 4.0 * det * det).max(0.0).sqrt();
        1.0 / (0.5 * (squares + rest)).sqrt()
    }

    /// The run of [`LANES`] pixels that begins at column `x` (a multiple of [`LANES`]) of row `y`. Cells from
    /// `reach[0]` to `reach[1]` beside each pixel's own may be read.
    #[inline(always)]
    pub(crate) fn run(&self, frame: &Frame, x: i32, y: i32, reach: [i64; 2]) -> Run {
        let place = self.place(frame.center(x, y));
        let cell = place.map(f64::floor);
        #[expect(clippy::cast_possible_truncation, reason = "cells per side are below 2^31, fractions need 24 bits")]
        let (frac, rate, cell) = (
            [(place[0] - cell[0]) as f32, (place[1] - cell[1]) as f32],
            [0, 1].map(|k| (self.to_cell[k][0] * frame.step[0]) as f32),
            [cell[0] as i64, cell[1] as i64],
        );
        let [[a, c], [b, d]] = self.cells;
        let range = [0, 1].map(|k| {
            let end = frac[k] + rate[k] * (LANES - 1) as f32;
            #[expect(clippy::cast_possible_truncation, reason = "a run spans far fewer than 2^63 cells")]
            let (low, high) = (frac[k].min(end).floor() as i64, frac[k].max(end).floor() as i64);
            [low - 1 + reach[0], high + 1 + reach[1]]
        });
        let (e, e_span) = Name::new(d, -c, cell, range, self.count);
        let (f, f_span) = Name::new(-b, a, cell, range, self.count);
        let wrap = if e_span.max(f_span) <= self.count {
            Wrap::None
        } else if e_span.max(f_span) <= 4 * self.count {
            Wrap::Few
        } else {
            Wrap::Many
        };
        let [p, q, constant] = self.keys;
        let key = [
            p.wrapping_mul(e.by_u).wrapping_add(q.wrapping_mul(f.by_u)),
            p.wrapping_mul(e.by_v).wrapping_add(q.wrapping_mul(f.by_v)),
        ];
        let base = p.wrapping_mul(e.base).wrapping_add(q.wrapping_mul(f.base)).wrapping_add(constant);
        #[expect(clippy::cast_possible_truncation, reason = "at most 10^9 cells, a little more after the rounding")]
        #[expect(clippy::cast_sign_loss, reason = "the count is positive")]
        let count = self.count as u32;
        Run { frac, rate, e, f, count, keys: self.keys, key, base, wrap }
    }
}

/// The rows of a map to cells, with the cells turned by an angle in radians.
fn turned([u, v]: [[f64; 2]; 2], turn: f64) -> [[f64; 2]; 2] {
    if turn == 0.0 {
        return [u, v];
    }
    let (sin, cos) = (libm::sin(turn), libm::cos(turn));
    [[0, 1].map(|k: usize| cos * u[k] + sin * v[k]), [0, 1].map(|k: usize| cos * v[k] - sin * u[k])]
}

/// Range of the cell identifiers of a run, relative to 0..D.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wrap {
    /// Within 0..D.
    None,
    /// Below 4 D.
    Few,
    /// Larger: on a canvas of a few pixels.
    Many,
}

/// One of the two linear forms that identify a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Name {
    base: u32,
    by_u: u32,
    by_v: u32,
}

impl Name {
    /// The form `by_u·u + by_v·v` for cells `cell + range`, increased by a multiple of `count` so that no value is
    /// negative; also returns the largest value plus one.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "arithmetic modulo 2^32 is meant")]
    fn new(by_u: i64, by_v: i64, cell: [i64; 2], range: [[i64; 2]; 2], count: i64) -> (Self, i64) {
        let base = by_u * cell[0] + by_v * cell[1];
        let low = base + (by_u * range[0][0]).min(by_u * range[0][1]) + (by_v * range[1][0]).min(by_v * range[1][1]);
        let high = base + (by_u * range[0][0]).max(by_u * range[0][1]) + (by_v * range[1][0]).max(by_v * range[1][1]);
        let raise = if low >= 0 && high < count { 0 } else { -low.div_euclid(count) * count };
        (Self { base: (base + raise) as u32, by_u: by_u as u32, by_v: by_v as u32 }, high + raise + 1)
    }

    #[inline(always)]
    fn at(&self, u: i32, v: i32) -> u32 {
        self.base
            .wrapping_add(u.cast_unsigned().wrapping_mul(self.by_u))
            .wrapping_add(v.cast_unsigned().wrapping_mul(self.by_v))
    }
}

/// [`LANES`] pixels of a row in cell coordinates: pixel k lies at `frac + k·rate` cells from the run's own cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    pub(crate) frac: [f32; 2],
    pub(crate) rate: [f32; 2],
    e: Name,
    f: Name,
    count: u32,
    keys: [u32; 3],
    key: [u32; 2],
    base: u32,
    pub(crate) wrap: Wrap,
}

impl Run {
    /// Position in its cell of the pixel at `ramp` in the run, and the cell.
    #[inline(always)]
    pub(crate) fn place(&self, ramp: f32) -> (f32, f32, i32, i32) {
        let (u, v) = (self.frac[0] + ramp * self.rate[0], self.frac[1] + ramp * self.rate[1]);
        let ((fu, iu), (fv, iv)) = (math::floor_int(u), math::floor_int(v));
        (u - fu, v - fv, iu, iv)
    }

    /// The random word of cell (u, v), relative to the run's own cell. `WRAP` must be the run's [`Wrap`] as 0, 1, 2.
    #[inline(always)]
    pub(crate) fn word<const WRAP: u8>(&self, u: i32, v: i32) -> u32 {
        let key = if WRAP == 0 {
            self.base
                .wrapping_add(u.cast_unsigned().wrapping_mul(self.key[0]))
                .wrapping_add(v.cast_unsigned().wrapping_mul(self.key[1]))
        } else {
            let (e, f) = (self.e.at(u, v), self.f.at(u, v));
            let (e, f) = if WRAP == 1 {
                let twice = 2 * self.count;
                let once = |x: u32, by: u32| x.min(x.wrapping_sub(by));
                (once(once(e, twice), self.count), once(once(f, twice), self.count))
            } else {
                (e % self.count, f % self.count)
            };
            e.wrapping_mul(self.keys[0]).wrapping_add(f.wrapping_mul(self.keys[1])).wrapping_add(self.keys[2])
        };
        scramble(key)
    }
}

/// Mixes every bit of `x` into the upper bits of the result, with the two multipliers of `lowbias32` (C. Wellons).
#[inline(always)]
pub(crate) fn scramble(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    (x ^ (x >> 15)).wrapping_mul(0x846c_a68b)
}

/// The random word of cell (u, v) in the aperiodic noise identified by another word.
#[inline(always)]
pub(crate) fn key(word: u32, u: i32, v: i32) -> u32 {
    let by = |n: i32, factor: u32| n.cast_unsigned().wrapping_mul(factor);
    scramble(word.wrapping_add(by(u, 0x9e37_79b1)).wrapping_add(by(v, 0x85eb_ca77)))
}

/// The upper 23 bits of a word as a float in 0..1.
#[inline(always)]
pub(crate) fn upper_unit(word: u32) -> f32 {
    f32::from_bits((word >> 9) | 0x3f80_0000) - 1.0
}

/// The lower 23 bits of a word as a float in 0..1. Practically independent of [`upper_unit`] of the same word, because
/// their leading nine bits do not overlap.
#[inline(always)]
pub(crate) fn lower_unit(word: u32) -> f32 {
    f32::from_bits((word & 0x007f_ffff) | 0x3f80_0000) - 1.0
}

/// Value at (x, y) of a linear function with a random slope, within ±½ in x and in y, that is 0 at the origin.
#[inline(always)]
pub(crate) fn slope(word: u32, x: f32, y: f32) -> f32 {
    (upper_unit(word) - 0.5) * x + (lower_unit(word) - 0.5) * y
}

/// Integers near `real` with a positive determinant whose cells have the shape nearest to the wanted one.
fn nearest_cells(real: &[[f64; 2]; 2]) -> [[i64; 2]; 2] {
    let mut best = ([[1, 0], [0, 1]], f64::INFINITY);
    let rounded = real.map(|row| row.map(f64::round));
    for change in 0..625u32 {
        let delta = |k: u32| f64::from((change / 5u32.pow(k)) % 5) - 2.0;
        let n = [
            [rounded[0][0] + delta(0), rounded[0][1] + delta(1)],
            [rounded[1][0] + delta(2), rounded[1][1] + delta(3)],
        ];
        if n[0][0] * n[1][1] - n[0][1] * n[1][0] < 0.5 {
            continue;
        }
        let cost = distortion(&n, real) + distortion(real, &n);
        if cost < best.1 * (1.0 - 1e-9) {
            #[expect(clippy::cast_possible_truncation, reason = "integers below 10^9")]
            let cells = n.map(|row| row.map(|x| x as i64));
            best = (cells, cost);
        }
    }
    best.0
}

/// The squared norm of m·n⁻¹ - 1.
fn distortion(m: &[[f64; 2]; 2], n: &[[f64; 2]; 2]) -> f64 {
    let det = n[0][0] * n[1][1] - n[0][1] * n[1][0];
    let inverse = [[n[1][1] / det, -n[0][1] / det], [-n[1][0] / det, n[0][0] / det]];
    let product = |i: usize, j: usize| m[i][0] * inverse[0][j] + m[i][1] * inverse[1][j];
    (product(0, 0) - 1.0).powi(2) + product(0, 1).powi(2) + product(1, 0).powi(2) + (product(1, 1) - 1.0).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::window::WindowExt;
    use proptest::prelude::*;
    use shibo_value::Window;

    proptest! {
        #[test]
        fn cell_words_repeat_with_the_canvas(size in 0.5f64..80.0, aspect in 0.3f64..4.0, angle in -3.2f64..3.2, seed: u64) {
            let canvas = (DVec2::new(60.0, 45.0), Tiling::BOTH);
            let grid = CellGrid::new(canvas, &CellShape { size, aspect, angle }, Hash::new(seed)).unwrap();
            let [[a, c], [b, d]] = grid.cells;
            prop_assert!(grid.count() > 0);
            let frame = Frame::new(Window::of(0, 0, 64, 64), [60.0 / 256.0, 45.0 / 256.0]);
            let small = |n: i64| i32::try_from(n).unwrap();
            for (x, y) in [(0, 0), (64, 10), (192, 255)] {
                let run = grid.run(&frame, x, y, [0, 1]);
                for (u, v) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let word = run.word::<2>(u, v);
                    let place = grid.place(frame.center(x, y)).map(f64::floor);
                    #[expect(clippy::cast_possible_truncation, reason = "cells of a small canvas")]
                    let cell = place.map(|cell| cell as i64);
                    prop_assert_eq!(word, grid.word(cell[0] + i64::from(u), cell[1] + i64::from(v)));
                    if run.wrap == Wrap::None {
                        prop_assert_eq!(word, run.word::<0>(u, v));
                    }
                    if run.wrap != Wrap::Many {
                        prop_assert_eq!(word, run.word::<1>(u, v));
                    }
                }
                let e = |u: i64, v: i64| (d * u - c * v).rem_euclid(grid.count);
                prop_assert_eq!(e(3, 5), e(3 + a, 5 + b));
                prop_assert_eq!(e(3, 5), e(3 + c, 5 + d));
                prop_assert!(small(a).abs() < 1000);
            }
        }
    }

    #[test]
    fn cells_have_the_wanted_shape() {
        let canvas = (DVec2::splat(60.0), Tiling::BOTH);
        for (shape, tolerance) in [
            (CellShape { size: 2.0, aspect: 2.2, angle: 0.4 }, 0.06),
            (CellShape { size: 5.0, aspect: 2.5, angle: 0.44 }, 0.15),
            (CellShape::round(0.12), 0.002),
        ] {
            let grid = CellGrid::new(canvas, &shape, Hash::new(1)).unwrap();
            let wanted = shape.wanted();
            assert!(distortion(&grid.to_cell, &wanted).sqrt() < tolerance, "{:?}", grid.cells);
        }
        assert!(CellGrid::new(canvas, &CellShape::round(1e-4), Hash::new(1)).is_none());
        assert!(CellGrid::new(canvas, &CellShape::round(f64::NAN), Hash::new(1)).is_none());
    }
}
