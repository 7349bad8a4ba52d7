//! A grid of the multigrid method: cells, links between neighbours, and the sweeps over them.
//!
//! The equation of a cell is diagonal · x − Σ link · neighbour = b. Rows have one more cell on each side: a copy of the
//! other end where the picture repeats, otherwise a cell without links. A cell outside of the mask has no links and a
//! diagonal of 1, so it stays 0.
use crate::ground::simd::{self, inlined};
use rayon::prelude::*;

/// Rows that one thread computes at a time.
const BAND: usize = 16;

/// A grid with its links.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) wrap: [bool; 2],
    /// Link of each cell with the next one to the right.
    pub(super) right: Vec<f32>,
    /// Link of each cell with the one below.
    pub(super) down: Vec<f32>,
    /// The sum of the links of a cell, and its link with the border.
    pub(super) diagonal: Vec<f32>,
}

/// A row of the cells and links that its equations read.
struct Row<'a> {
    above: &'a [f32],
    here: &'a [f32],
    below: &'a [f32],
    up: &'a [f32],
    down: &'a [f32],
    right: &'a [f32],
    diagonal: &'a [f32],
    b: &'a [f32],
}

impl Level {
    /// Values per row.
    pub(super) fn stride(&self) -> usize {
        self.width + 2
    }

    /// Values of all rows.
    pub(super) fn len(&self) -> usize {
        self.stride() * self.height
    }

    /// The row above and the one below.
    fn beside(&self, y: usize) -> [usize; 2] {
        [(y + self.height - 1) % self.height, (y + 1) % self.height]
    }

    fn row<'a>(&'a self, plane: &'a [f32], y: usize) -> &'a [f32] {
        &plane[y * self.stride()..(y + 1) * self.stride()]
    }

    /// Copies the ends of a row to the cells beside it.
    pub(super) fn close(&self, row: &mut [f32]) {
        if self.wrap[0] {
            (row[0], row[self.width + 1]) = (row[self.width], row[1]);
        }
    }

    /// Computes each row of `out` from the rows of `x` and `b`: `value` gets x, the sum over its links, the diagonal,
    /// b, and true if the cell is red.
    #[inline(always)]
    fn each(&self, x: &[f32], b: &[f32], out: &mut [f32], value: impl Fn(f32, f32, f32, f32, bool) -> f32 + Sync) {
        let stride = self.stride();
        out.par_chunks_mut(BAND * stride).enumerate().for_each(|(band, out)| {
            simd::dispatch(
                #[inline(always)]
                || {
                    for (y, out) in (band * BAND..).zip(out.chunks_exact_mut(stride)) {
                        let [above, below] = self.beside(y);
                        let row = Row {
                            above: self.row(x, above),
                            here: self.row(x, y),
                            below: self.row(x, below),
                            up: self.row(&self.down, above),
                            down: self.row(&self.down, y),
                            right: self.row(&self.right, y),
                            diagonal: self.row(&self.diagonal, y),
                            b: self.row(b, y),
                        };
                        compute(&row, &mut out[1..=self.width], y % 2 == 0, &value);
                        self.close(out);
                    }
                },
            );
        });
    }

    /// Solves the equations of the cells of one colour of a chessboard; the others are copied.
    pub(super) fn relax(&self, x: &[f32], b: &[f32], out: &mut [f32], red: bool) {
        let value = inlined(
            #[inline(always)]
            move |x: f32, sum: f32, diagonal: f32, b: f32, color: bool| {
                if color == red { (b + sum) / diagonal } else { x }
            },
        );
        self.each(x, b, out, value);
    }

    /// The same as [`relax`](Self::relax) of the red cells, if all of x is 0.
    pub(super) fn first(&self, b: &[f32], out: &mut [f32]) {
        let stride = self.stride();
        let rows = out.par_chunks_mut(stride).zip(b.par_chunks(stride).zip(self.diagonal.par_chunks(stride)));
        rows.enumerate().with_min_len(BAND).for_each(|(y, (out, (b, diagonal)))| {
            let cells = out[1..=self.width].iter_mut().zip(b[1..].iter().zip(&diagonal[1..]));
            for (x, (out, (b, diagonal))) in cells.enumerate() {
                *out = if (x + y) % 2 == 0 { b / diagonal } else { 0.0 };
            }
            self.close(out);
        });
    }

    /// Writes the residual `b` − A·`x`.
    pub(super) fn residual(&self, x: &[f32], b: &[f32], out: &mut [f32]) {
        let value = inlined(
            #[inline(always)]
            |x: f32, sum: f32, diagonal: f32, b: f32, _| (b + sum) - diagonal * x,
        );
        self.each(x, b, out, value);
    }

    /// The product of the matrix with `x`.
    pub(super) fn product(&self, x: &[f32], out: &mut [f32]) {
        let value = inlined(
            #[inline(always)]
            |x: f32, sum: f32, diagonal: f32, _, _| diagonal * x - sum,
        );
        self.each(x, x, out, value);
    }

    /// The grid of cells twice as large. Links of four cells with their neighbours are added. The factor ½ makes up for
    /// the larger distance.
    pub(super) fn coarser(&self) -> Self {
        let half = |n: usize| n.div_ceil(2);
        let (width, height) = (half(self.width), half(self.height));
        let empty = vec![0.0; (width + 2) * height];
        let mut coarse =
            Self { width, height, wrap: self.wrap, right: empty.clone(), down: empty.clone(), diagonal: empty };
        let (stride, fine) = (coarse.stride(), self.stride());
        let rows = coarse.right.par_chunks_mut(stride).zip(coarse.down.par_chunks_mut(stride));
        rows.zip(coarse.diagonal.par_chunks_mut(stride)).enumerate().for_each(|(y, ((right, down), border))| {
            let last = (2 * y + 1).min(self.height - 1);
            for fine_y in 2 * y..=last {
                let [above, _] = self.beside(fine_y);
                for fine_x in 0..self.width {
                    let (k, x) = (fine_y * fine + fine_x + 1, fine_x / 2 + 1);
                    let up = self.down[above * fine + fine_x + 1];
                    let own = self.right[k - 1] + self.right[k] + up + self.down[k];
                    border[x] += 0.5 * (self.diagonal[k] - own).max(0.0) * f32::from(u8::from(self.linked(k, own)));
                    if fine_x % 2 == 1 || fine_x + 1 == self.width {
                        right[x] += if width > 1 { 0.5 * self.right[k] } else { 0.0 };
                    }
                    if fine_y == last && height > 1 {
                        down[x] += 0.5 * self.down[k];
                    }
                }
            }
            if self.wrap[0] {
                right[0] = right[width];
            }
        });
        let (down, right) = (&coarse.down, &coarse.right);
        coarse.diagonal.par_chunks_mut(stride).enumerate().for_each(|(y, diagonal)| {
            let above = (y + height - 1) % height;
            for x in 1..=width {
                let k = y * stride + x;
                let sum = right[k - 1] + right[k] + down[above * stride + x] + down[k] + diagonal[x];
                diagonal[x] = if sum > 0.0 { sum } else { 1.0 };
            }
        });
        coarse
    }

    /// True if a cell lies inside of the mask: it has links, or a link with the border.
    fn linked(&self, k: usize, own: f32) -> bool {
        own > 0.0 || self.diagonal[k] != 1.0
    }
}

/// A row of results.
#[inline(always)]
fn compute(row: &Row<'_>, out: &mut [f32], even: bool, value: &impl Fn(f32, f32, f32, f32, bool) -> f32) {
    const BLOCK: usize = 64;
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let (from, n) = (block * BLOCK, out.len());
        let (west, here, east) = (&row.here[from..][..n], &row.here[from + 1..][..n], &row.here[from + 2..][..n]);
        let (north, south) = (&row.above[from + 1..][..n], &row.below[from + 1..][..n]);
        let (left, right) = (&row.right[from..][..n], &row.right[from + 1..][..n]);
        let (up, down) = (&row.up[from + 1..][..n], &row.down[from + 1..][..n]);
        let (diagonal, b) = (&row.diagonal[from + 1..][..n], &row.b[from + 1..][..n]);
        // A block of its own overlaps no input, which the compiler must know.
        let mut made = [0.0; BLOCK];
        for x in 0..n {
            let sum = (left[x] * west[x] + right[x] * east[x]) + (up[x] * north[x] + down[x] * south[x]);
            made[x] = value(here[x], sum, diagonal[x], b[x], (x % 2 == 0) == even);
        }
        out.copy_from_slice(&made[..n]);
    }
}
