//! A picture and its halves, laid out for reading between pixels.
//!
//! Each value is kept beside the one below it, so that the four that surround a place are next to each other in memory; around
//! the picture its border is repeated once.
use crate::filter::sample::{Outside, Pyramid};

/// One size of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Columns.
    pub w: usize,
    /// Rows.
    pub h: usize,
    /// Where it begins.
    start: usize,
}

impl Level {
    /// Values from one row to the next.
    #[inline(always)]
    pub(super) const fn stride(&self) -> usize {
        2 * (self.w + 2)
    }

    /// Where it begins.
    #[inline(always)]
    pub(super) const fn start(&self) -> usize {
        self.start
    }
}

/// Where the sizes of a picture lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    levels: Vec<Level>,
    len: usize,
}

impl Layout {
    /// Of a picture of `w` × `h` pixels, at least one each way.
    pub fn new(w: usize, h: usize) -> Self {
        let (mut levels, mut len) = (Vec::new(), 0);
        let (mut w, mut h) = (w.max(1), h.max(1));
        loop {
            levels.push(Level { w, h, start: len });
            len += 2 * (w + 2) * (h + 1);
            if w.max(h) == 1 {
                return Self { levels, len };
            }
            (w, h) = (w.div_ceil(2), h.div_ceil(2));
        }
    }

    /// How many values it takes.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Never.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The sizes, the largest first.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Lays out a picture of the first size.
    ///
    /// # Panics
    /// If `out` is shorter than [`len`](Self::len), or `data` is no such picture.
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
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!((out[layout.len() - 1] - 6.0).abs() < 1e-6, "the mean");
    }
}
