//! The answer: values with errors from the slope of the model. A value with a large error is not determined.
use crate::linear::Matrix;
use crate::ridge::Model;
use crate::samples::Samples;
use crate::{Amount, Kind};

/// The number of independent measurements that the statistics count as.
const INDEPENDENT: f64 = 20.0;
/// The inverse variance of a coordinate about which nothing is known.
const UNKNOWN: f64 = 12.0;
/// A value with a smaller error, as a share of its range, is determined.
const DETERMINED: f64 = 0.1;
/// Values with a larger correlation do the same.
const PAIR: f64 = 0.9;
/// Half a step of differences of the model.
const STEP: f64 = 0.03;

/// An end of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The smallest value.
    Low,
    /// The largest value.
    High,
}

/// A found value.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The value, rounded to a tenth of its error.
    pub amount: Amount,
    /// Its standard error, in its unit; of a colour, the largest of its channels, 0..1.
    pub error: f64,
    /// The error as a share of the range, or of the logarithm of the range.
    pub share: f64,
    /// True if the photograph determines the value.
    pub determined: bool,
    /// The end of the range that the value went to.
    pub end: Option<End>,
}

/// A distance and its parts by block: colour, energy, shape, correlations, phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Level {
    /// The distance.
    pub distance: f64,
    /// Its parts.
    pub blocks: [f64; 5],
}

/// The found values at a point, and pairs that do the same with their correlation.
pub(crate) fn found(
    samples: &Samples<'_>,
    model: Option<&Model>,
    point: &[f64],
) -> (Vec<Found>, Vec<(usize, usize, f64)>) {
    let n = point.len();
    let covariance = match model {
        Some(model) => covariance(samples, model, point),
        None => Matrix::diagonal(n, 1.0 / UNKNOWN),
    };
    let unknowns = samples.unknowns();
    let ranges = unknowns.ranges();
    let error = |at: usize| covariance.at(at, at).max(0.0).sqrt();
    let mut all = Vec::with_capacity(ranges.len());
    for ((unknown, range), amount) in unknowns.0.iter().zip(&ranges).zip(unknowns.amounts(point)) {
        let share = range.clone().map(error).fold(0.0, f64::max);
        let error = unknown.kind.error(amount, share);
        let end = match unknown.kind {
            Kind::Number { .. } if point[range.start] < 0.01 => Some(End::Low),
            Kind::Number { .. } if point[range.start] > 0.99 => Some(End::High),
            _ => None,
        };
        let amount = rounded(unknown.kind, amount, error);
        all.push(Found { amount, error, share, determined: share < DETERMINED, end });
    }
    let mut pairs = Vec::new();
    for (one, a) in ranges.iter().enumerate() {
        for (other, b) in ranges.iter().enumerate().skip(one + 1).filter(|_| a.len() == 1) {
            let correlation = covariance.at(a.start, b.start) / (error(a.start) * error(b.start)).max(1e-12);
            if b.len() == 1 && correlation.abs() > PAIR {
                pairs.push((one, other, correlation));
            }
        }
    }
    (all, pairs)
}

/// The covariance of the coordinates of a point.
fn covariance(samples: &Samples<'_>, model: &Model, point: &[f64]) -> Matrix {
    let unknowns = samples.unknowns();
    let slopes: Vec<Vec<f64>> = (0..point.len())
        .map(|at| {
            let moved = |by: f64| {
                let mut moved = point.to_vec();
                moved[at] += by;
                model.numbers(&unknowns.features(&moved))
            };
            let (high, low) = (moved(STEP), moved(-STEP));
            high.iter()
                .zip(&low)
                .zip(&samples.scale.units)
                .map(|((a, b), unit)| (a - b) / (2.0 * STEP * unit))
                .collect()
        })
        .collect();
    let weights = samples.scale.weights();
    let mut information = Matrix::diagonal(point.len(), UNKNOWN);
    for (i, one) in slopes.iter().enumerate() {
        for (j, other) in slopes.iter().enumerate() {
            let sum: f64 = one.iter().zip(other).zip(&weights).map(|((a, b), weight)| weight * a * b).sum();
            *information.at_mut(i, j) += INDEPENDENT * sum;
        }
    }
    information.cholesky().inverse_of_factor()
}

/// A value rounded to a tenth of its error, within the range. Colours have 256 steps.
pub(crate) fn rounded(kind: Kind, amount: Amount, error: f64) -> Amount {
    match (kind, amount) {
        (_, Amount::Color(rgb)) => Amount::Color(rgb.map(|channel| (channel * 255.0).round() / 255.0)),
        (Kind::Number { low, high }, Amount::Number(value)) => Amount::Number(steps(value, error).clamp(low, high)),
        (_, Amount::Number(value)) => Amount::Number(steps(value, error)),
    }
}

/// A number rounded to the power of ten below a tenth of its error.
fn steps(value: f64, error: f64) -> f64 {
    let places = -libm::floor(libm::log10((error / 10.0).clamp(1e-9, 1e9)));
    let factor = libm::pow(10.0, places.abs());
    if places >= 0.0 { (value * factor).round() / factor } else { (value / factor).round() * factor }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_to_a_tenth_of_the_error() {
        assert_eq!(steps(1.092_345, 0.05), 1.092);
        assert_eq!(steps(70.4, 8.0), 70.4);
        assert_eq!(steps(1234.0, 300.0), 1230.0);
        let kind = Kind::Number { low: 0.4, high: 1.05 };
        assert_eq!(rounded(kind, Amount::Number(1.049_99), 0.01), Amount::Number(1.05));
    }
}
