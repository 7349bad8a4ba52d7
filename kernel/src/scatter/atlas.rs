//! A picture and its reduced sizes, in a memory layout for interpolation.
//!
//! Each value is stored beside the one below it, so that the four values around a position are adjacent in memory. The
//! border of the picture is repeated once around it. Each size has upper bounds of its texels, which show without
//! interpolation that a stamp is hidden.
use crate::filter::sample::{Outside, Pyramid};

/// One size of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Columns.
    pub w: usize,
    /// Rows.
    pub h: usize,
    /// Offset of its values.
    start: usize,
    /// Offset of its bounds.
    peaks: usize,
}

/// Texels along the side of a cell of the bounds.
const CELL: usize = 2;

/// A bound holds for its cell and this number of cells around it; the second one is used where the first is too small.
const RINGS: [usize; 2] = [3, 4];

impl Level {
    /// Offset from one row to the next.
    #[inline(always)]
    pub(super) const fn stride(&self) -> usize {
        2 * (self.w + 2)
    }

    /// Offset of its values.
    #[inline(always)]
    pub(super) const fn start(&self) -> usize {
        self.start
    }

    /// Columns and rows of the bounds.
    const fn cells(&self) -> [usize; 2] {
        [self.w.div_ceil(CELL), self.h.div_ceil(CELL)]
    }

    /// Upper bound of the texels within `reach` texels of a position, in both directions; infinite if none is stored.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the picture")]
    pub(super) fn peak(&self, data: &[f32], at: [f32; 2], reach: f32) -> f32 {
        let Some(ring) = RINGS.iter().position(|ring| (ring * CELL) as f32 >= reach) else { return f32::INFINITY };
        let [w, h] = self.cells();
        let cell = |at: f32, n: usize| ((at * (1.0 / CELL as f32)).max(0.0) as usize).min(n - 1);
        data[self.peaks + (ring * h + cell(at[1], h)) * w + cell(at[0], w)]
    }

    /// Upper bound of all texels.
    #[inline(always)]
    pub(super) fn summit(&self, data: &[f32]) -> f32 {
        data[self.peaks + RINGS.len() * self.cells()[0] * self.cells()[1]]
    }

    /// Computes the bounds.
    fn bound(&self, data: &[f32], out: &mut [f32]) {
        let out = &mut out[self.peaks..];
        let ([w, h], mut columns) = (self.cells(), vec![0.0; self.cells()[0] * self.h]);
        let around =
            |cell: usize, ring: usize, n: usize| (cell.saturating_sub(ring) * CELL)..((cell + ring + 1) * CELL).min(n);
        for (ring, out) in RINGS.into_iter().zip(out.chunks_exact_mut(w * h)) {
            for (row, out) in data.chunks_exact(self.w).zip(columns.chunks_exact_mut(w)) {
                for (i, out) in out.iter_mut().enumerate() {
                    *out = row[around(i, ring, self.w)].iter().copied().fold(f32::NEG_INFINITY, f32::max);
                }
            }
            for (j, out) in out.chunks_exact_mut(w).enumerate() {
                out.fill(f32::NEG_INFINITY);
                for y in around(j, ring, self.h) {
                    for (out, v) in out.iter_mut().zip(&columns[y * w..]) {
                        *out = out.max(*v);
                    }
                }
            }
        }
        out[RINGS.len() * w * h] = data.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    }
}

/// Memory layout of the sizes of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    levels: Vec<Level>,
    len: usize,
}

impl Layout {
    /// The layout of a picture of `w` × `h` pixels, at least one each way.
    pub fn new(w: usize, h: usize) -> Self {
        let (mut levels, mut len) = (Vec::new(), 0);
        let (mut w, mut h) = (w.max(1), h.max(1));
        loop {
            let level = Level { w, h, start: len, peaks: len + 2 * (w + 2) * (h + 1) };
            len = level.peaks + RINGS.len() * level.cells()[0] * level.cells()[1] + 1;
            levels.push(level);
            if w.max(h) == 1 {
                return Self { levels, len };
            }
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
        }
    }

    /// Number of values.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns false: a layout is never empty.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The sizes, the largest first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Fills `out` with the layout of a picture of the first size.
    ///
    /// # Panics
    /// If `out` is shorter than [`len`](Self::len), or `data` has another size.
    pub fn build(&self, data: Vec<f32>, out: &mut [f32]) {
        let first = self.levels[0];
        let pyramid = Pyramid::new(data, first.w, first.h, [Outside::Clamp; 2]);
        for (k, level) in self.levels.iter().enumerate() {
            let (w, h, data) = pyramid.level(k);
            let at = |x: usize, y: usize| {
                let (x, y) = (x.saturating_sub(1).min(w - 1), y.saturating_sub(1).min(h - 1));
                data[y * w + x]
            };
            let rows = out[level.start..].chunks_exact_mut(level.stride());
            for (y, row) in rows.take(h + 1).enumerate() {
                for (x, pair) in row.chunks_exact_mut(2).enumerate() {
                    (pair[0], pair[1]) = (at(x, y), at(x, y + 1));
                }
            }
            level.bound(data, out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::window::index;

    #[test]
    fn four_neighbours_lie_side_by_side() {
        let layout = Layout::new(3, 2);
        assert_eq!(layout.levels().len(), 3);
        let mut out = vec![-1.0; layout.len()];
        layout.build(vec![0.0, 1.0, 2.0, 10.0, 11.0, 12.0], &mut out);
        let level = layout.levels()[0];
        // Row 1 is the first of the picture, column 2 its second.
        assert_eq!(out[level.stride() + 4..][..4], [1.0, 11.0, 2.0, 12.0]);
        assert_eq!(out[..4], [0.0, 0.0, 0.0, 0.0]);
        assert!(out.iter().all(|v| *v >= 0.0), "every value is filled in");
        let last = layout.levels()[2];
        assert_eq!((last.w, last.h), (1, 1));
        assert!((out[last.start] - 6.0).abs() < 1e-6, "the mean");
    }

    #[test]
    fn bounds_are_not_exceeded_and_not_far_away() {
        let (w, h) = (37, 23);
        let data: Vec<f32> = (0..w * h).map(|k| ((k * 7919) % 1009) as f32).collect();
        let layout = Layout::new(w, h);
        let mut out = vec![0.0; layout.len()];
        layout.build(data.clone(), &mut out);
        let level = layout.levels()[0];
        let largest = |x: i32, y: i32, reach: i32| {
            let near = |k: usize| {
                let (i, j) = (index(k % w), index(k / w));
                (i - x).abs() <= reach && (j - y).abs() <= reach
            };
            (0..w * h).filter(|k| near(*k)).map(|k| data[k]).fold(f32::NEG_INFINITY, f32::max)
        };
        for (x, y) in [(0, 0), (5, 8), (36, 22), (20, 11), (1, 21)] {
            for reach in [5, 6, 8] {
                let bound = level.peak(&out, [x as f32 + 0.5, y as f32 + 0.5], reach as f32);
                assert!(bound >= largest(x, y, reach) && bound <= largest(x, y, reach + 3), "{x} {y} {reach}");
            }
            assert_eq!(level.peak(&out, [x as f32, y as f32], 9.0), f32::INFINITY);
        }
    }
}
