//! A model of the statistics: kernel ridge regression of all numbers at once. Samples have different seeds, so the model learns the
//! mean over seeds.
use crate::linear::Matrix;
use shibo_bridge::compare::Scale;

/// Lengths of the kernel, times the root of the number of coordinates; shares of its quadratic part; noise.
const LENGTHS: [f64; 3] = [0.3, 0.6, 1.2];
const QUADRATIC: [f64; 2] = [0.05, 0.5];
const NOISE: [f64; 3] = [0.003, 0.03, 0.2];

/// A sample of the model.
#[derive(Clone, Copy)]
pub(crate) struct Sample<'s> {
    pub(crate) features: &'s [f64],
    pub(crate) numbers: &'s [f64],
    /// The number of samples that it counts as.
    pub(crate) weight: f64,
}

/// The kernel.
#[derive(Clone, Copy, Debug)]
struct Kernel {
    length: f64,
    quadratic: f64,
}

impl Kernel {
    fn of(self, one: &[f64], other: &[f64]) -> f64 {
        let (mut product, mut apart) = (0.0, 0.0);
        for (a, b) in one.iter().zip(other) {
            product += a * b;
            apart += (a - b) * (a - b);
        }
        let near = libm::exp(-apart / (2.0 * self.length * self.length));
        0.3 + product + self.quadratic * product * product + near
    }
}

/// A model of the numbers as functions of the features.
pub(crate) struct Model {
    kernel: Kernel,
    features: Vec<Vec<f64>>,
    /// For each sample, the factor of the kernel for all numbers.
    factors: Vec<Vec<f64>>,
    mean: Vec<f64>,
    /// Loss of samples that were left out one by one.
    #[cfg(test)]
    pub(crate) left_out: f64,
}

impl Model {
    /// The model of samples, with the kernel and noise whose predictions of left-out samples are best. There must be a sample.
    pub(crate) fn of(samples: &[Sample<'_>], coordinates: usize, scale: &Scale) -> Self {
        let all: f64 = samples.iter().map(|sample| sample.weight).sum();
        let count = samples.first().map_or(0, |sample| sample.numbers.len());
        let mut mean = vec![0.0; count];
        for sample in samples {
            let share = sample.weight / all;
            mean.iter_mut().zip(sample.numbers).for_each(|(sum, number)| *sum += share * number);
        }
        let centred: Vec<Vec<f64>> =
            samples.iter().map(|sample| sample.numbers.iter().zip(&mean).map(|(a, b)| a - b).collect()).collect();
        let weights = scale.weights();
        let mut best: Option<(f64, Kernel, Vec<Vec<f64>>)> = None;
        for length in LENGTHS.map(|length| length * (coordinates.max(1) as f64).sqrt()) {
            for quadratic in QUADRATIC {
                let kernel = Kernel { length, quadratic };
                let matrix = matrix(kernel, samples);
                for noise in NOISE {
                    let mut noisy = matrix.clone();
                    for (k, sample) in samples.iter().enumerate() {
                        *noisy.at_mut(k, k) += noise / sample.weight;
                    }
                    let inverse = noisy.cholesky().inverse_of_factor();
                    let factors = times(&inverse, &centred, count);
                    let loss = left_out(samples, &inverse, &factors, scale, &weights);
                    if best.as_ref().is_none_or(|(least, ..)| loss < *least) {
                        best = Some((loss, kernel, factors));
                    }
                }
            }
        }
        let usual = (f64::INFINITY, Kernel { length: 1.0, quadratic: 0.05 }, vec![vec![0.0; count]; samples.len()]);
        let (_loss, kernel, factors) = best.unwrap_or(usual);
        Self {
            kernel,
            features: samples.iter().map(|s| s.features.to_vec()).collect(),
            factors,
            mean,
            #[cfg(test)]
            left_out: _loss,
        }
    }

    /// The predicted numbers.
    pub(crate) fn numbers(&self, features: &[f64]) -> Vec<f64> {
        let mut numbers = self.mean.clone();
        for (sample, factors) in self.features.iter().zip(&self.factors) {
            let kernel = self.kernel.of(sample, features);
            numbers.iter_mut().zip(factors).for_each(|(number, factor)| *number += kernel * factor);
        }
        numbers
    }
}

fn matrix(kernel: Kernel, samples: &[Sample<'_>]) -> Matrix {
    let mut matrix = Matrix::zero(samples.len());
    for i in 0..samples.len() {
        for j in 0..=i {
            let value = kernel.of(samples[i].features, samples[j].features);
            *matrix.at_mut(i, j) = value;
            *matrix.at_mut(j, i) = value;
        }
    }
    matrix
}

/// The product of a matrix with rows of numbers.
fn times(matrix: &Matrix, rows: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let product = |k: usize| {
        let mut sums = vec![0.0; count];
        for (factor, row) in matrix.row(k).iter().zip(rows) {
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += factor * value);
        }
        sums
    };
    (0..matrix.size).map(product).collect()
}

/// The mean loss of samples that are predicted from all others, in closed form.
fn left_out(samples: &[Sample<'_>], inverse: &Matrix, factors: &[Vec<f64>], scale: &Scale, weights: &[f64]) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    for (k, sample) in samples.iter().enumerate() {
        let pivot = inverse.at(k, k).max(1e-12);
        let loss: f64 = factors[k]
            .iter()
            .zip(&scale.units)
            .zip(weights)
            .map(|((factor, unit), weight)| {
                let z = factor / pivot / unit;
                weight * ((1.0 + z * z).sqrt() - 1.0)
            })
            .sum();
        sum += sample.weight * loss;
        all += sample.weight;
    }
    sum / all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn places(count: usize) -> Vec<Vec<f64>> {
        let mut random = Random::new(3, 1);
        (0..count).map(|_| (0..3).map(|_| random.uniform() - 0.5).collect()).collect()
    }

    fn scale() -> Scale {
        let mut scale = Scale::usual([1, 1, 0, 0, 0]);
        scale.units = vec![0.1; 2];
        scale
    }

    fn modelled(of: fn(&[f64]) -> [f64; 2]) -> (Model, f64) {
        let places = places(60);
        let numbers: Vec<[f64; 2]> = places.iter().map(|place| of(place)).collect();
        let samples: Vec<Sample<'_>> =
            places.iter().zip(&numbers).map(|(features, numbers)| Sample { features, numbers, weight: 1.0 }).collect();
        let model = Model::of(&samples, 3, &scale());
        let fresh = Random::new(8, 2);
        let mut random = fresh;
        let mut worst = 0.0_f64;
        for _ in 0..50 {
            let place: Vec<f64> = (0..3).map(|_| 0.9 * (random.uniform() - 0.5)).collect();
            let (found, right) = (model.numbers(&place), of(&place));
            worst = worst.max((found[0] - right[0]).abs()).max((found[1] - right[1]).abs());
        }
        (model, worst)
    }

    #[test]
    fn models_linear_and_quadratic_functions() {
        let (model, worst) = modelled(|x| [2.0 * x[0] - x[1] + 5.0, 0.5 * x[2]]);
        assert!(worst < 0.02 && model.left_out < 0.01, "{worst} {}", model.left_out);
        let (model, worst) = modelled(|x| [x[0] * x[0] + x[1] * x[2] - 3.0 * x[1], x[2] * x[2]]);
        assert!(worst < 0.03 && model.left_out < 0.01, "{worst} {}", model.left_out);
    }

    #[test]
    fn closed_form_equals_leaving_out() {
        let places = places(20);
        let numbers: Vec<[f64; 2]> = places.iter().map(|x| [libm::sin(4.0 * x[0]), x[1] * x[2]]).collect();
        let samples: Vec<Sample<'_>> =
            places.iter().zip(&numbers).map(|(features, numbers)| Sample { features, numbers, weight: 1.0 }).collect();
        let kernel = Kernel { length: 0.8, quadratic: 0.05 };
        let factors = |samples: &[Sample<'_>]| {
            let mut matrix = matrix(kernel, samples);
            (0..samples.len()).for_each(|k| *matrix.at_mut(k, k) += 0.03);
            let inverse = matrix.cholesky().inverse_of_factor();
            let rows: Vec<Vec<f64>> = samples.iter().map(|sample| sample.numbers.to_vec()).collect();
            let factors = times(&inverse, &rows, 2);
            (inverse, factors)
        };
        let (inverse, all) = factors(&samples);
        for (k, all) in all.iter().enumerate() {
            let mut others = samples.clone();
            let one = others.remove(k);
            let (_, rest) = factors(&others);
            for number in 0..2 {
                let predicted: f64 =
                    others.iter().zip(&rest).map(|(s, f)| kernel.of(s.features, one.features) * f[number]).sum();
                let closed = all[number] / inverse.at(k, k);
                assert!((one.numbers[number] - predicted - closed).abs() < 1e-9);
            }
        }
    }
}
