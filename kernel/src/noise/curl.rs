//! Curl noise: divergence-free vectors, the gradient of a noise turned by 90° from +x towards +y.
//!
//! Source: R. Bridson et al., "Curl-noise for procedural fluid flow" (2007). The gradient of [`Noise`] is computed by
//! differences over a small part of its finest octave, so it does not depend on the resolution. Cost: four noises.

use super::fractal::{Noise, NoiseSpec};
use crate::ground::number::narrow;
use crate::ground::window::Frame;

/// Distance of the differences to each side, as a fraction of the finest octave.
const REACH: f64 = 0.02;

/// The root mean square of the gradient's length for one octave, times its size: measured (test `lengths`).
const STEEPNESS: f64 = 0.63;

/// Curl noise, scaled to vectors of a given root-mean-square length.
#[derive(Clone, Copy, Debug)]
pub struct Curl {
    reach: f64,
    scale: f64,
}

impl Curl {
    /// For the sum of octaves (`FractalKind::Fbm`) of `Basis::Gradient`, with vectors whose root mean square is
    /// `length`.
    pub fn new(spec: &NoiseSpec, length: f64) -> Self {
        let (mut size, mut weight, mut variance, mut slopes, mut finest) = (spec.shape.size, 1.0, 0.0, 0.0, f64::MAX);
        for _ in 0..spec.octaves.clamp(1, 32) {
            variance += weight * weight;
            slopes += (weight / size).powi(2);
            finest = size;
            size /= spec.lacunarity;
            weight *= spec.gain;
        }
        let reach = REACH * finest;
        Self { reach, scale: length / (STEEPNESS * (slopes / variance.max(1e-300)).sqrt() * 2.0 * reach) }
    }

    /// Fills x and y of the vectors; y points down.
    ///
    /// # Panics
    /// If a plane is smaller than the window.
    pub fn fill(&self, noise: &Noise, frame: &Frame, x: &mut [f32], y: &mut [f32]) {
        let n = frame.window.len();
        let mut other = vec![0.0; n];
        let mut difference = |axis: usize, sign: f64, out: &mut [f32]| {
            let at = |way: f64| {
                let mut origin = frame.origin;
                origin[axis] += way * self.reach;
                Frame { origin, ..*frame }
            };
            noise.fill(&at(1.0), &mut out[..n]);
            noise.fill(&at(-1.0), &mut other);
            let scale = narrow(sign * self.scale);
            out.iter_mut().zip(&other).for_each(|(out, other)| *out = (*out - other) * scale);
        };
        difference(1, -1.0, x);
        difference(0, 1.0, y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::ground::window::WindowExt;
    use glam::DVec2;
    use shibo_value::{Tiling, Window};

    const CANVAS: (DVec2, Tiling) = (DVec2::new(40.0, 40.0), Tiling::BOTH);

    fn vectors(octaves: u32, length: f64, step: f64) -> (Vec<f32>, Vec<f32>, Window) {
        let spec = NoiseSpec::fbm(5.0, octaves);
        let (noise, curl) = (Noise::new(&spec, CANVAS, Hash::new(2)), Curl::new(&spec, length));
        let side = if step < 0.1 { 400 } else { 200 };
        let window = Window::of(0, 0, side, side);
        let (mut x, mut y) = (vec![0.0; window.len()], vec![0.0; window.len()]);
        curl.fill(&noise, &Frame::new(window, [step; 2]), &mut x, &mut y);
        (x, y, window)
    }

    #[test]
    fn lengths() {
        for octaves in [1, 3, 5] {
            let (x, y, window) = vectors(octaves, 2.0, 0.2);
            let sum: f64 = x.iter().chain(&y).map(|v| f64::from(*v).powi(2)).sum();
            let length = (sum / window.len() as f64).sqrt();
            assert!((length / 2.0 - 1.0).abs() < 0.08, "{octaves}: {length}");
        }
    }

    #[test]
    fn flow_through_a_square_sums_to_zero() {
        let (x, y, window) = vectors(1, 1.0, 0.05);
        let side = window.columns();
        let at = |plane: &[f32], i: usize, j: usize| f64::from(plane[j * side + i]);
        for (i, j) in [(10, 20), (150, 60), (260, 300)] {
            // Over the four sides of 4 × 4 mm, by the trapezoidal rule.
            let sum =
                |f: &dyn Fn(usize) -> f64| (0..=80).map(|k| f(k) * if k % 80 == 0 { 0.5 } else { 1.0 }).sum::<f64>();
            let out =
                sum(&|k| at(&x, i + 80, j + k) - at(&x, i, j + k)) + sum(&|k| at(&y, i + k, j + 80) - at(&y, i + k, j));
            let passes = sum(&|k| at(&x, i, j + k).abs()) + sum(&|k| at(&y, i + k, j).abs());
            assert!(out.abs() < 2e-3 * passes, "{out} of {passes}");
        }
    }
}
