//! Minimises a cheap function: CMA-ES (N. Hansen, 2016) with a Cholesky factor in place of eigenvectors.
use crate::linear::Matrix;
use crate::random::Random;

/// The effort of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    pub(crate) population: usize,
    pub(crate) generations: usize,
    /// Deviation of the first points.
    pub(crate) spread: f64,
}

/// The smallest value found from a start, and its point.
pub(crate) fn minimise(
    start: &[f64],
    effort: Effort,
    random: &mut Random,
    value: &mut dyn FnMut(&[f64]) -> f64,
) -> (f64, Vec<f64>) {
    let n = start.len();
    let size = n.max(1) as f64;
    let parents = (effort.population / 2).max(1);
    let raw: Vec<f64> = (0..parents).map(|k| libm::log(parents as f64 + 0.5) - libm::log(k as f64 + 1.0)).collect();
    let sum: f64 = raw.iter().sum();
    let weights: Vec<f64> = raw.iter().map(|weight| weight / sum).collect();
    let mass = 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>();
    let step_rate = (mass + 2.0) / (size + mass + 5.0);
    let damping = 1.0 + step_rate + 2.0 * (((mass - 1.0) / (size + 1.0)).sqrt() - 1.0).max(0.0);
    let path_rate = (4.0 + mass / size) / (size + 4.0 + 2.0 * mass / size);
    let one_rate = 2.0 / ((size + 1.3) * (size + 1.3) + mass);
    let all_rate =
        (2.0 * (mass - 2.0 + 1.0 / mass) / ((size + 2.0) * (size + 2.0) + mass)).max(0.0).min(1.0 - one_rate);
    let expected = size.sqrt() * (1.0 - 1.0 / (4.0 * size) + 1.0 / (21.0 * size * size));

    let (mut mean, mut spread) = (start.to_vec(), effort.spread);
    let (mut step_path, mut path) = (vec![0.0; n], vec![0.0; n]);
    let mut covariance = Matrix::diagonal(n, 1.0);
    let mut best = (value(start), start.to_vec());
    for generation in 0..effort.generations {
        let lower = covariance.cholesky();
        let mut drawn: Vec<(f64, Vec<f64>, Vec<f64>)> = (0..effort.population)
            .map(|_| {
                let z: Vec<f64> = (0..n).map(|_| random.normal()).collect();
                let y = lower.times(&z);
                let point: Vec<f64> = mean.iter().zip(&y).map(|(mean, y)| mean + spread * y).collect();
                let found = value(&point);
                if found < best.0 {
                    best = (found, point);
                }
                (found, z, y)
            })
            .collect();
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut z, mut y) = (vec![0.0; n], vec![0.0; n]);
        for (weight, (_, one_z, one_y)) in weights.iter().zip(&drawn) {
            z.iter_mut().zip(one_z).for_each(|(sum, value)| *sum += weight * value);
            y.iter_mut().zip(one_y).for_each(|(sum, value)| *sum += weight * value);
        }
        mean.iter_mut().zip(&y).for_each(|(mean, y)| *mean += spread * y);
        let gain = (step_rate * (2.0 - step_rate) * mass).sqrt();
        step_path.iter_mut().zip(&z).for_each(|(path, z)| *path = (1.0 - step_rate) * *path + gain * z);
        let length = step_path.iter().map(|value| value * value).sum::<f64>().sqrt();
        let settled = 1.0 - libm::pow(1.0 - step_rate, 2.0 * (generation as f64 + 1.0));
        let moving = length / settled.sqrt() < (1.4 + 2.0 / (size + 1.0)) * expected;
        let gain = if moving { (path_rate * (2.0 - path_rate) * mass).sqrt() } else { 0.0 };
        path.iter_mut().zip(&y).for_each(|(path, y)| *path = (1.0 - path_rate) * *path + gain * y);
        let kept = if moving { 0.0 } else { path_rate * (2.0 - path_rate) };
        for i in 0..n {
            for j in 0..n {
                let ranked: f64 = weights.iter().zip(&drawn).map(|(weight, (_, _, y))| weight * y[i] * y[j]).sum();
                let old = covariance.at(i, j);
                *covariance.at_mut(i, j) =
                    (1.0 - one_rate - all_rate) * old + one_rate * (path[i] * path[j] + kept * old) + all_rate * ranked;
            }
        }
        spread *= libm::exp((step_rate / damping * (length / expected - 1.0)).min(1.0));
        if spread < 1e-5 {
            break;
        }
        spread = spread.min(1.0);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_minimum_of_a_long_valley() {
        let mut random = Random::new(1, 1);
        let mut valley = |x: &[f64]| -> f64 {
            let lean = x[0] + x[1] - 1.0;
            100.0 * lean * lean
                + (x[0] - 0.3) * (x[0] - 0.3)
                + x[2..].iter().map(|v| (v - 0.7) * (v - 0.7)).sum::<f64>()
        };
        let effort = Effort { population: 24, generations: 120, spread: 0.2 };
        let (value, point) = minimise(&[0.5; 6], effort, &mut random, &mut valley);
        assert!(value < 1e-5 && (point[0] - 0.3).abs() < 0.01 && (point[1] - 0.7).abs() < 0.01, "{value} {point:?}");
    }
}
