//! The pixels of a stamp, one block at a time: their positions in its picture, and their coverage.
use super::atlas::Level;
use super::set::Stamp;
use crate::ground::math::{clamp, min};
use crate::ground::window::{Frame, index};
use glam::DVec2;

/// Side of a block in pixels.
pub(super) const SIDE: usize = 8;

/// Pixels in a block.
pub(super) const BLOCK: usize = SIDE * SIDE;

/// Offsets of the pixels in a row.
const COLUMNS: [f32; SIDE] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// 1.5·2^23: adding it to an integer below 2^22 in size leaves the integer in the low bits.
const SNAP: f32 = 12_582_912.0;

/// A value for each pixel of a block, row by row.
pub(super) type Values = [f32; BLOCK];

/// A block of pixels.
pub(super) struct Span {
    /// Offset of the four values around each pixel.
    base: [u32; BLOCK],
    u: Values,
    v: Values,
    /// Coverage of each pixel.
    pub(super) cover: Values,
    four: [[f32; 4]; BLOCK],
}

impl Span {
    pub(super) const fn new() -> Self {
        Self { base: [0; BLOCK], u: [0.0; BLOCK], v: [0.0; BLOCK], cover: [0.0; BLOCK], four: [[0.0; 4]; BLOCK] }
    }

    /// Interpolates a picture, in the layout of [`Layout`](super::atlas::Layout), at the pixels.
    #[inline(always)]
    pub(super) fn read(&mut self, data: &[f32], out: &mut Values) {
        for (four, base) in self.four.iter_mut().zip(&self.base) {
            let base = *base as usize;
            let at = &data[base..base + 4];
            *four = [at[0], at[1], at[2], at[3]];
        }
        for (k, out) in out.iter_mut().enumerate() {
            let ([a, b, c, d], u, v) = (self.four[k], self.u[k], self.v[k]);
            let (left, right) = (a + (b - a) * v, c + (d - c) * v);
            *out = left + (right - left) * u;
        }
    }
}

/// A stamp in the pixel coordinates of a grid.
pub(super) struct PlacedStamp {
    level: Level,
    /// The pixel that contains its middle, and the offset of the middle from that pixel's centre (`rest`).
    pixel: [i32; 2],
    rest: [f32; 2],
    /// Texels to the right and down in the picture, per pixel in x (`by_x`) and in y (`by_y`).
    by_x: [f32; 2],
    by_y: [f32; 2],
    /// Half the size of the picture, texels.
    half: [f32; 2],
    /// Pixels per texel, in both directions of the picture.
    scale: [f32; 2],
    /// Reach in pixels, in all directions.
    reach: i32,
}

impl PlacedStamp {
    /// A stamp shifted by `shift` mm, read from the most suitable size of the picture.
    #[expect(clippy::cast_possible_truncation, reason = "places within a stamp need no more than f32")]
    pub(super) fn new(stamp: &Stamp, shift: DVec2, levels: &[Level], frame: &Frame) -> Self {
        let step = DVec2::from(frame.step);
        let size = 2.0 * stamp.half.as_dvec2();
        let (cos, sin) = (f64::from(stamp.turn.x), f64::from(stamp.turn.y));
        // Pixels along the sides of the stamp.
        let pixel = (step.x * step.y).sqrt();
        let sides = size / pixel;
        let fine = |level: &Level| (level.w as f64 / sides.x).min(level.h as f64 / sides.y);
        let level =
            levels.iter().rev().find(|level| fine(level) >= std::f64::consts::FRAC_1_SQRT_2).unwrap_or(&levels[0]);
        let rate = DVec2::new(level.w as f64, level.h as f64) / size;
        let at = (stamp.center + shift - DVec2::from(frame.origin)) / step;
        let whole = at.floor();
        let reach = (size.length() * 0.5 / step.min_element()).ceil() as i32 + 2;
        Self {
            level: *level,
            pixel: whole.as_ivec2().to_array(),
            rest: (at - whole - 0.5).as_vec2().to_array(),
            by_x: [(cos * step.x * rate.x) as f32, (-sin * step.x * rate.y) as f32],
            by_y: [(sin * step.y * rate.x) as f32, (cos * step.y * rate.y) as f32],
            half: [level.w as f32 * 0.5, level.h as f32 * 0.5],
            scale: [(1.0 / (rate.x * pixel)) as f32, (1.0 / (rate.y * pixel)) as f32],
            reach,
        }
    }

    /// Rows and columns of the blocks that it may touch, counted from the corner of the window.
    pub(super) fn blocks(&self, frame: &Frame) -> [std::ops::Range<usize>; 2] {
        let rect = frame.window;
        let range = |k: usize, start: i32, length: u32| {
            let first = self.pixel[k].saturating_sub(self.reach).saturating_sub(start).max(0);
            let last = self.pixel[k].saturating_add(self.reach + 1).saturating_sub(start).min(length.cast_signed());
            let pixel = |n: i32| usize::try_from(n).unwrap_or(0);
            if first < last { pixel(first) / SIDE..pixel(last).div_ceil(SIDE) } else { 0..0 }
        };
        [range(1, rect.y, rect.height), range(0, rect.x, rect.width)]
    }

    /// Position of the middle of the block whose first pixel is (x, y), in texels.
    #[inline(always)]
    pub(super) fn middle(&self, x: i32, y: i32) -> [f32; 2] {
        let half = 0.5 * (SIDE - 1) as f32;
        let (dx, dy) =
            ((x - self.pixel[0]) as f32 + half - self.rest[0], (y - self.pixel[1]) as f32 + half - self.rest[1]);
        [0, 1].map(|k| self.by_x[k] * dx + (self.by_y[k] * dy + self.half[k]))
    }

    /// Maximum distance of a block's pixels from its middle, in texels.
    pub(super) fn reach(&self) -> [f32; 2] {
        // A thousandth more, for rounding.
        [0, 1].map(|k| (0.5 * (SIDE - 1) as f32 + 1e-3) * (self.by_x[k].abs() + self.by_y[k].abs()) + 1e-3)
    }

    /// Size of its picture, and width of its edge, in texels.
    pub(super) fn outline(&self) -> ([f32; 2], [f32; 2]) {
        ([0, 1].map(|k| 2.0 * self.half[k]), [0, 1].map(|k| 0.5 / self.scale[k]))
    }

    /// The size of the picture that is read.
    #[inline(always)]
    pub(super) const fn level(&self) -> &Level {
        &self.level
    }

    /// Computes the positions of the pixels of the block at (x, y).
    #[inline(always)]
    #[expect(clippy::cast_sign_loss, reason = "limited to the picture before")]
    pub(super) fn find(&self, x: i32, y: i32, span: &mut Span) {
        let start = (x - self.pixel[0]) as f32;
        let (w, h) = (2.0 * self.half[0], 2.0 * self.half[1]);
        let (stride, begin) = (index(self.level.stride()), index(self.level.start()));
        let int = |whole: f32| (whole + SNAP).to_bits().wrapping_sub(SNAP.to_bits()).cast_signed();
        for j in 0..SIDE {
            let dy = (y + index(j) - self.pixel[1]) as f32 - self.rest[1];
            let (row, column) = (self.by_y[0] * dy + self.half[0], self.by_y[1] * dy + self.half[1]);
            for (k, number) in (SIDE * j..).zip(COLUMNS) {
                // Add the integers first, so that a pixel has the same position in every block.
                let dx = (start + number) - self.rest[0];
                let (tx, ty) = (self.by_x[0] * dx + row, self.by_x[1] * dx + column);
                let across = clamp(min(tx, w - tx) * self.scale[0] + 0.5, 0.0, 1.0);
                let down = clamp(min(ty, h - ty) * self.scale[1] + 0.5, 0.0, 1.0);
                span.cover[k] = across * down;
                // Count from the centre of the texel before the first one.
                let (tx, ty) = (clamp(tx + 0.5, 0.0, w + 0.999), clamp(ty + 0.5, 0.0, h + 0.999));
                let (left, top) = (tx.floor(), ty.floor());
                span.u[k] = tx - left;
                span.v[k] = ty - top;
                span.base[k] = (begin + int(top) * stride + 2 * int(left)) as u32;
            }
        }
    }
}
