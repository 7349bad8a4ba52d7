//! Symmetric matrices, by their Cholesky factor.

/// A square matrix, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Matrix {
    pub(crate) size: usize,
    pub(crate) values: Vec<f64>,
}

impl Matrix {
    pub(crate) fn zero(size: usize) -> Self {
        Self { size, values: vec![0.0; size * size] }
    }

    /// `diagonal` on the diagonal.
    pub(crate) fn diagonal(size: usize, diagonal: f64) -> Self {
        let mut matrix = Self::zero(size);
        (0..size).for_each(|k| *matrix.at_mut(k, k) = diagonal);
        matrix
    }

    pub(crate) fn at(&self, row: usize, column: usize) -> f64 {
        self.values[row * self.size + column]
    }

    pub(crate) fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.values[row * self.size + column]
    }

    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.size..][..self.size]
    }

    /// The lower Cholesky factor. A pivot that is not positive is raised to a small number.
    pub(crate) fn cholesky(&self) -> Self {
        let n = self.size;
        let mut lower = Self::zero(n);
        for i in 0..n {
            for j in 0..=i {
                let (a, b) = (&lower.values[i * n..][..j], &lower.values[j * n..][..j]);
                let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                let value = self.at(i, j) - sum;
                *lower.at_mut(i, j) = if i == j { value.max(1e-12).sqrt() } else { value / lower.at(j, j) };
            }
        }
        lower
    }

    /// The inverse of the matrix whose lower Cholesky factor this is.
    pub(crate) fn inverse_of_factor(&self) -> Self {
        let n = self.size;
        // The inverse of the factor, by columns: row `c` holds column `c`.
        let mut columns = Self::zero(n);
        for c in 0..n {
            for i in c..n {
                let start = f64::from(u8::from(i == c));
                let (a, b) = (&self.values[i * n + c..i * n + i], &columns.values[c * n + c..c * n + i]);
                let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                *columns.at_mut(c, i) = (start - sum) / self.at(i, i);
            }
        }
        let mut inverse = Self::zero(n);
        for i in 0..n {
            for j in 0..=i {
                let (a, b) = (&columns.row(i)[i..], &columns.row(j)[i..]);
                let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                *inverse.at_mut(i, j) = sum;
                *inverse.at_mut(j, i) = sum;
            }
        }
        inverse
    }

    /// The product with a vector.
    pub(crate) fn times(&self, vector: &[f64]) -> Vec<f64> {
        (0..self.size).map(|i| self.row(i).iter().zip(vector).map(|(a, b)| a * b).sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverts() {
        let n = 7;
        let mut matrix = Matrix::diagonal(n, 2.0);
        for i in 0..n {
            for j in 0..n {
                *matrix.at_mut(i, j) += 1.0 / (1.0 + (i + j) as f64);
            }
        }
        let inverse = matrix.cholesky().inverse_of_factor();
        for i in 0..n {
            let product = matrix.times(inverse.row(i));
            for (j, value) in product.iter().enumerate() {
                assert!((value - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j}: {value}");
            }
        }
    }
}
