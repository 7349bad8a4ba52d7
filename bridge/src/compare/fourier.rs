//! Fourier transforms of planes.
use super::plane::Plane;
use rustfft::FftPlannerScalar;
use rustfft::num_complex::Complex64;
use std::f64::consts::TAU;

/// A spectrum, or complex numbers in pixels: row by row.
#[derive(Clone, Debug)]
pub(super) struct Spectrum {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<Complex64>,
}

impl Spectrum {
    /// The transform of a plane.
    pub(super) fn of(plane: &Plane) -> Self {
        let values = plane.values.iter().map(|value| Complex64::new(*value, 0.0)).collect();
        Self { width: plane.width, height: plane.height, values }.transformed(false)
    }

    /// The inverse transform.
    pub(super) fn inverse(self) -> Self {
        let count = self.values.len().max(1) as f64;
        let mut inverse = self.transformed(true);
        inverse.values.iter_mut().for_each(|value| *value /= count);
        inverse
    }

    fn transformed(mut self, inverse: bool) -> Self {
        let mut planner = FftPlannerScalar::new();
        let mut plan = |len: usize| if inverse { planner.plan_fft_inverse(len) } else { planner.plan_fft_forward(len) };
        plan(self.width).process(&mut self.values);
        let mut turned = self.turned();
        plan(turned.width).process(&mut turned.values);
        turned.turned()
    }

    fn turned(&self) -> Self {
        let (width, height) = (self.width, self.height);
        let values = (0..width).flat_map(|x| (0..height).map(move |y| self.values[y * width + x])).collect();
        Self { width: height, height: width, values }
    }

    /// The low frequencies alone, on a grid of a whole fraction of the size.
    pub(super) fn cropped(&self, by: usize) -> Self {
        let (width, height) = (self.width / by, self.height / by);
        let from = |at: usize, small: usize, large: usize| {
            // The place after shifting frequency 0 to the middle, and back.
            let shifted = (at + small / 2) % small + large / 2 - small / 2;
            (shifted + large - large / 2) % large
        };
        let values = (0..height).flat_map(|y| {
            let row = from(y, height, self.height) * self.width;
            (0..width).map(move |x| self.values[row + from(x, width, self.width)])
        });
        Self { width, height, values: values.collect() }
    }
}

/// The frequency at an index, in waves per pixel, from -1/2 up to 1/2.
pub(super) fn frequency(index: usize, count: usize) -> f64 {
    let shifted = (index + count / 2) % count;
    (shifted as f64 - (count / 2) as f64) / count as f64
}

/// The periodic part of a plane (Moisan): without the jump at its borders.
pub(super) fn periodic(plane: &Plane) -> Plane {
    let (width, height) = (plane.width, plane.height);
    let at = |x: usize, y: usize| plane.values[y * width + x];
    let mut jump = Plane { values: vec![0.0; width * height], ..*plane };
    for x in 0..width {
        let step = at(x, 0) - at(x, height - 1);
        jump.values[x] += step;
        jump.values[(height - 1) * width + x] -= step;
    }
    for y in 0..height {
        let step = at(0, y) - at(width - 1, y);
        jump.values[y * width] += step;
        jump.values[y * width + width - 1] -= step;
    }
    let mut spectrum = Spectrum::of(&jump);
    let cosines = |count: usize| (0..count).map(|k| 2.0 * libm::cos(TAU * k as f64 / count as f64)).collect::<Vec<_>>();
    let (across, down) = (cosines(width), cosines(height));
    for (index, value) in spectrum.values.iter_mut().enumerate() {
        *value =
            if index == 0 { Complex64::ZERO } else { *value / (across[index % width] + down[index / width] - 4.0) };
    }
    let smooth = spectrum.inverse();
    let values = plane.values.iter().zip(smooth.values).map(|(value, smooth)| value - smooth.re).collect();
    Plane { width, height, values }
}
