//! Principal component analysis: the directions in which vectors vary most.
use crate::ground::hash::Hash;
use crate::ground::simd;

/// Number of dimensions kept.
pub const DIMS: usize = 8;

/// A linear map to [`DIMS`] numbers, one row per input.
pub type Projection = Vec<[f32; DIMS]>;

/// The map to the `dims` ≤ [`DIMS`] principal directions of `samples` of `n` numbers each; unused dimensions give 0.
///
/// Orthogonal iteration finds the leading space of the covariance. Directions are sorted by variance, and the largest
/// component of each is positive, so that equal samples give equal bits on every machine.
pub fn principal(samples: &[f32], n: usize, dims: usize) -> Projection {
    let covariance = covariance(samples, n);
    let dims = dims.min(DIMS).min(n);
    let hash = Hash::new(0x0050_4341);
    let mut basis: Vec<Vec<f64>> =
        (0..dims as u64).map(|d| (0..n as u64).map(|i| hash.unit(d * n as u64 + i) - 0.5).collect()).collect();
    orthonormalize(&mut basis);
    simd::dispatch(
        #[inline(always)]
        || {
            for _ in 0..24 {
                for vector in &mut basis {
                    *vector = multiply(&covariance, vector);
                }
                orthonormalize(&mut basis);
            }
        },
    );
    let mut order: Vec<(f64, Vec<f64>)> = basis
        .into_iter()
        .map(|vector| (multiply(&covariance, &vector).iter().zip(&vector).map(|(a, b)| a * b).sum(), vector))
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut projection = vec![[0.0; DIMS]; n];
    for (d, (variance, vector)) in order.into_iter().enumerate() {
        // Components without variance are left out: their direction would be random.
        if variance <= 1e-12 {
            continue;
        }
        let largest = vector.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        for (row, v) in projection.iter_mut().zip(vector) {
            #[expect(clippy::cast_possible_truncation, reason = "a unit vector's component")]
            let v = (v * largest.signum()) as f32;
            row[d] = v;
        }
    }
    projection
}

fn covariance(samples: &[f32], n: usize) -> Vec<Vec<f64>> {
    let count = samples.len() / n;
    let mut mean = vec![0.0f64; n];
    for sample in samples.chunks_exact(n) {
        mean.iter_mut().zip(sample).for_each(|(m, v)| *m += f64::from(*v));
    }
    #[expect(clippy::cast_possible_truncation, reason = "the mean of f32")]
    let mean: Vec<f32> = mean.iter().map(|m| (m / count.max(1) as f64) as f32).collect();
    let mut upper = vec![0.0f32; n * n];
    simd::dispatch(
        #[inline(always)]
        || {
            let mut centred = vec![0.0f32; n];
            for sample in samples.chunks_exact(n) {
                centred.iter_mut().zip(sample.iter().zip(&mean)).for_each(|(c, (v, m))| *c = v - m);
                for (i, row) in upper.chunks_exact_mut(n).enumerate() {
                    let a = centred[i];
                    row[i..].iter_mut().zip(&centred[i..]).for_each(|(r, c)| *r += a * c);
                }
            }
        },
    );
    let scale = 1.0 / count.max(1) as f64;
    (0..n).map(|i| (0..n).map(|j| f64::from(upper[i.min(j) * n + i.max(j)]) * scale).collect()).collect()
}

#[inline(always)]
fn multiply(matrix: &[Vec<f64>], vector: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, vector)).collect()
}

/// Keeps four partial sums, so that the loop vectorises.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a, b) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    for (a, b) in a.0.iter().zip(b.0) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    for ((sum, a), b) in sums.iter_mut().zip(a.1).zip(b.1) {
        *sum += a * b;
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

#[inline(always)]
fn orthonormalize(basis: &mut [Vec<f64>]) {
    for d in 0..basis.len() {
        for other in 0..d {
            let (before, rest) = basis.split_at_mut(d);
            let along = dot(&before[other], &rest[0]);
            rest[0].iter_mut().zip(&before[other]).for_each(|(v, b)| *v -= along * b);
        }
        let length = dot(&basis[d], &basis[d]).sqrt();
        let scale = if length > 1e-150 { 1.0 / length } else { 0.0 };
        basis[d].iter_mut().for_each(|v| *v *= scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_axes_of_a_cloud() {
        let hash = Hash::new(3);
        let (s, c) = (0.6f32, 0.8f32);
        let samples: Vec<f32> = (0..2000u64)
            .flat_map(|k| {
                let (a, b) = (hash.unit_f32(2 * k) * 4.0, hash.unit_f32(2 * k + 1) - 0.5);
                [c * a - s * b, s * a + c * b, 1.0]
            })
            .collect();
        let map = principal(&samples, 3, 2);
        assert!((map[0][0] - c).abs() < 0.02 && (map[1][0] - s).abs() < 0.02, "{map:?}");
        assert!((map[1][1] - c).abs() < 0.02 && map[2][0].abs() < 1e-6, "{map:?}");
        assert!(map.iter().all(|row| row[2..].iter().all(|v| *v == 0.0)));
        assert!(principal(&[0.5; 30], 3, 8).iter().flatten().all(|v| *v == 0.0));
    }
}
