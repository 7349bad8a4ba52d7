//! Windows on a sampling grid: where a tile lies, and views of planes that are larger than the tile.
//!
//! Pixels are addressed by their absolute index on the grid; index 0 is the first pixel of the canvas, and windows may
//! begin before it. A kernel that computes positions from absolute indices gives the same bits in every tile.

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// Column of the first pixel.
    pub x0: i32,
    /// Row of the first pixel.
    pub y0: i32,
    /// Width in pixels.
    pub w: usize,
    /// Height in pixels.
    pub h: usize,
}

impl Rect {
    /// The rectangle of `w` × `h` pixels whose first one is (`x0`, `y0`).
    #[inline]
    pub const fn new(x0: i32, y0: i32, w: usize, h: usize) -> Self {
        Self { x0, y0, w, h }
    }

    /// Number of pixels.
    #[inline]
    pub const fn area(&self) -> usize {
        self.w * self.h
    }

    /// The rectangle grown by a halo of `x` columns and `y` rows on every side.
    #[must_use]
    pub fn grow(&self, [x, y]: [usize; 2]) -> Self {
        Self { x0: self.x0 - index(x), y0: self.y0 - index(y), w: self.w + 2 * x, h: self.h + 2 * y }
    }

    /// Whether all of `other` lies inside.
    pub fn contains(&self, other: &Self) -> bool {
        self.x0 <= other.x0
            && self.y0 <= other.y0
            && self.x0 + index(self.w) >= other.x0 + index(other.w)
            && self.y0 + index(self.h) >= other.y0 + index(other.h)
    }
}

/// A size as a pixel index.
#[inline(always)]
pub(crate) fn index(n: usize) -> i32 {
    i32::try_from(n).expect("a window has fewer than 2^31 columns and rows")
}

/// A difference of pixel indices that is known not to be negative.
#[inline(always)]
pub(crate) fn offset(n: i32) -> usize {
    usize::try_from(n).expect("the window contains the pixel")
}

/// A window of the sampling grid with its place on the canvas.
///
/// The centre of pixel (i, j) lies at `origin + (i + ½, j + ½)·step` millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The pixels.
    pub rect: Rect,
    /// Where the corner of pixel (0, 0) lies, mm.
    pub origin: [f64; 2],
    /// Size of a pixel, mm.
    pub step: [f64; 2],
}

impl Frame {
    /// A window with the grid's corner at the canvas' corner.
    #[inline]
    pub const fn new(rect: Rect, step: [f64; 2]) -> Self {
        Self { rect, origin: [0.0, 0.0], step }
    }

    /// The centre of the pixel with absolute index (i, j), mm.
    #[inline(always)]
    pub fn center(&self, i: i32, j: i32) -> [f64; 2] {
        [self.origin[0] + (f64::from(i) + 0.5) * self.step[0], self.origin[1] + (f64::from(j) + 0.5) * self.step[1]]
    }
}

/// A read-only window of one plane.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    data: &'a [f32],
    rect: Rect,
    stride: usize,
}

impl<'a> View<'a> {
    /// Rows that follow each other without a gap.
    ///
    /// # Panics
    /// If `data` is shorter than the rectangle.
    #[inline]
    pub fn new(data: &'a [f32], rect: Rect) -> Self {
        Self::with_stride(data, rect, rect.w)
    }

    /// Rows that begin every `stride` values.
    ///
    /// # Panics
    /// If `data` is shorter than the rectangle or `stride` smaller than its width.
    pub fn with_stride(data: &'a [f32], rect: Rect, stride: usize) -> Self {
        assert!(stride >= rect.w && (rect.h == 0 || data.len() >= (rect.h - 1) * stride + rect.w), "plane too small");
        Self { data, rect, stride }
    }

    /// The pixels covered.
    #[inline]
    pub const fn rect(&self) -> Rect {
        self.rect
    }

    /// Row `y` (absolute), from column `x` (absolute), `n` pixels.
    #[inline(always)]
    pub fn row(&self, y: i32, x: i32, n: usize) -> &'a [f32] {
        let start = offset(y - self.rect.y0) * self.stride + offset(x - self.rect.x0);
        &self.data[start..start + n]
    }

    /// The values, and the distance from one row to the next.
    #[inline(always)]
    pub(crate) const fn raw(&self) -> (&'a [f32], usize) {
        (self.data, self.stride)
    }

    /// One pixel (absolute index), which must lie inside.
    #[inline(always)]
    pub fn at(&self, x: i32, y: i32) -> f32 {
        self.data[offset(y - self.rect.y0) * self.stride + offset(x - self.rect.x0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_by_absolute_index() {
        let data: Vec<f32> = (0..20u8).map(f32::from).collect();
        let view = View::new(&data, Rect::new(-1, -2, 5, 4));
        assert_eq!(view.row(0, 1, 2), [12.0, 13.0]);
        assert_eq!(view.at(-1, -2), 0.0);
        assert!(view.rect().contains(&Rect::new(0, -1, 3, 2).grow([1, 1])));
        assert!(!view.rect().contains(&Rect::new(0, -1, 3, 2).grow([2, 1])));
    }
}
