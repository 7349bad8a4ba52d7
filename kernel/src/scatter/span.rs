//! The pixels of a stamp, some of a row at a time: where they lie in its picture, and how much of each it covers.
use super::atlas::Level;
use super::set::Stamp;
use crate::ground::math::{clamp, floor_int, min};
use crate::ground::window::{Frame, index};
use glam::DVec2;

/// The most pixels at a time.
pub(super) const BLOCK: usize = 64;

/// Eight pixels are computed at once.
const LANES: usize = 8;

/// Some pixels of a row.
pub(super) struct Span {
    /// How many.
    pub(super) n: usize,
    /// Where the four values around each begin.
    base: [u32; BLOCK],
    u: [f32; BLOCK],
    v: [f32; BLOCK],
    /// How much of each pixel is covered.
    pub(super) cover: [f32; BLOCK],
    four: [[f32; 4]; BLOCK],
}

impl Span {
    pub(super) const fn new() -> Self {
        Self { n: 0, base: [0; BLOCK], u: [0.0; BLOCK], v: [0.0; BLOCK], cover: [0.0; BLOCK], four: [[0.0; 4]; BLOCK] }
    }

    /// The values of a picture, laid out by [`Layout`](super::atlas::Layout), at the pixels.
    #[inline(always)]
    pub(super) fn read(&mut self, data: &[f32], out: &mut [f32; BLOCK]) {
        for (four, base) in self.four[..self.n].iter_mut().zip(&self.base) {
            let at = &data[*base as usize..][..4];
            *four = [at[0], at[1], at[2], at[3]];
        }
        let n = self.n.next_multiple_of(LANES).min(BLOCK);
        for (k, out) in out[..n].iter_mut().enumerate() {
            let ([a, b, c, d], u, v) = (self.four[k], self.u[k], self.v[k]);
            let (left, right) = (a + (b - a) * v, c + (d - c) * v);
            *out = left + (right - left) * u;
        }
    }
}

/// A stamp in pixels of a grid.
pub(super) struct Placed {
    level: Level,
    /// The pixel that holds its middle, and the middle within it from the centre of that pixel.
    pixel: [i32; 2],
    rest: [f32; 2],
    /// Texels by which a step of a pixel in x and in y leads right and down in the picture.
    by_x: [f32; 2],
    by_y: [f32; 2],
    /// Half the picture, texels.
    half: [f32; 2],
    /// Pixels in a texel, in both directions of the picture.
    scale: [f32; 2],
    /// Pixels that it reaches up and down.
    reach: i32,
}

impl Placed {
    /// A stamp moved by `shift` mm, read from the best of the picture's sizes.
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
        let reach = (size.length() * 0.5 / step.y).ceil() as i32 + 2;
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

    /// The rows that it may touch.
    pub(super) fn rows(&self, frame: &Frame) -> std::ops::Range<i32> {
        let rect = frame.window;
        let (first, last) = (self.pixel[1].saturating_sub(self.reach), self.pixel[1].saturating_add(self.reach + 1));
        first.max(rect.y)..last.min(rect.y + rect.height.cast_signed())
    }

    /// The columns of row `y` that it may touch.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "clipped to the window")]
    pub(super) fn columns(&self, y: i32, frame: &Frame) -> std::ops::Range<i32> {
        let dy = (y - self.pixel[1]) as f32 - self.rest[1];
        let (mut low, mut high) = (-1e9f32, 1e9f32);
        for k in 0..2 {
            let (by, at) = (self.by_x[k], self.by_y[k] * dy);
            // Half a pixel more, for soft edges, and a little for rounding.
            let reach = self.half[k] + 0.55 / self.scale[k];
            let rate = if by.abs() > 1e-6 * self.half[k] { 1.0 / by } else { 0.0 };
            if rate == 0.0 {
                if at.abs() > reach {
                    return 0..0;
                }
                continue;
            }
            let (a, b) = ((-reach - at) * rate, (reach - at) * rate);
            (low, high) = (low.max(a.min(b)), high.min(a.max(b)));
        }
        if low > high {
            return 0..0;
        }
        let rect = frame.window;
        let middle = f64::from(self.pixel[0]) + f64::from(self.rest[0]);
        let (first, last) = ((f64::from(low) + middle).floor() as i32, (f64::from(high) + middle).ceil() as i32);
        first.max(rect.x)..last.saturating_add(1).min(rect.x + rect.width.cast_signed())
    }

    /// Finds where `n` pixels from (x, y) lie.
    #[inline(always)]
    #[expect(clippy::cast_sign_loss, reason = "limited to the picture before")]
    pub(super) fn find(&self, x: i32, y: i32, n: usize, span: &mut Span) {
        span.n = n;
        let dy = (y - self.pixel[1]) as f32 - self.rest[1];
        let (row, column) = (self.by_y[0] * dy + self.half[0], self.by_y[1] * dy + self.half[1]);
        let start = (x - self.pixel[0]) as f32;
        let (w, h) = (2.0 * self.half[0], 2.0 * self.half[1]);
        let (stride, begin) = (index(self.level.stride()), index(self.level.start()));
        for k in 0..n.next_multiple_of(LANES).min(BLOCK) {
            // Whole numbers first, so that a pixel has the same place whatever the run began with.
            let dx = (start + index_f32(k)) - self.rest[0];
            let (tx, ty) = (self.by_x[0] * dx + row, self.by_x[1] * dx + column);
            let across = clamp(min(tx, w - tx) * self.scale[0] + 0.5, 0.0, 1.0);
            let down = clamp(min(ty, h - ty) * self.scale[1] + 0.5, 0.0, 1.0);
            span.cover[k] = across * down;
            // From the centre of the texel before the first.
            let (tx, ty) = (clamp(tx + 0.5, 0.0, w + 0.999), clamp(ty + 0.5, 0.0, h + 0.999));
            let ((left, i), (top, j)) = (floor_int(tx), floor_int(ty));
            span.u[k] = tx - left;
            span.v[k] = ty - top;
            span.base[k] = (begin + j * stride + 2 * i) as u32;
        }
    }
}

#[inline(always)]
fn index_f32(k: usize) -> f32 {
    k as f32
}
