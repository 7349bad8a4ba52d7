//! Size and direction of a material against another one, from spectra over wavelength and direction.
use super::fourier::{Spectrum, frequency, periodic};
use super::plane::{Colors, Plane, flatten, oklab, part};
use std::f64::consts::PI;
use std::ops::Range;

/// Steps of the logarithm of the wavelength, and directions over half a turn.
const RINGS: usize = 96;
const TURNS: usize = 72;
/// The histogram is this much finer, and has so many more rings at both ends.
const FINE: usize = 4;
const PAD: usize = 8;
/// Deviations beyond which a Gauss kernel counts as 0.
const REACH: f64 = 6.0;
/// Groups that are left out in turn, for errors.
const GROUPS: usize = 6;

/// Power of the lightness, whitened by frequency, over ring and direction; and the logarithms of the frequencies.
struct LogPolar {
    power: Vec<[f64; TURNS]>,
    rings: Vec<f64>,
}

impl LogPolar {
    #[expect(clippy::cast_possible_truncation, reason = "indices into the histogram")]
    fn of(lightness: &Plane) -> Self {
        let (width, height) = (lightness.width, lightness.height);
        let spectrum = Spectrum::of(&periodic(&lightness.centred()));
        let count = (width * height) as f64;
        let least = width.min(height) as f64;
        let (low, high) = (libm::log(2.5 / least), libm::log(0.42));
        let rings: Vec<f64> = (0..RINGS).map(|ring| low + (high - low) * ring as f64 / (RINGS - 1) as f64).collect();
        let (fine_rings, fine_turns) = ((RINGS + 2 * PAD) * FINE, TURNS * FINE);
        let mut histogram = vec![[0.0_f64; 2]; fine_rings * fine_turns];
        for (index, value) in spectrum.values.iter().enumerate() {
            let (fx, fy) = (frequency(index % width, width), frequency(index / width, height));
            let radius = libm::hypot(fx, fy);
            if radius <= libm::exp(low) * 0.8 || radius >= libm::exp(high) * 1.1 {
                continue;
            }
            let angle = libm::atan2(fy, fx).rem_euclid(PI);
            let ring = ((libm::log(radius) - low) / (high - low) * (RINGS - 1) as f64 + PAD as f64) * FINE as f64;
            let ring = (ring.round_ties_even().max(0.0) as usize).min(fine_rings - 1);
            let turn = (angle / PI * fine_turns as f64).round_ties_even() as usize % fine_turns;
            let cell = &mut histogram[ring * fine_turns + turn];
            cell[0] += value.norm_sqr() / (count * count) * radius * radius;
            cell[1] += 1.0;
        }
        // Smoothed along both axes by Gauss kernels.
        let bell = |distance: f64, width: f64| libm::exp(-0.5 * (distance / width) * (distance / width));
        let along_turns: Vec<Vec<(usize, f64)>> = (0..TURNS)
            .map(|turn| {
                let half = TURNS as f64 / 2.0;
                let distance =
                    |fine: usize| (turn as f64 - fine as f64 / FINE as f64 + half).rem_euclid(TURNS as f64) - half;
                // Farther cells have no weight that counts.
                let near = (0..fine_turns).filter(|fine| distance(*fine).abs() < REACH * 2.0);
                near.map(|fine| (fine, bell(distance(fine), 2.0))).collect()
            })
            .collect();
        let smooth = |row: &[[f64; 2]], turn: usize| {
            let mut sums = [0.0; 2];
            for (fine, weight) in &along_turns[turn] {
                let cell = row[*fine];
                sums[0] += cell[0] * weight;
                sums[1] += cell[1] * weight;
            }
            sums
        };
        let rows: Vec<Vec<[f64; 2]>> =
            histogram.chunks(fine_turns).map(|row| (0..TURNS).map(|turn| smooth(row, turn)).collect()).collect();
        let power = (0..RINGS).map(|ring| {
            let distance = |fine: usize| ring as f64 - (fine as f64 / FINE as f64 - PAD as f64);
            let near = (0..fine_rings).filter(|fine| distance(*fine).abs() < REACH * 2.2);
            let weights: Vec<(usize, f64)> = near.map(|fine| (fine, bell(distance(fine), 2.2))).collect();
            std::array::from_fn(|turn| {
                let mut sums = [0.0; 2];
                for (fine, weight) in &weights {
                    let row = &rows[*fine];
                    sums[0] += row[turn][0] * weight;
                    sums[1] += row[turn][1] * weight;
                }
                sums[0] / sums[1].max(1e-9)
            })
        });
        Self { power: power.collect(), rings }
    }

    /// The power of each ring over its mean, minus 1.
    fn relative(&self) -> Vec<[f64; TURNS]> {
        let row = |row: &[f64; TURNS]| {
            let mean = row.iter().sum::<f64>() / TURNS as f64;
            row.map(|power| if mean > 0.0 { power / mean - 1.0 } else { 0.0 })
        };
        self.power.iter().map(row).collect()
    }
}

/// The minimum near the index `at` of values, by a parabola.
fn parabola(values: &[f64], at: usize) -> f64 {
    let (before, here, after) = (values[at - 1], values[at], values[at + 1]);
    let bend = before - 2.0 * here + after;
    let step = if bend > 1e-12 { (0.5 * (before - after) / bend).clamp(-1.0, 1.0) } else { 0.0 };
    at as f64 + step
}

/// The index of the smallest value; the first of equal ones.
fn smallest(values: &[f64]) -> usize {
    (0..values.len()).fold(0, |best, index| if values[index] < values[best] { index } else { best })
}

/// Two spectra, of one picture against another.
struct Pair {
    a: LogPolar,
    b: LogPolar,
    relative: [Vec<[f64; TURNS]>; 2],
    /// Certainty of each ring: few waves make a noisy spectrum.
    sure: Vec<f64>,
    step: f64,
}

/// The rings of A for which B has a ring, if A is shifted by `shift` rings.
fn overlap(shift: isize) -> Range<usize> {
    let by = shift.unsigned_abs();
    if shift < 0 { by.min(RINGS)..RINGS } else { 0..RINGS.saturating_sub(by) }
}

impl Pair {
    fn of(a: &Plane, b: &Plane) -> Self {
        let least = a.width.min(a.height).min(b.width).min(b.height) as f64;
        let (a, b) = (LogPolar::of(a), LogPolar::of(b));
        let sure = a.rings.iter().map(|ring| libm::pow(libm::exp(*ring) * least / 10.0, 2.0).min(1.0)).collect();
        let (relative, step) = ([a.relative(), b.relative()], a.rings[1] - a.rings[0]);
        Self { a, b, relative, sure, step }
    }

    fn certainty(&self, ring: usize, shift: isize) -> (usize, f64) {
        let other = ring.saturating_add_signed(shift);
        (other, self.sure[ring].min(self.sure[other]))
    }

    /// Logarithm of the factor by which A is coarser, from the directions that are not left out.
    fn size(&self, left_out: Option<usize>) -> f64 {
        let kept: Vec<usize> = (0..TURNS).filter(|turn| Some(turn * GROUPS / TURNS) != left_out).collect();
        let profile = |spectrum: &LogPolar| {
            let mean = |row: &[f64; TURNS]| kept.iter().map(|turn| row[*turn]).sum::<f64>() / kept.len() as f64;
            spectrum.power.iter().map(|row| libm::log(mean(row).max(1e-300))).collect::<Vec<f64>>()
        };
        let (a, b) = (profile(&self.a), profile(&self.b));
        let half = RINGS as isize / 2;
        // The overall height is contrast, not size.
        let error = |shift: isize| {
            let terms: Vec<(f64, f64)> = overlap(shift)
                .map(|ring| {
                    let (other, weight) = self.certainty(ring, shift);
                    (a[ring] - b[other], weight)
                })
                .collect();
            let all: f64 = terms.iter().map(|(_, weight)| weight).sum();
            let mean = terms.iter().map(|(value, weight)| value * weight).sum::<f64>() / all;
            let spread = terms.iter().map(|(value, weight)| weight * (value - mean) * (value - mean)).sum::<f64>();
            spread / all + 0.01 * (shift as f64 * self.step) * (shift as f64 * self.step)
        };
        let errors: Vec<f64> = (-half..=half).map(error).collect();
        let at = smallest(&errors[1..errors.len() - 1]) + 1;
        (parabola(&errors, at) - half as f64) * self.step
    }

    /// Degrees by which A is turned counter-clockwise, from the rings that are not left out.
    fn turn(&self, left_out: Option<usize>, shift: isize) -> f64 {
        let rings: Vec<usize> = overlap(shift).filter(|ring| Some(ring * GROUPS / RINGS) != left_out).collect();
        if rings.len() < 3 {
            return 0.0;
        }
        let mut sums = [0.0; TURNS];
        for ring in rings {
            let (other, weight) = self.certainty(ring, shift);
            let (a, b) = (&self.relative[0][ring], &self.relative[1][other]);
            for (turn, sum) in sums.iter_mut().enumerate() {
                *sum -= weight * (0..TURNS).map(|at| b[at] * a[(at + turn) % TURNS]).sum::<f64>();
            }
        }
        let at = smallest(&sums);
        let around: Vec<f64> = [&sums[TURNS - 1..], &sums[..], &sums[..1]].concat();
        -(parabola(&around, at + 1) - 1.0) * 180.0 / TURNS as f64
    }
}

/// A number and its standard error; that of a factor is a factor.
pub(super) type Estimate = (f64, f64);

/// The factor by which A is coarser than B, and the degrees by which it is turned counter-clockwise.
pub(super) fn size_and_turn(a: &Colors, b: &Colors) -> (Estimate, Estimate) {
    let lightness = |colors: &Colors| flatten(&oklab(colors)[0]);
    let pair = Pair::of(&lightness(a), &lightness(b));
    let size = pair.size(None);
    let share = (GROUPS - 1) as f64 / GROUPS as f64;
    let sizes: Vec<f64> = (0..GROUPS).map(|group| pair.size(Some(group))).collect();
    let mean = sizes.iter().sum::<f64>() / GROUPS as f64;
    let spread = (share * sizes.iter().map(|size| (size - mean) * (size - mean)).sum::<f64>()).sqrt() + 0.02;
    // Places of one picture differ in size, too.
    let places: Vec<f64> = [a, b].into_iter().flat_map(places_differ).collect();
    let places = places.iter().map(|size| size * size).sum::<f64>() / places.len().max(1) as f64;
    let size_error = libm::hypot(spread, places.sqrt() / 2.0);
    #[expect(clippy::cast_possible_truncation, reason = "at most 48 rings")]
    let shift = if size.abs() < 1.2 { (size / pair.step).round_ties_even() as isize } else { 0 };
    let turn = pair.turn(None, shift);
    let half = |degrees: f64| (degrees + 90.0).rem_euclid(180.0) - 90.0;
    let off = (0..GROUPS).map(|group| half(pair.turn(Some(group), shift) - turn));
    let turn_error = (share * off.map(|off| off * off).sum::<f64>()).sqrt() + 1.0;
    ((libm::exp(size), libm::exp(size_error)), (half(turn), turn_error))
}

/// Logarithms of the factors between quarters of one picture.
fn places_differ(colors: &Colors) -> Vec<f64> {
    let quarters = quarters(colors).map(|quarter| flatten(&oklab(&quarter)[0]));
    [(0, 3), (1, 2), (0, 1)].map(|(one, other)| Pair::of(&quarters[one], &quarters[other]).size(None)).to_vec()
}

/// The four quarters of a picture, by rows.
pub(super) fn quarters(colors: &Colors) -> [Colors; 4] {
    let size = [colors[0].width / 2, colors[0].height / 2];
    [[0, 0], [size[0], 0], [0, size[1]], size].map(|at| part(colors, at, size))
}
