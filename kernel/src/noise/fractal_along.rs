//! Noise and its octaves, stretched along a direction field.
//!
//! Each octave is a set of patches on a triangular grid that has the canvas as a period. The distance of its corners is
//! the length of the bumps. Each corner has its own noise, turned to the field's direction there; a pixel blends the
//! noises of the three corners around it. Source of the blending: E. Heitz, F. Neyret, "High-performance by-example
//! noise using a histogram-preserving blending operator" (2018): the sum is divided by the root of the sum of squared
//! weights, which keeps the variance. Differs in that noise is blended instead of a picture; octaves are folded after
//! the blending, so crests and valleys stay sharp. White noise is not blended: the nearest corner shows.
//!
//! Scale, mean and deviation are those of [`Noise`](super::fractal::Noise). Cost: about 30 ns per pixel and octave.

use super::cells::{CellGrid, CellShape, LANES, RAMP, key, lower_unit, scramble, slope, upper_unit};
use super::fractal::{Basis, Folded, NoiseSpec, quintic};
use super::simplex;
use crate::ground::hash::Hash;
use crate::ground::math::{floor_int, lerp, max, smooth};
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt, index, offset};
use glam::{DVec2, IVec2};
use shibo_value::Tiling;

/// A noise bound to a canvas and a seed.
#[derive(Clone, Debug)]
pub struct NoiseAlong {
    spec: NoiseSpec,
    octaves: Vec<Patches>,
    /// Standard deviation of the sum of all octaves, including those too fine to draw.
    deviation: f64,
}

/// An octave.
#[derive(Clone, Debug)]
struct Patches {
    grid: CellGrid,
    /// Patches to mm.
    to_mm: [[f64; 2]; 2],
    /// Size of a bump across, mm.
    size: f64,
    weight: f64,
    /// Cosine and sine of the angle by which the noise of each patch is turned before it is stretched.
    turn: [f64; 2],
}

/// Directions around a window, as cosines and sines of twice their angles, so that opposite directions are equal.
#[derive(Debug)]
pub struct Directions<'a> {
    /// The upper left corner of the first sample, mm.
    pub origin: DVec2,
    /// The size of a sample, mm.
    pub step: DVec2,
    /// Numbers of samples in a row and of rows.
    pub size: IVec2,
    /// The samples, row by row.
    pub doubled: &'a [[f32; 2]],
}

impl Directions<'_> {
    /// Cosine and sine of the direction at a position in mm.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the samples")]
    fn at(&self, p: DVec2) -> (f64, f64) {
        let place = (p - self.origin) / self.step - 0.5;
        let last = (self.size - 1).max(IVec2::ZERO).as_dvec2();
        let low = place.floor().clamp(DVec2::ZERO, last);
        let high = (place.floor() + 1.0).clamp(DVec2::ZERO, last);
        let share = (place - place.floor()).clamp(DVec2::ZERO, DVec2::ONE);
        let read = |x: f64, y: f64| {
            let [c, s] = self.doubled[y as usize * self.size.x as usize + x as usize];
            DVec2::new(c.into(), s.into())
        };
        let row = |y: f64| read(low.x, y).lerp(read(high.x, y), share.x);
        let doubled = row(low.y).lerp(row(high.y), share.y);
        let half = 0.5 * libm::atan2(doubled.y, doubled.x);
        (libm::cos(half), libm::sin(half))
    }
}

/// A direction in degrees in the form of [`Directions`].
pub fn doubled(degrees: f32) -> [f32; 2] {
    let (sin, cos) = (crate::ground::math::sin_degrees(2.0 * degrees), crate::ground::math::cos_degrees(2.0 * degrees));
    if sin.is_finite() && cos.is_finite() { [cos, sin] } else { [1.0, 0.0] }
}

impl NoiseAlong {
    /// Prepares the patches; the angle of the [shape](NoiseSpec::shape) is added to that of the field. Octaves with
    /// more than 10^9 patches on the canvas are left out.
    pub fn new(spec: &NoiseSpec, canvas: (DVec2, Tiling), hash: Hash) -> Self {
        let mut octaves = Vec::new();
        let (mut size, mut weight, mut variance) = (spec.shape.size, 1.0, 0.0);
        for octave in 0..spec.octaves.clamp(1, 32) {
            let apart = CellShape::round(size * spec.shape.aspect.max(1.0));
            if let Some(grid) = CellGrid::triangular(canvas, &apart, 0.0, hash.with(u64::from(octave))) {
                let turn = spec.turn(octave);
                let turn = [libm::cos(turn), libm::sin(turn)];
                octaves.push(Patches { to_mm: grid.to_mm(), grid, size, weight, turn });
            }
            variance += weight * weight;
            size /= spec.lacunarity;
            weight *= spec.gain;
        }
        Self { spec: *spec, octaves, deviation: variance.sqrt() }
    }

    /// The margin around a window within which directions are read, mm.
    pub fn reach(&self) -> f64 {
        let sides =
            |[[a, b], [c, d]]: [[f64; 2]; 2]| libm::hypot(a, c).max(libm::hypot(b, d)).max(libm::hypot(a - b, c - d));
        self.octaves.iter().map(|octave| sides(octave.to_mm)).fold(0.0, f64::max)
    }

    /// Fills `out`, contiguous rows of the frame's window.
    ///
    /// # Panics
    /// If `out` is smaller than the window.
    pub fn fill(&self, frame: &Frame, directions: &Directions<'_>, out: &mut [f32]) {
        let sum = Folded::new(&self.spec, self.deviation);
        simd::dispatch(
            #[inline(always)]
            || self.rows(&sum, frame, directions, out),
        );
    }

    #[inline(always)]
    fn rows(&self, folded: &Folded, frame: &Frame, directions: &Directions<'_>, out: &mut [f32]) {
        let (rect, lanes) = (frame.window, index(LANES));
        for (row, y) in out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).zip(rect.y..) {
            let mut x = rect.x.div_euclid(lanes) * lanes;
            while x < rect.right() {
                let (from, to) = (offset((rect.x - x).max(0)), LANES.min(offset(rect.right() - x)));
                let mut sum = [0.0; LANES];
                for octave in &self.octaves {
                    let pixels = octave.size * self.spec.shape.aspect.min(1.0) / frame.step[0].max(frame.step[1]);
                    if let Some(strength) = folded.strength(octave.weight, pixels) {
                        let mut value = [0.0; LANES];
                        octave.draw(&self.spec, (frame, [x, y]), (from, to), directions, &mut value);
                        folded.add(strength, &value, &mut sum);
                    }
                }
                folded.finish(&mut sum);
                let start = offset((x - rect.x).max(0));
                row[start..start + to - from].copy_from_slice(&sum[from..to]);
                x += lanes;
            }
        }
    }
}

/// A corner of a triangle of patches: its noise position and weight as linear functions along a run.
#[derive(Clone, Copy, Default)]
struct Corner {
    word: u32,
    /// Position in its noise at lane 0, in bumps, and the change per lane.
    place: [f32; 2],
    rate: [f32; 2],
    weight: f32,
    growth: f32,
}

impl Patches {
    /// The noise of the lanes `from..to` of the run that begins at pixel `at`.
    #[inline(always)]
    fn draw(
        &self,
        spec: &NoiseSpec,
        (frame, at): (&Frame, [i32; 2]),
        (from, to): (usize, usize),
        directions: &Directions<'_>,
        out: &mut [f32; LANES],
    ) {
        let begin = frame.center(at[0], at[1]);
        let first = self.grid.place(begin);
        let rate = self.grid.to_cell().map(|row| row[0] * frame.step[0]);
        // Triangle of a lane: its cell, and the half of the cell.
        let triangle = |lane: usize| {
            let place = [0, 1].map(|k: usize| first[k] + rate[k] * lane as f64);
            let cell = place.map(f64::floor);
            (cell, place[0] - cell[0] + place[1] - cell[1] > 1.0)
        };
        let mut lane = from;
        while lane < to {
            let here = triangle(lane);
            let end = (lane + 1..to).find(|lane| triangle(*lane) != here).unwrap_or(to);
            let (cell, far) = here;
            let x = [first[0] - cell[0], rate[0]];
            let y = [first[1] - cell[1], rate[1]];
            let line =
                |constant: f64, by_x: f64, by_y: f64| [constant + by_x * x[0] + by_y * y[0], by_x * x[1] + by_y * y[1]];
            let three = if far {
                [
                    ([1.0, 1.0], line(-1.0, 1.0, 1.0)),
                    ([1.0, 0.0], line(1.0, 0.0, -1.0)),
                    ([0.0, 1.0], line(1.0, -1.0, 0.0)),
                ]
            } else {
                [
                    ([0.0; 2], line(1.0, -1.0, -1.0)),
                    ([1.0, 0.0], line(0.0, 1.0, 0.0)),
                    ([0.0, 1.0], line(0.0, 0.0, 1.0)),
                ]
            };
            let corners = three.map(|(corner, weight)| {
                let corner = [cell[0] + corner[0], cell[1] + corner[1]];
                self.corner(spec, begin, (first, rate), corner, directions).weighted(weight)
            });
            mix(spec.basis, &corners, &mut out[lane..end], &RAMP[lane..end]);
            lane = end;
        }
    }

    /// The noise of a corner of the grid.
    #[inline(always)]
    fn corner(
        &self,
        spec: &NoiseSpec,
        begin: [f64; 2],
        (first, rate): ([f64; 2], [f64; 2]),
        corner: [f64; 2],
        directions: &Directions<'_>,
    ) -> Corner {
        #[expect(clippy::cast_possible_truncation, reason = "at most 10^9 cells on a side")]
        let word = self.grid.word(corner[0] as i64, corner[1] as i64);
        let mm = |[u, v]: [f64; 2]| [0, 1].map(|k: usize| self.to_mm[k][0] * u + self.to_mm[k][1] * v);
        let away = mm([first[0] - corner[0], first[1] - corner[1]]);
        let middle = DVec2::new(begin[0] - away[0], begin[1] - away[1]);
        let (cos, sin) = directions.at(middle);
        let turn = spec.shape.angle;
        let (c, s) = (libm::cos(turn), libm::sin(turn));
        let (cos, sin) = (cos * c - sin * s, sin * c + cos * s);
        let bumps =
            |[x, y]: [f64; 2]| [(cos * x + sin * y) / (self.size * spec.shape.aspect), (cos * y - sin * x) / self.size];
        let turned = |[x, y]: [f64; 2]| [self.turn[0] * x + self.turn[1] * y, self.turn[0] * y - self.turn[1] * x];
        let (place, step) = (turned(bumps(away)), turned(bumps(mm(rate))));
        // Shifts the noise of each patch, so that no cell corner lies in the middle of a patch.
        let shift = [upper_unit(scramble(word)), lower_unit(scramble(word))];
        let (place, rate) = if spec.basis == Basis::Simplex {
            (simplex::rhombic(place), simplex::rhombic(step))
        } else {
            (place, step)
        };
        Corner {
            word,
            place: [0, 1].map(|k: usize| narrow(place[k]) + shift[k]),
            rate: rate.map(narrow),
            ..Corner::default()
        }
    }
}

impl Corner {
    fn weighted(self, [weight, growth]: [f64; 2]) -> Self {
        Self { weight: narrow(weight), growth: narrow(growth), ..self }
    }

    /// Its weight and its position at a lane.
    #[inline(always)]
    fn at(&self, ramp: f32) -> (f32, f32, f32) {
        let weight = smooth(max(self.weight + ramp * self.growth, 0.0));
        (weight, self.place[0] + ramp * self.rate[0], self.place[1] + ramp * self.rate[1])
    }
}

/// The noise of a part of a run within one triangle.
#[inline(always)]
fn mix(basis: Basis, corners: &[Corner; 3], out: &mut [f32], ramp: &[f32]) {
    match basis {
        Basis::Gradient => mixed(corners, out, ramp, gradient),
        Basis::Value => mixed(corners, out, ramp, value),
        Basis::Simplex => mixed(corners, out, ramp, simplex::at),
        Basis::White => {
            for (out, ramp) in out.iter_mut().zip(ramp) {
                let three = corners.map(|corner| (corner.at(*ramp), corner.word));
                let nearest = three.iter().fold(three[0], |best, one| if one.0.0 > best.0.0 { *one } else { best });
                let ((_, x, y), word) = nearest;
                *out = 2.0 * upper_unit(key(word, floor_int(x).1, floor_int(y).1)) - 1.0;
            }
        }
    }
}

#[inline(always)]
fn mixed(corners: &[Corner; 3], out: &mut [f32], ramp: &[f32], noise: impl Fn(u32, f32, f32) -> f32) {
    let [a, b, c] = corners;
    for (out, ramp) in out.iter_mut().zip(ramp) {
        let ((wa, ax, ay), (wb, bx, by), (wc, cx, cy)) = (a.at(*ramp), b.at(*ramp), c.at(*ramp));
        let sum = wa * noise(a.word, ax, ay) + wb * noise(b.word, bx, by) + wc * noise(c.word, cx, cy);
        *out = sum / (wa * wa + wb * wb + wc * wc).sqrt();
    }
}

#[inline(always)]
fn corners_of(x: f32, y: f32, at: impl Fn(i32, i32, f32, f32) -> f32) -> f32 {
    let ((fx, u), (fy, v)) = (floor_int(x), floor_int(y));
    let (x, y) = (x - fx, y - fy);
    let (a, b) = (at(u, v, x, y), at(u + 1, v, x - 1.0, y));
    let (c, d) = (at(u, v + 1, x, y - 1.0), at(u + 1, v + 1, x - 1.0, y - 1.0));
    let (s, t) = (quintic(x), quintic(y));
    lerp(lerp(a, b, s), lerp(c, d, s), t)
}

#[inline(always)]
fn gradient(word: u32, x: f32, y: f32) -> f32 {
    2.0 * corners_of(x, y, |u, v, x, y| slope(key(word, u, v), x, y))
}

#[inline(always)]
fn value(word: u32, x: f32, y: f32) -> f32 {
    2.0 * corners_of(x, y, |u, v, _, _| upper_unit(key(word, u, v))) - 1.0
}

#[cfg(test)]
mod tests {
    use super::super::fractal::{FractalKind, Noise};
    use super::*;
    use proptest::prelude::*;
    use shibo_value::Window;

    const CANVAS: (DVec2, Tiling) = (DVec2::new(60.0, 40.0), Tiling::BOTH);

    fn spec(basis: Basis, fractal: FractalKind, aspect: f64) -> NoiseSpec {
        let shape = CellShape { size: 1.3, aspect, angle: 0.0 };
        NoiseSpec { basis, fractal, shape, turned: fractal != FractalKind::Fbm, ..NoiseSpec::fbm(1.3, 1) }
    }

    /// The noise for a direction field in degrees.
    fn render(noise: &NoiseAlong, rect: Window, step: f64, degrees: impl Fn(DVec2) -> f32) -> Vec<f32> {
        let (origin, side) = (DVec2::splat(-100.0), DVec2::splat(0.5));
        let size = IVec2::new(600, 600);
        let all: Vec<[f32; 2]> = (0..size.y)
            .flat_map(|y| (0..size.x).map(move |x| DVec2::new(x.into(), y.into())))
            .map(|at| doubled(degrees(origin + (at + 0.5) * side)))
            .collect();
        let directions = Directions { origin, step: side, size, doubled: &all };
        let mut out = vec![0.0; rect.len()];
        noise.fill(&Frame::new(rect, [step, step]), &directions, &mut out);
        out
    }

    fn eddies(p: DVec2) -> f32 {
        let turn = p * std::f64::consts::TAU / DVec2::new(60.0, 20.0);
        narrow(70.0 * libm::sin(turn.x) + 40.0 * libm::cos(turn.y))
    }

    fn mean_and_deviation(v: &[f32]) -> (f64, f64) {
        let mean = v.iter().map(|&x| f64::from(x)).sum::<f64>() / v.len() as f64;
        let variance = v.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / v.len() as f64;
        (mean, variance.sqrt())
    }

    #[test]
    fn has_the_deviation_of_noise_without_directions() {
        for basis in [Basis::Gradient, Basis::Value, Basis::White, Basis::Simplex] {
            for fractal in [FractalKind::Fbm, FractalKind::Ridged, FractalKind::Billow] {
                let spec = spec(basis, fractal, 3.0);
                let rect = Window::of(0, 0, 600, 400);
                let along = NoiseAlong::new(&spec, CANVAS, Hash::new(3));
                let got = mean_and_deviation(&render(&along, rect, 0.1, eddies));
                let mut plain = vec![0.0; rect.len()];
                Noise::new(&spec, CANVAS, Hash::new(3)).fill(&Frame::new(rect, [0.1; 2]), &mut plain);
                let want = mean_and_deviation(&plain);
                let near = (got.0 - want.0).abs() < 0.03 && (got.1 / want.1 - 1.0).abs() < 0.12;
                assert!(near, "{basis:?} {fractal:?}: {got:?} {want:?}");
            }
        }
    }

    #[test]
    fn is_stretched_along_the_local_direction() {
        // Vertical on the left half, horizontal on the right; the mean square of differences along and across.
        let noise = NoiseAlong::new(&spec(Basis::Gradient, FractalKind::Fbm, 4.0), CANVAS, Hash::new(9));
        let out =
            render(&noise, Window::of(0, 0, 600, 400), 0.1, |p| if p.x.rem_euclid(60.0) < 30.0 { 90.0 } else { 0.0 });
        let unlike = |columns: std::ops::Range<usize>, dx: usize, dy: usize| {
            let at = |x: usize, y: usize| f64::from(out[y * 600 + x]);
            (0..390)
                .flat_map(|y| columns.clone().map(move |x| (x, y)))
                .map(|(x, y)| (at(x + dx, y + dy) - at(x, y)).powi(2))
                .sum::<f64>()
        };
        let upright = unlike(70..230, 4, 0) / unlike(70..230, 0, 4);
        let level = unlike(370..530, 0, 4) / unlike(370..530, 4, 0);
        assert!(upright > 5.0 && level > 5.0, "{upright} {level}");
        // Opposite directions are the same.
        let near = |turn: f32| render(&noise, Window::of(0, 0, 90, 40), 0.1, move |p| eddies(p) + turn);
        assert!(near(0.0).iter().zip(&near(180.0)).all(|(a, b)| (a - b).abs() < 1e-3));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]
        #[test]
        fn tiles_agree_and_repeat(seed: u64, x0 in -150i32..300, y0 in -20i32..60, w in 1usize..120, h in 1usize..6) {
            for basis in [Basis::Gradient, Basis::Value, Basis::White, Basis::Simplex] {
                let spec = NoiseSpec { octaves: 3, ..spec(basis, FractalKind::Ridged, 3.0) };
                let noise = NoiseAlong::new(&spec, CANVAS, Hash::new(seed));
                let whole = render(&noise, Window::of(-150, y0, 600, h), 0.1, eddies);
                let tile = render(&noise, Window::of(x0, y0, w, h), 0.1, eddies);
                for j in 0..h {
                    let start = j * 600 + usize::try_from(x0 + 150).unwrap();
                    prop_assert_eq!(&tile[j * w..(j + 1) * w], &whole[start..start + w]);
                }
                let there = render(&noise, Window::of(x0 + 600, y0 + 400, w, h), 0.1, eddies);
                let different = tile.iter().zip(&there).filter(|(a, b)| (*a - *b).abs() > 2e-3).count();
                prop_assert!(different * 50 <= tile.len() + 50, "{different} of {}", tile.len());
            }
        }
    }
}
