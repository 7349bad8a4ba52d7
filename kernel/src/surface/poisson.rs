//! Height from slopes, by Poisson's equation.
//!
//! Slopes p and q rarely belong to a height exactly. The result is the height whose slopes differ least from them: ∇²h
//! = ∂p/∂x + ∂q/∂y (R. Frankot, R. Chellappa, 1988). With Fourier transforms this is a division: ĥ = −i (ω_x p̂ + ω_y
//! q̂) / (ω_x² + ω_y²). So it is exact where the picture repeats; elsewhere the picture is mirrored at its edges,
//! across which slopes end. p and q are the real and the imaginary part of one picture: one transform serves for both.
//! The mean of the height is 0.
//!
//! Cost: O(n log n), see `benches/texel.rs`; 16 bytes of memory a pixel, four times that where both directions are
//! mirrored. The transforms are the scalar ones of `rustfft`: the same operations, in the same order, on every machine,
//! with factors that are computed in f64 and rounded to f32.

use crate::ground::stop::Until;
use rayon::prelude::*;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlannerScalar};
use std::sync::Arc;

/// A picture of slopes, to be converted to a height.
#[derive(Clone, Debug)]
pub struct Poisson {
    size: [usize; 2],
    step: [f64; 2],
    wrap: [bool; 2],
    /// Slopes, including the mirrored picture.
    slopes: Vec<Complex32>,
}

impl Poisson {
    /// An empty picture of `size` pixels of `step` mm that repeats along the axes of `wrap`.
    pub fn new(size: [usize; 2], step: [f64; 2], wrap: [bool; 2]) -> Self {
        let poisson = Self { size, step, wrap, slopes: Vec::new() };
        let [w, h] = poisson.full();
        Self { slopes: vec![Complex32::ZERO; w * h], ..poisson }
    }

    /// Memory needed, in bytes.
    pub fn bytes(size: [usize; 2], wrap: [bool; 2]) -> u64 {
        let [w, h] = Self { size, step: [1.0; 2], wrap, slopes: Vec::new() }.full();
        (16 * w * h + 4 * size[0] * size[1]) as u64
    }

    /// Size including the mirrored part.
    fn full(&self) -> [usize; 2] {
        [0, 1].map(|k| if self.wrap[k] { self.size[k] } else { 2 * self.size[k] })
    }

    /// Sets the slopes of a row: rise per mm to the right (`p`) and down (`q`).
    ///
    /// # Panics
    /// If the row does not exist, or a slice has another length.
    pub fn set_row(&mut self, y: usize, p: &[f32], q: &[f32]) {
        let (w, [full, tall]) = (self.size[0], self.full());
        assert!(p.len() == w && q.len() == w && y < self.size[1], "a row of the picture");
        // Mirroring along an axis negates the slope along it.
        let mut set = |y: usize, down: f32| {
            let row = &mut self.slopes[y * full..(y + 1) * full];
            for (x, (p, q)) in p.iter().zip(q).enumerate() {
                row[x] = Complex32::new(*p, down * q);
                if full > w {
                    row[full - 1 - x] = Complex32::new(-p, down * q);
                }
            }
        };
        set(y, 1.0);
        if tall > self.size[1] {
            set(tall - 1 - y, -1.0);
        }
    }

    /// The height in mm, by rows; `None` if `until` returned true.
    pub fn solve(mut self, until: Until<'_>) -> Option<Vec<f32>> {
        let [w, h] = self.full();
        let mut planner = FftPlannerScalar::new();
        let [rows, back] = [planner.plan_fft_forward(w), planner.plan_fft_inverse(w)];
        let columns = [planner.plan_fft_forward(h), planner.plan_fft_inverse(h)];
        each_row(&mut self.slopes, w, &rows, until);
        let mut turned = vec![Complex32::ZERO; w * h];
        transpose(&self.slopes, w, &mut turned, h);
        self.divide(&mut turned, &columns, until);
        if until() {
            return None;
        }
        transpose(&turned, h, &mut self.slopes, w);
        drop(turned);
        let kept = &mut self.slopes[..w * self.size[1]];
        each_row(kept, w, &back, until);
        let mut height = vec![0.0; self.size[0] * self.size[1]];
        height.par_chunks_mut(self.size[0]).zip(kept.par_chunks(w)).for_each(|(out, row)| {
            out.iter_mut().zip(row).for_each(|(out, v)| *out = v.re);
        });
        (!until()).then_some(height)
    }

    /// The frequency of a coefficient of an axis, in radians per mm; 0 for the highest one of an even count, which has
    /// no slope.
    fn frequency(&self, axis: usize, index: usize) -> f64 {
        let n = self.full()[axis];
        if 2 * index == n {
            return 0.0;
        }
        let signed = if 2 * index < n { index as f64 } else { index as f64 - n as f64 };
        std::f64::consts::TAU * signed / (n as f64 * self.step[axis])
    }

    /// Transforms the columns, which are rows here, divides, and transforms back. Columns k and −k are processed
    /// together, since the transforms of p and q are their even and odd parts.
    fn divide(&self, turned: &mut [Complex32], [there, back]: &[Arc<dyn Fft<f32>>; 2], until: Until<'_>) {
        let [w, h] = self.full();
        let down: Vec<f64> = (0..h).map(|y| self.frequency(1, y)).collect();
        let scale = 1.0 / (w as f64 * h as f64);
        let scratch = || vec![Complex32::ZERO; there.get_inplace_scratch_len().max(back.get_inplace_scratch_len())];
        let one = |scratch: &mut Vec<Complex32>, x: usize, a: &mut [Complex32], b: Option<&mut [Complex32]>| {
            if until() {
                return;
            }
            let across = self.frequency(0, x);
            there.process_with_scratch(a, scratch);
            if let Some(b) = b {
                there.process_with_scratch(b, scratch);
                for y in 0..h {
                    let (z, mirrored) = (a[y], b[(h - y) % h]);
                    (a[y], b[(h - y) % h]) = heights(z, mirrored, [across, down[y]], scale);
                }
                back.process_with_scratch(b, scratch);
            } else {
                for y in 0..=h / 2 {
                    let (z, mirrored) = (a[y], a[(h - y) % h]);
                    let (first, second) = heights(z, mirrored, [across, down[y]], scale);
                    (a[(h - y) % h], a[y]) = (second, first);
                }
            }
            back.process_with_scratch(a, scratch);
        };
        let (zero, rest) = turned.split_at_mut(h);
        one(&mut scratch(), 0, zero, None);
        let pairs = (w - 1) / 2;
        let (low, rest) = rest.split_at_mut(pairs * h);
        let (middle, high) = rest.split_at_mut(if w % 2 == 0 { h } else { 0 });
        if w % 2 == 0 {
            one(&mut scratch(), w / 2, middle, None);
        }
        let both = low.par_chunks_mut(h).zip(high.par_chunks_mut(h).rev()).enumerate();
        both.for_each_init(scratch, |scratch, (x, (a, b))| one(scratch, x + 1, a, Some(b)));
    }
}

/// The transforms of the height at a frequency and at its opposite, from those of p + iq.
#[expect(clippy::cast_possible_truncation, reason = "coefficients are f32")]
fn heights(z: Complex32, mirrored: Complex32, [x, y]: [f64; 2], scale: f64) -> (Complex32, Complex32) {
    let square = x * x + y * y;
    if square == 0.0 {
        return (Complex32::ZERO, Complex32::ZERO);
    }
    // p = (z + m*)/2 and q = (z − m*)/2i; the height is −i (x p + y q) / square, and its conjugate at the opposite one.
    let (x, y) = ((0.5 * scale * x / square) as f32, (0.5 * scale * y / square) as f32);
    let (sum, difference) = (z + mirrored.conj(), z - mirrored.conj());
    let height = Complex32::new(x * sum.im - y * difference.re, -x * sum.re - y * difference.im);
    (height, height.conj())
}

fn each_row(data: &mut [Complex32], w: usize, fft: &Arc<dyn Fft<f32>>, until: Until<'_>) {
    let scratch = || vec![Complex32::ZERO; fft.get_inplace_scratch_len()];
    data.par_chunks_mut(w).for_each_init(scratch, |scratch, row| {
        if !until() {
            fft.process_with_scratch(row, scratch);
        }
    });
}

/// Transposes: the columns of `from`, with rows of `w` values, become rows of `h` values.
fn transpose(from: &[Complex32], w: usize, to: &mut [Complex32], h: usize) {
    const SIDE: usize = 16;
    to.par_chunks_mut(SIDE * h).enumerate().for_each(|(block, to)| {
        let first = block * SIDE;
        let count = to.len() / h;
        for y in (0..h).step_by(SIDE) {
            for x in 0..count {
                for y in y..(y + SIDE).min(h) {
                    to[x * h + y] = from[y * w + first + x];
                }
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::stop::NEVER;

    /// Solves for `slopes`, a function of a position in mm.
    fn solved(size: [usize; 2], step: [f64; 2], wrap: [bool; 2], slopes: impl Fn(f64, f64) -> [f64; 2]) -> Vec<f32> {
        let mut poisson = Poisson::new(size, step, wrap);
        for y in 0..size[1] {
            let at = |x: usize| slopes((x as f64 + 0.5) * step[0], (y as f64 + 0.5) * step[1]);
            #[expect(clippy::cast_possible_truncation, reason = "a test")]
            let part = |k: usize| (0..size[0]).map(|x| at(x)[k] as f32).collect::<Vec<_>>();
            poisson.set_row(y, &part(0), &part(1));
        }
        poisson.solve(NEVER).unwrap()
    }

    fn worst(height: &[f32], size: [usize; 2], step: [f64; 2], want: impl Fn(f64, f64) -> f64) -> f64 {
        let off = |k: usize| {
            let at = [(k % size[0]) as f64 + 0.5, (k / size[0]) as f64 + 0.5];
            (f64::from(height[k]) - want(at[0] * step[0], at[1] * step[1])).abs()
        };
        (0..height.len()).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn recovers_waves_exactly() {
        // Even, odd and prime sizes.
        for size in [[64, 48], [45, 64], [31, 37], [1, 16], [2, 2]] {
            let step = [0.5, 0.25];
            let turn = [0, 1].map(|k| std::f64::consts::TAU / (size[k] as f64 * step[k]));
            let (a, b) = if size[0] > 4 {
                (3.0 * turn[0], 2.0 * turn[1])
            } else {
                (0.0, if size[1] > 4 { turn[1] } else { 0.0 })
            };
            let height = solved(size, step, [true; 2], |x, y| {
                let c = (a * x + b * y + 0.3).cos();
                [a * c, b * c]
            });
            let mean = height.iter().sum::<f32>() / height.len() as f32;
            let wave = |x: f64, y: f64| if b == 0.0 { 0.0 } else { (a * x + b * y + 0.3).sin() };
            assert!(worst(&height, size, step, wave) < 1e-5 && mean.abs() < 1e-6, "{size:?}");
        }
    }

    #[test]
    fn mirrored_edges_keep_slopes_that_end_there() {
        // Half a wave across, a whole one down.
        let (size, step) = ([40, 32], [0.3, 0.4]);
        let (a, b) = (std::f64::consts::PI / 12.0, std::f64::consts::TAU / 12.8);
        let want = |x: f64, y: f64| (a * x).cos() * (b * y).sin();
        let slopes = |x: f64, y: f64| [-a * (a * x).sin() * (b * y).sin(), b * (a * x).cos() * (b * y).cos()];
        let height = solved(size, step, [false, true], slopes);
        assert!(worst(&height, size, step, want) < 1e-5);
        let both = solved(size, step, [false; 2], |x, y| {
            [-a * (a * x).sin() * (0.5 * b * y).cos(), -0.5 * b * (a * x).cos() * (0.5 * b * y).sin()]
        });
        assert!(worst(&both, size, step, |x, y| (a * x).cos() * (0.5 * b * y).cos()) < 1e-5);
    }

    #[test]
    fn stops_when_asked() {
        assert!(Poisson::new([64, 64], [1.0; 2], [true; 2]).solve(&|| true).is_none());
    }
}
