//! Gradient, value, white and simplex noise and their fractal sums, periodic on a canvas that tiles.
//!
//! Perlin's improved noise (K. Perlin, "Improving noise", 2002: quintic fade) on a [`CellGrid`], with gradients uniform
//! in a square instead of twelve directions: the covariance is as round as that of unit gradients, no direction is
//! preferred, and a gradient costs six instructions. Octave `o` has cells of `size / lacunarity^o` mm and the weight
//! `gain^o`. Each octave is rounded to the canvas separately.
//!
//! Noise has a trace of its grid: a fold at every corner of a cell, or values that are small there. Parallel grids of
//! several octaves add up to visible lines. So the grid of each octave can be turned by another angle
//! ([`NoiseSpec::turned`]), within the frame of `angle` and `aspect`. It is rounded to the canvas like any other.
//!
//! Values are 0..1 with mean ½ and a standard deviation of 0.155 for every number of octaves (the rare values beyond
//! 3.2 deviations are clamped), so a height is `depth · noise` for any octaves. An octave fades out when its cells are
//! smaller than two pixels, and vanishes at one pixel: a smaller picture shows less detail, not other detail.
//!
//! Cost: about 8 ns per pixel and three octaves; see `benches/texel.rs`.

use super::cells::{CellGrid, CellShape, LANES, RAMP, Run, Wrap, slope, upper_unit};
use super::simplex::simplex;
use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt, index, offset};
use glam::DVec2;
use shibo_macros::choice;
use shibo_value::Tiling;

/// The noise of each octave.
#[choice]
pub enum Basis {
    /// Perlin noise: a random slope at each corner of a cell.
    #[default]
    Gradient,
    /// A random value at each corner; blockier.
    Value,
    /// A random value in each cell, with hard edges.
    White,
    /// Simplex noise: a random slope at each corner of a triangle; rounder than `Gradient`.
    Simplex,
}

/// The folding and summation of octaves.
#[choice]
pub enum FractalKind {
    /// Clouds: the sum.
    #[default]
    Fbm,
    /// Sharp bright crests.
    // Sharp crests: each octave is 1 - |n|, squared.
    Ridged,
    /// Round lumps between sharp dark valleys.
    // Round lumps between sharp valleys: each octave is |n|.
    Billow,
    /// Thin dark veins: the sum folded at its mean. The result has a mean of 0.26.
    Turbulence,
}

/// Parameters of a noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseSpec {
    /// The cells of the first octave.
    pub shape: CellShape,
    /// The noise of an octave.
    pub basis: Basis,
    /// The combination of octaves.
    pub fractal: FractalKind,
    /// Number of octaves, ≥ 1.
    pub octaves: u32,
    /// Ratio of the cell sizes of two octaves, > 1.
    pub lacunarity: f64,
    /// Ratio of the weights of two octaves.
    pub gain: f64,
    /// True to turn the grid of each octave by another angle.
    pub turned: bool,
}

impl NoiseSpec {
    /// Gradient noise with features of `size` mm and `octaves` octaves that halve in size and weight.
    pub const fn fbm(size: f64, octaves: u32) -> Self {
        Self {
            shape: CellShape::round(size),
            basis: Basis::Gradient,
            fractal: FractalKind::Fbm,
            octaves,
            lacunarity: 2.0,
            gain: 0.5,
            turned: false,
        }
    }
}

/// The golden ratio minus 1: its multiples modulo 1 are spread as evenly as possible.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl NoiseSpec {
    /// Angle in radians by which the grid of an octave is turned within the frame of `angle` and `aspect`. A square grid repeats after a quarter turn, and a triangular grid has a side
    /// perpendicular to an old one after a twelfth: the angle of an octave stays away from these by at least a sixth of
    /// them. White noise keeps its squares upright, because they are visible.
    pub(super) fn turn(&self, octave: u32) -> f64 {
        let whole: f64 = match self.basis {
            _ if !self.turned => return 0.0,
            Basis::White => return 0.0,
            Basis::Gradient | Basis::Value => 90.0,
            Basis::Simplex => 30.0,
        };
        let share = (0.2 + GOLDEN * f64::from(octave)).fract();
        (whole * (1.0 + 4.0 * share) / 6.0).to_radians()
    }
}

/// Standard deviation of the result.
const DEVIATION: f64 = 0.155;

/// Mean and standard deviation of one octave by shape and basis, measured (test `statistics`).
const fn moments(basis: Basis, fractal: FractalKind) -> (f64, f64) {
    match (basis, fractal) {
        (Basis::Gradient, FractalKind::Fbm | FractalKind::Turbulence) => (0.0, 0.1763),
        (Basis::Gradient, FractalKind::Billow) => (0.1400, 0.1072),
        (Basis::Gradient, FractalKind::Ridged) => (0.7511, 0.1744),
        (Basis::Value, FractalKind::Fbm | FractalKind::Turbulence) => (0.0, 0.4566),
        (Basis::Value, FractalKind::Billow) => (0.3830, 0.2486),
        (Basis::Value, FractalKind::Ridged) => (0.4425, 0.2908),
        (Basis::White, FractalKind::Fbm | FractalKind::Turbulence) => (0.0, 0.57735),
        (Basis::White, FractalKind::Billow) => (0.5, 0.288_675),
        (Basis::White, FractalKind::Ridged) => (1.0 / 3.0, 0.298_142),
        (Basis::Simplex, FractalKind::Fbm | FractalKind::Turbulence) => (0.0, 0.1925),
        (Basis::Simplex, FractalKind::Billow) => (0.1582, 0.1097),
        (Basis::Simplex, FractalKind::Ridged) => (0.7207, 0.1779),
    }
}

/// A noise bound to a canvas and a seed.
#[derive(Clone, Debug)]
pub struct Noise {
    spec: NoiseSpec,
    octaves: Vec<(CellGrid, f64)>,
    /// Standard deviation of the sum of all octaves, including those too fine to draw.
    deviation: f64,
}

impl Noise {
    /// Prepares the grids. At most 32 octaves are drawn; octaves with more than 10^9 cells on the canvas are left out.
    pub fn new(spec: &NoiseSpec, canvas: (DVec2, Tiling), hash: Hash) -> Self {
        let mut octaves = Vec::new();
        let (mut size, mut weight, mut variance) = (spec.shape.size, 1.0, 0.0);
        for octave in 0..spec.octaves.clamp(1, 32) {
            let shape = CellShape { size, ..spec.shape };
            let make = if spec.basis == Basis::Simplex { CellGrid::triangular } else { CellGrid::turned };
            if let Some(grid) = make(canvas, &shape, spec.turn(octave), hash.with(u64::from(octave))) {
                octaves.push((grid, weight));
            }
            variance += weight * weight;
            size /= spec.lacunarity;
            weight *= spec.gain;
        }
        Self { spec: *spec, octaves, deviation: variance.sqrt() }
    }

    /// Fills `out`, contiguous rows of the frame's window.
    ///
    /// # Panics
    /// If `out` is smaller than the window.
    pub fn fill(&self, frame: &Frame, out: &mut [f32]) {
        let folded = Folded::new(&self.spec, self.deviation);
        let octaves = self.visible(&folded, frame.step);
        simd::dispatch(
            #[inline(always)]
            || fill(self.spec.basis, &folded, &octaves, frame, out),
        );
    }

    /// The octaves whose cells are not smaller than a pixel, with their strengths.
    fn visible(&self, folded: &Folded, step: [f64; 2]) -> Vec<(&CellGrid, f32)> {
        let turned = self.spec.turn(0) != 0.0;
        let pixels = if turned { CellGrid::pixels_per_turned_cell } else { CellGrid::pixels_per_cell };
        let strength = |(grid, weight): &(CellGrid, f64)| folded.strength(*weight, pixels(grid, step));
        self.octaves.iter().filter_map(|octave| Some((&octave.0, strength(octave)?))).collect()
    }
}

/// The folding and scaling of octaves to one value.
pub(super) struct Folded {
    fractal: FractalKind,
    /// Factor on all octaves.
    scale: f64,
    /// Mean of a folded octave.
    mean: f32,
}

impl Folded {
    /// `deviation` is the standard deviation of the sum of all weights.
    pub(super) fn new(spec: &NoiseSpec, deviation: f64) -> Self {
        let (mean, own) = moments(spec.basis, spec.fractal);
        Self { fractal: spec.fractal, scale: DEVIATION / (own * deviation), mean: narrow(mean) }
    }

    /// The strength of an octave with this weight and this number of pixels per cell; `None` if it is invisible.
    pub(super) fn strength(&self, weight: f64, pixels: f64) -> Option<f32> {
        let visible = math::smooth(narrow(pixels - 1.0));
        (visible > 0.0).then_some(narrow(weight * self.scale) * visible)
    }

    #[inline(always)]
    pub(super) fn add(&self, strength: f32, value: &[f32; LANES], sum: &mut [f32; LANES]) {
        let mean = self.mean;
        match self.fractal {
            FractalKind::Fbm | FractalKind::Turbulence => {
                for (sum, n) in sum.iter_mut().zip(value) {
                    *sum += strength * n;
                }
            }
            FractalKind::Billow => {
                for (sum, n) in sum.iter_mut().zip(value) {
                    *sum += strength * (n.abs() - mean);
                }
            }
            FractalKind::Ridged => {
                for (sum, n) in sum.iter_mut().zip(value) {
                    let ridge = 1.0 - n.abs();
                    *sum += strength * (ridge * ridge - mean);
                }
            }
        }
    }

    #[inline(always)]
    pub(super) fn finish(&self, sum: &mut [f32; LANES]) {
        for x in sum {
            let x_ = if self.fractal == FractalKind::Turbulence { 2.1 * x.abs() } else { *x + 0.5 };
            *x = math::saturate(x_);
        }
    }
}

#[inline(always)]
fn fill(basis: Basis, folded: &Folded, octaves: &[(&CellGrid, f32)], frame: &Frame, out: &mut [f32]) {
    let rect = frame.window;
    let lanes = index(LANES);
    for (row, y) in out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).zip(rect.y..) {
        let mut x = rect.x.div_euclid(lanes) * lanes;
        while x < rect.right() {
            let mut sum = [0.0; LANES];
            for (grid, strength) in octaves {
                let run = grid.run(frame, x, y, [0, 1]);
                let mut value = [0.0; LANES];
                draw(basis, &run, &mut value);
                folded.add(*strength, &value, &mut sum);
            }
            folded.finish(&mut sum);
            let from = offset((rect.x - x).max(0));
            let to = LANES.min(offset(rect.right() - x));
            let start = offset((x - rect.x).max(0));
            row[start..start + to - from].copy_from_slice(&sum[from..to]);
            x += lanes;
        }
    }
}

#[inline(always)]
fn draw(basis: Basis, run: &Run, out: &mut [f32; LANES]) {
    match (basis, run.wrap) {
        (Basis::Gradient, Wrap::None) => gradient::<0>(run, out),
        (Basis::Gradient, Wrap::Few) => gradient::<1>(run, out),
        (Basis::Gradient, Wrap::Many) => gradient::<2>(run, out),
        (Basis::Value, Wrap::None) => value::<0>(run, out),
        (Basis::Value, Wrap::Few) => value::<1>(run, out),
        (Basis::Value, Wrap::Many) => value::<2>(run, out),
        (Basis::White, Wrap::None) => white::<0>(run, out),
        (Basis::White, Wrap::Few) => white::<1>(run, out),
        (Basis::White, Wrap::Many) => white::<2>(run, out),
        (Basis::Simplex, Wrap::None) => simplex::<0>(run, out),
        (Basis::Simplex, Wrap::Few) => simplex::<1>(run, out),
        (Basis::Simplex, Wrap::Many) => simplex::<2>(run, out),
    }
}

#[inline(always)]
pub(super) fn quintic(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// The slopes are within ±½; a factor 2 and the standard deviation of the sum are included in the scale of [`moments`].
#[inline(always)]
fn gradient<const WRAP: u8>(run: &Run, out: &mut [f32; LANES]) {
    for (out, &k) in out.iter_mut().zip(&RAMP) {
        let (x, y, u, v) = run.place(k);
        let a = slope(run.word::<WRAP>(u, v), x, y);
        let b = slope(run.word::<WRAP>(u + 1, v), x - 1.0, y);
        let c = slope(run.word::<WRAP>(u, v + 1), x, y - 1.0);
        let d = slope(run.word::<WRAP>(u + 1, v + 1), x - 1.0, y - 1.0);
        let (s, t) = (quintic(x), quintic(y));
        *out = 2.0 * math::lerp(math::lerp(a, b, s), math::lerp(c, d, s), t);
    }
}

#[inline(always)]
fn value<const WRAP: u8>(run: &Run, out: &mut [f32; LANES]) {
    for (out, &k) in out.iter_mut().zip(&RAMP) {
        let (x, y, u, v) = run.place(k);
        let a = upper_unit(run.word::<WRAP>(u, v));
        let b = upper_unit(run.word::<WRAP>(u + 1, v));
        let c = upper_unit(run.word::<WRAP>(u, v + 1));
        let d = upper_unit(run.word::<WRAP>(u + 1, v + 1));
        let (s, t) = (quintic(x), quintic(y));
        *out = 2.0 * math::lerp(math::lerp(a, b, s), math::lerp(c, d, s), t) - 1.0;
    }
}

#[inline(always)]
fn white<const WRAP: u8>(run: &Run, out: &mut [f32; LANES]) {
    for (out, &k) in out.iter_mut().zip(&RAMP) {
        let (_, _, u, v) = run.place(k);
        *out = 2.0 * upper_unit(run.word::<WRAP>(u, v)) - 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shibo_value::Window;

    const CANVAS: (DVec2, Tiling) = (DVec2::new(60.0, 40.0), Tiling::BOTH);

    fn spec(basis: Basis, fractal: FractalKind) -> NoiseSpec {
        let shape = CellShape { size: 1.3, aspect: 1.7, angle: 0.5 };
        NoiseSpec { basis, fractal, shape, turned: fractal != FractalKind::Fbm, ..NoiseSpec::fbm(1.3, 3) }
    }

    fn render(noise: &Noise, rect: Window, step: f64) -> Vec<f32> {
        let mut out = vec![0.0; rect.len()];
        noise.fill(&Frame::new(rect, [step, step]), &mut out);
        out
    }

    fn mean_and_deviation(v: &[f32]) -> (f64, f64) {
        let mean = v.iter().map(|&x| f64::from(x)).sum::<f64>() / v.len() as f64;
        let variance = v.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / v.len() as f64;
        (mean, variance.sqrt())
    }

    #[test]
    fn statistics() {
        for basis in [Basis::Gradient, Basis::Value, Basis::White, Basis::Simplex] {
            for fractal in [FractalKind::Fbm, FractalKind::Ridged, FractalKind::Billow] {
                let spec = NoiseSpec { basis, fractal, ..NoiseSpec::fbm(0.5, 1) };
                let noise = Noise::new(&spec, CANVAS, Hash::new(3));
                let (mean, deviation) = mean_and_deviation(&render(&noise, Window::of(0, 0, 768, 512), 60.0 / 768.0));
                assert!(
                    (mean - 0.5).abs() < 0.01 && (deviation - 0.155).abs() < 0.01,
                    "{basis:?} {fractal:?}: {mean} {deviation}"
                );
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn tiles_agree(seed: u64, x0 in -200i32..300, y0 in -200i32..300, w in 1usize..150, h in 1usize..8) {
            for basis in [Basis::Gradient, Basis::Value, Basis::White, Basis::Simplex] {
                let noise = Noise::new(&spec(basis, FractalKind::Ridged), CANVAS, Hash::new(seed));
                let whole = render(&noise, Window::of(-200, y0, 700, h), 0.1);
                let tile = render(&noise, Window::of(x0, y0, w, h), 0.1);
                for j in 0..h {
                    let start = j * 700 + usize::try_from(x0 + 200).unwrap();
                    prop_assert_eq!(&tile[j * w..(j + 1) * w], &whole[start..start + w]);
                }
            }
        }

        #[test]
        fn repeats_with_the_canvas(seed: u64, size in 0.4f64..90.0, aspect in 0.4f64..4.0, angle in -3.2f64..3.2) {
            for (basis, fractal) in [
                (Basis::Gradient, FractalKind::Fbm),
                (Basis::Gradient, FractalKind::Billow),
                (Basis::Value, FractalKind::Ridged),
                (Basis::Simplex, FractalKind::Ridged),
            ] {
                let shape = CellShape { size, aspect, angle };
                let turned = fractal != FractalKind::Fbm;
                let spec = NoiseSpec { shape, basis, fractal, turned, ..NoiseSpec::fbm(size, 4) };
                let noise = Noise::new(&spec, CANVAS, Hash::new(seed));
                let here = render(&noise, Window::of(0, 0, 240, 160), 0.25);
                let there = render(&noise, Window::of(240, -160, 240, 160), 0.25);
                for (a, b) in here.iter().zip(&there) {
                    prop_assert!((a - b).abs() < 5e-4, "{basis:?} {fractal:?}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn wide_and_plain_code_agree() {
        let noise = Noise::new(&spec(Basis::Gradient, FractalKind::Fbm), CANVAS, Hash::new(5));
        let frame = Frame::new(Window::of(-7, 3, 200, 40), [0.1, 0.1]);
        let wide = render(&noise, frame.window, 0.1);
        let folded = Folded::new(&noise.spec, noise.deviation);
        let octaves = noise.visible(&folded, frame.step);
        let mut plain = vec![0.0; frame.window.len()];
        fill(Basis::Gradient, &folded, &octaves, &frame, &mut plain);
        assert_eq!(wide, plain);
    }

    #[test]
    fn fine_octaves_fade() {
        let noise = Noise::new(&NoiseSpec::fbm(0.1, 4), CANVAS, Hash::new(5));
        let flat = render(&noise, Window::of(0, 0, 64, 64), 0.2);
        assert!(flat.iter().all(|&x| x == 0.5));
        assert!(mean_and_deviation(&render(&noise, Window::of(0, 0, 256, 256), 0.02)).1 > 0.12);
    }
}
