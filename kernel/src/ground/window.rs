//! Windows on a sampling grid: sizes of the engine's [`Window`] as lengths, the position of a tile, and views of planes
//! that are larger than the tile.
//!
//! Pixels are addressed by their absolute index on the grid. Index 0 is the first pixel of the canvas, and windows may
//! begin before it. A kernel that computes positions from absolute indices gives the same bits in every tile.

use super::number::index_u32;
use shibo_value::Window;

/// The eight immediate neighbours, in eighths of a turn from +x towards +y.
pub const OCTANTS: [[i32; 2]; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

/// The sizes of a [`Window`] as `usize`.
pub trait WindowExt {
    /// The window of `columns` × `rows` pixels whose first one is (`x`, `y`).
    fn of(x: i32, y: i32, columns: usize, rows: usize) -> Self;

    /// The number of columns.
    fn columns(&self) -> usize;

    /// The number of rows.
    fn rows(&self) -> usize;

    /// The window grown by a halo, `[columns, rows]` on every side, limited to the maximum of windows.
    #[must_use]
    fn with_halo(&self, halo: [usize; 2]) -> Self;
}

impl WindowExt for Window {
    #[inline]
    fn of(x: i32, y: i32, columns: usize, rows: usize) -> Self {
        Self { x, y, width: index_u32(columns), height: index_u32(rows) }
    }

    #[inline(always)]
    fn columns(&self) -> usize {
        self.width as usize
    }

    #[inline(always)]
    fn rows(&self) -> usize {
        self.height as usize
    }

    #[inline]
    fn with_halo(&self, [x, y]: [usize; 2]) -> Self {
        let count = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
        self.grow(count(x), count(y))
    }
}

/// A size as a pixel index.
#[inline(always)]
pub(crate) fn index(n: usize) -> i32 {
    i32::try_from(n).expect("a window has fewer than 2^31 columns and rows")
}

/// A difference of pixel indices that is known to be non-negative.
#[inline(always)]
pub(crate) fn offset(n: i32) -> usize {
    usize::try_from(n).expect("the window contains the pixel")
}

/// A window of the sampling grid with its position on the canvas: a [`Window`] counts only pixels, a frame also gives
/// positions in mm.
///
/// The centre of pixel (i, j) lies at `origin + (i + ½, j + ½)·step` millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The pixels.
    pub window: Window,
    /// The corner of pixel (0, 0), mm.
    pub origin: [f64; 2],
    /// Size of a pixel, mm.
    pub step: [f64; 2],
}

impl Frame {
    /// A window with the grid's corner at the canvas' corner.
    #[inline]
    pub const fn new(window: Window, step: [f64; 2]) -> Self {
        Self { window, origin: [0.0, 0.0], step }
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
    window: Window,
    stride: usize,
}

impl<'a> View<'a> {
    /// A view of contiguous rows.
    ///
    /// # Panics
    /// If `data` is shorter than the window.
    #[inline]
    pub fn new(data: &'a [f32], window: Window) -> Self {
        Self::with_stride(data, window, window.columns())
    }

    /// A view of rows that begin every `stride` values.
    ///
    /// # Panics
    /// If `data` is shorter than the window or `stride` smaller than its width.
    pub fn with_stride(data: &'a [f32], window: Window, stride: usize) -> Self {
        let (w, h) = (window.columns(), window.rows());
        assert!(stride >= w && (h == 0 || data.len() >= (h - 1) * stride + w), "plane too small");
        Self { data, window, stride }
    }

    /// The pixels covered.
    #[inline]
    pub const fn window(&self) -> Window {
        self.window
    }

    /// `n` pixels of a row, starting at the pixel (x, y) (absolute index).
    #[inline(always)]
    pub fn row(&self, x: i32, y: i32, n: usize) -> &'a [f32] {
        let start = offset(y - self.window.y) * self.stride + offset(x - self.window.x);
        &self.data[start..start + n]
    }

    /// Values, and the distance between rows.
    #[inline(always)]
    pub(crate) const fn raw(&self) -> (&'a [f32], usize) {
        (self.data, self.stride)
    }

    /// One pixel (absolute index), which must lie inside.
    #[inline(always)]
    pub fn at(&self, x: i32, y: i32) -> f32 {
        self.data[offset(y - self.window.y) * self.stride + offset(x - self.window.x)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_by_absolute_index() {
        let data: Vec<f32> = (0..20u8).map(f32::from).collect();
        let view = View::new(&data, Window::of(-1, -2, 5, 4));
        assert_eq!(view.row(1, 0, 2), [12.0, 13.0]);
        assert_eq!(view.at(-1, -2), 0.0);
        assert!(view.window().contains(&Window::of(0, -1, 3, 2).with_halo([1, 1])));
        assert!(!view.window().contains(&Window::of(0, -1, 3, 2).with_halo([2, 1])));
    }
}
