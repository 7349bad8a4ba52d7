//! Delays of the grains of a surface: noise of three sizes, hashed by cell.
use super::Plan;
use crate::ground::hash::Hash;
use crate::ground::number::narrow;

/// Sizes of the noise in cells, and their shares of the variance.
const SIZES: [(f64, f64); 3] = [(1.0, 0.55), (5.0, 0.25), (17.0, 0.2)];

/// Deviation of the logarithm of delays at a roughness of 1.
const SPREAD: f64 = 1.6;

/// Time for a mm at each cell: 1 at a `roughness` of 0. The delays have a median that lets a rough front advance as
/// fast as an even one.
pub fn delays(plan: &Plan, roughness: f64, hash: Hash) -> Vec<f32> {
    let spread = SPREAD * roughness;
    if spread <= 0.0 {
        return vec![1.0; plan.len()];
    }
    let layers = SIZES.map(|(size, share)| (Layer::new(plan, size), share.sqrt()));
    let median = 1.0 + spread * (PACE[0] + PACE[1] * spread);
    let columns = plan.counts.x as usize;
    (0..plan.len())
        .map(|n| {
            let (x, y) = ((n % columns) as f64, (n / columns) as f64);
            let sum: f64 = (0..).zip(&layers).map(|(k, (layer, share))| share * layer.at(x, y, hash.with(k))).sum();
            narrow(median * libm::exp(spread * sum))
        })
        .collect()
}

/// Coefficients of the median, fitted to the speed of fronts.
const PACE: [f64; 2] = [0.288, 0.355];

/// A layer of noise of mean 0 and deviation about 1 that repeats with the grid.
struct Layer {
    counts: [f64; 2],
    scale: [f64; 2],
    gain: f64,
    fine: bool,
}

impl Layer {
    fn new(plan: &Plan, size: f64) -> Self {
        let cells = [f64::from(plan.counts.x), f64::from(plan.counts.y)];
        let counts = cells.map(|cells| (cells / size).round().max(1.0));
        let fine = size <= 1.0;
        // Uniform numbers have a deviation of 0.289; interpolation in two directions keeps 0.74 of it in the mean.
        let gain = if fine { 3.464 } else { 4.66 };
        Self { counts, scale: [counts[0] / cells[0], counts[1] / cells[1]], gain, fine }
    }

    fn at(&self, x: f64, y: f64, hash: Hash) -> f64 {
        if self.fine {
            return self.gain * (self.draw(x, y, hash) - 0.5);
        }
        let at = [(x + 0.5) * self.scale[0], (y + 0.5) * self.scale[1]];
        let base = at.map(f64::floor);
        let ease = |t: f64| t * t * (3.0 - 2.0 * t);
        let (tx, ty) = (ease(at[0] - base[0]), ease(at[1] - base[1]));
        let row = |y: f64| {
            let (a, b) = (self.draw(base[0], y, hash), self.draw(base[0] + 1.0, y, hash));
            a + tx * (b - a)
        };
        let (a, b) = (row(base[1]), row(base[1] + 1.0));
        self.gain * (a + ty * (b - a) - 0.5)
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers from 0 on")]
    fn draw(&self, x: f64, y: f64, hash: Hash) -> f64 {
        let wrap = |v: f64, n: f64| v - (v / n).floor() * n;
        hash.unit((wrap(y, self.counts[1]) * self.counts[0] + wrap(x, self.counts[0])) as u64)
    }
}
