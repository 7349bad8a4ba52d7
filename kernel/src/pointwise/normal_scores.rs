//! Maps values to a normal distribution, and back.
//!
//! Blending several samples of a texture loses contrast. For values that are normally distributed with mean 0 and
//! variance 1, a weighted sum divided by the root of the sum of squared weights has the same distribution. So values
//! are mapped to that distribution before and mapped back afterwards (E. Heitz, F. Neyret, "High-performance by-example
//! noise using a histogram-preserving blending operator", 2018). Colours are rotated so that their channels are
//! uncorrelated (principal axes).

use super::histogram::{Transfer, normal_quantiles, quantiles};

/// The map from the values of one texture to the normal distribution.
#[derive(Clone, Debug)]
pub struct NormalScores {
    mean: [f32; 3],
    /// The principal axes, one in each row.
    axes: [[f32; 3]; 3],
    there: Vec<Transfer>,
    back: Vec<Transfer>,
}

/// Number of matched quantiles.
const QUANTILES: usize = 1024;

impl NormalScores {
    /// For a texture with these values: one plane, or three of equal length.
    ///
    /// # Panics
    /// If there is another number of planes, or planes are empty.
    pub fn of(planes: &[&[f32]]) -> Self {
        assert!(matches!(planes.len(), 1 | 3) && !planes[0].is_empty(), "one plane or three, with values");
        let (mean, axes) =
            if planes.len() == 3 { principal([planes[0], planes[1], planes[2]]) } else { ([0.0; 3], UNIT) };
        let (mut there, mut back) = (Vec::new(), Vec::new());
        for axis in axes.iter().take(planes.len()) {
            let mut values: Vec<f32> = (0..planes[0].len())
                .map(|i| {
                    if planes.len() == 1 { planes[0][i] } else { dot(*axis, [0, 1, 2].map(|c| planes[c][i] - mean[c])) }
                })
                .collect();
            let (values, normal) = (quantiles(&mut values, QUANTILES), normal_quantiles(QUANTILES));
            there.push(Transfer::new(&values, &normal));
            back.push(Transfer::new(&normal, &values));
        }
        Self { mean, axes, there, back }
    }

    /// The scores of a value; for a texture with one channel only the first counts.
    #[inline]
    pub fn scores(&self, value: [f32; 3]) -> [f32; 3] {
        if self.there.len() == 1 {
            return [self.there[0].at(value[0]), 0.0, 0.0];
        }
        let off = [0, 1, 2].map(|c| value[c] - self.mean[c]);
        [0, 1, 2].map(|k| self.there[k].at(dot(self.axes[k], off)))
    }

    /// The value with these scores.
    #[inline]
    pub fn value(&self, scores: [f32; 3]) -> [f32; 3] {
        if self.back.len() == 1 {
            return [self.back[0].at(scores[0]), 0.0, 0.0];
        }
        let along = [0, 1, 2].map(|k| self.back[k].at(scores[k]));
        [0, 1, 2].map(|c| self.mean[c] + (0..3).map(|k| along[k] * self.axes[k][c]).sum::<f32>())
    }
}

const UNIT: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The mean and the principal axes, by Jacobi's rotations of the covariance.
#[expect(clippy::cast_possible_truncation, reason = "values are f32")]
fn principal(planes: [&[f32]; 3]) -> ([f32; 3], [[f32; 3]; 3]) {
    let n = planes[0].len() as f64;
    let mean = planes.map(|plane| plane.iter().map(|v| f64::from(*v)).sum::<f64>() / n);
    let mut m = [[0.0; 3]; 3];
    for ((r, g), b) in planes[0].iter().zip(planes[1]).zip(planes[2]) {
        let off = [f64::from(*r) - mean[0], f64::from(*g) - mean[1], f64::from(*b) - mean[2]];
        for (row, a) in m.iter_mut().zip(off) {
            row.iter_mut().zip(off).for_each(|(m, b)| *m += a * b / n);
        }
    }
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
            let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut m {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            for k in 0..3 {
                (m[p][k], m[q][k]) = (c * m[p][k] - s * m[q][k], s * m[p][k] + c * m[q][k]);
                (axes[p][k], axes[q][k]) = (c * axes[p][k] - s * axes[q][k], s * axes[p][k] + c * axes[q][k]);
            }
        }
    }
    (mean.map(|v| v as f32), axes.map(|row: [f64; 3]| row.map(|v| v as f32)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;

    /// Colours that are sums of three independent numbers, the first of them skewed, in perpendicular directions.
    fn colors() -> [Vec<f32>; 3] {
        let hash = Hash::new(11);
        let mut planes = [Vec::new(), Vec::new(), Vec::new()];
        for k in 0..20_000 {
            let t = hash.unit_f32(3 * k).powi(3);
            let (n, m) = (0.2 * hash.unit_f32(3 * k + 1), 0.05 * hash.unit_f32(3 * k + 2));
            let color = [t + 0.3 * n + 0.5 * m, 0.5 * t - 1.09 * m, 1.0 - 0.3 * t + n - 0.15 * m];
            planes.iter_mut().zip(color).for_each(|(plane, v)| plane.push(v));
        }
        planes
    }

    #[test]
    fn scores_are_normal_and_lead_back() {
        let planes = colors();
        let [a, b, c] = &planes;
        let scores = NormalScores::of(&[a, b, c]);
        let all: Vec<[f32; 3]> = (0..a.len()).map(|i| scores.scores([a[i], b[i], c[i]])).collect();
        for k in 0..3 {
            let moment = |p: i32| all.iter().map(|s| f64::from(s[k]).powi(p)).sum::<f64>() / all.len() as f64;
            assert!(moment(1).abs() < 0.01 && (moment(2) - 1.0).abs() < 0.02, "{k}: {} {}", moment(1), moment(2));
            // 3, minus the part beyond the outermost of 1025 quantiles: 2·∫ z⁴φ from 3.3 on.
            assert!((moment(4) - 2.85).abs() < 0.05, "{k}: {}", moment(4));
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let product = all.iter().map(|s| f64::from(s[p] * s[q])).sum::<f64>() / all.len() as f64;
            assert!(product.abs() < 0.05, "{p} {q}: {product}");
        }
        for i in (0..a.len()).step_by(97) {
            let back = scores.value(all[i]);
            assert!([a[i], b[i], c[i]].iter().zip(back).all(|(x, y)| (x - y).abs() < 2e-3));
        }
        let grey = NormalScores::of(&[a]);
        assert!((grey.value(grey.scores([a[5], 0.0, 0.0]))[0] - a[5]).abs() < 1e-3);
        let flat = NormalScores::of(&[&[2.0; 5], &[2.0; 5], &[2.0; 5]]);
        assert_eq!(flat.value(flat.scores([2.0; 3])), [2.0; 3]);
    }
}
