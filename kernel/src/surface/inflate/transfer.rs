//! Transfer between grids: linear interpolation to the finer one, and its transpose to the coarser one.
use super::level::Level;
use rayon::prelude::*;

/// The two coarse cells that a fine cell reads, and their weights.
type Pair = [(usize, f32); 2];

/// The pairs of an axis with `fine` cells.
fn pairs(fine: usize, wrap: bool) -> Vec<Pair> {
    let coarse = fine.div_ceil(2);
    let pair = |cell: usize| {
        let own = cell / 2;
        let other = match (cell % 2 == 1, wrap) {
            (true, true) => (own + 1) % coarse,
            (true, false) => (own + 1).min(coarse - 1),
            (false, true) => (own + coarse - 1) % coarse,
            (false, false) => own.saturating_sub(1),
        };
        [(own, 0.75), (other, 0.25)]
    };
    (0..fine).map(pair).collect()
}

/// The fine cells that read each coarse cell.
fn readers(pairs: &[Pair]) -> Vec<Vec<(usize, f32)>> {
    let mut readers = vec![Vec::with_capacity(6); pairs.len().div_ceil(2)];
    for (fine, pair) in pairs.iter().enumerate() {
        pair.iter().for_each(|(coarse, weight)| readers[*coarse].push((fine, *weight)));
    }
    readers
}

/// The transfer between a grid and the next coarser one.
#[derive(Clone, Debug)]
pub(super) struct Transfer {
    columns: Vec<Pair>,
    rows: Vec<Pair>,
    column_readers: Vec<Vec<(usize, f32)>>,
    row_readers: Vec<Vec<(usize, f32)>>,
}

impl Transfer {
    /// The transfer from `fine` on.
    pub(super) fn new(fine: &Level) -> Self {
        let (columns, rows) = (pairs(fine.width, fine.wrap[0]), pairs(fine.height, fine.wrap[1]));
        let (column_readers, row_readers) = (readers(&columns), readers(&rows));
        Self { columns, rows, column_readers, row_readers }
    }

    /// Adds the interpolated values of the coarse grid to the fine one.
    pub(super) fn refine(&self, coarse: &Level, from: &[f32], fine: &Level, to: &mut [f32]) {
        let wide = coarse.stride();
        to.par_chunks_mut(fine.stride()).enumerate().for_each_init(
            || vec![0.0; wide],
            |line, (y, to)| {
                let [(a, p), (b, q)] = self.rows[y];
                let (a, b) = (&from[a * wide..(a + 1) * wide], &from[b * wide..(b + 1) * wide]);
                line.iter_mut().zip(a.iter().zip(b)).for_each(|(v, (a, b))| *v = p * a + q * b);
                for (to, [(a, p), (b, q)]) in to[1..].iter_mut().zip(&self.columns) {
                    *to += p * line[a + 1] + q * line[b + 1];
                }
                fine.close(to);
            },
        );
    }

    /// The transpose of the interpolation: each coarse value is the sum over the fine cells that read it.
    pub(super) fn coarsen(&self, fine: &Level, from: &[f32], coarse: &Level, to: &mut [f32]) {
        let wide = fine.stride();
        to.par_chunks_mut(coarse.stride()).zip(&self.row_readers).for_each_init(
            || vec![0.0; wide],
            |line, (to, readers)| {
                line.fill(0.0);
                for (y, weight) in readers {
                    let row = &from[y * wide..(y + 1) * wide];
                    line.iter_mut().zip(row).for_each(|(sum, v)| *sum += weight * v);
                }
                for (to, readers) in to[1..].iter_mut().zip(&self.column_readers) {
                    *to = readers.iter().fold(0.0, |sum, (x, weight)| sum + weight * line[x + 1]);
                }
                coarse.close(to);
            },
        );
    }
}
