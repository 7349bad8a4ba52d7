//! The constants of the springs of a grid, by rows: see [`super::grid`].

use super::rows::LANES;
use crate::ground::real::Real;
use std::ops::Range;

/// A constant of the springs of one direction, by the point where the spring starts.
pub(super) enum Table<T> {
    /// The same for all springs, stored as one row.
    Uniform(Vec<T>),
    /// Rows from the top.
    Each(Vec<T>),
}

impl<T: Real> Table<T> {
    /// Builds the table from values by link index, for rows of `nx` points.
    pub(super) fn new(values: &[T], numbers: &[u32], nx: usize) -> Self {
        let mut of_springs = numbers.iter().filter_map(|&id| values.get(id as usize));
        let first = of_springs.next().copied().unwrap_or_default();
        if of_springs.all(|v| *v == first) {
            return Self::Uniform(vec![first; nx.next_multiple_of(LANES)]);
        }
        let wide = nx.next_multiple_of(LANES);
        let mut rows = vec![T::default(); numbers.len() / nx * wide];
        for (row, numbers) in rows.chunks_exact_mut(wide).zip(numbers.chunks_exact(nx)) {
            fill(row, values, numbers);
        }
        Self::Each(rows)
    }

    /// Returns a row; rows are `n` long.
    #[inline(always)]
    pub(super) fn row(&self, row: usize, n: usize) -> &[T] {
        match self {
            Self::Uniform(row) => row,
            Self::Each(rows) => &rows[row * n..][..n],
        }
    }
}

/// Writes the values of springs to the points where they start, 0 where none does.
pub(super) fn fill<T: Real>(points: &mut [T], values: &[T], numbers: &[u32]) {
    for (value, &id) in points.iter_mut().zip(numbers) {
        *value = values.get(id as usize).copied().unwrap_or_default();
    }
}

/// A row of each of four directions. Array methods with closures would not be inlined into functions with the vector
/// instructions.
#[inline(always)]
pub(super) fn rows<T: Real>(tables: &[Table<T>], [a, b, c, d]: [usize; 4], row: usize, wide: usize) -> [&[T]; 4] {
    [tables[a].row(row, wide), tables[b].row(row, wide), tables[c].row(row, wide), tables[d].row(row, wide)]
}

/// A part of the constants of a direction; empty for directions that the lattice does not have.
#[inline(always)]
pub(super) fn part<'t, T>(of: &'t mut [T], range: &Range<usize>) -> &'t mut [T] {
    of.get_mut(range.clone()).unwrap_or_default()
}
