//! Statistics of a picture that do not depend on where things lie, and the distance between two pictures by them.
use super::fourier::{Spectrum, frequency, periodic};
use super::plane::{Colors, Plane, flatten, oklab, quantile};
use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Most wavelengths: 3, 6, 12, 24, 48 pixels.
const SCALES: usize = 5;
/// Directions, 30° apart.
const DIRECTIONS: usize = 6;
/// Quantiles of a band; those in the middle tell little.
const SHAPE: [f64; 8] = [0.01, 0.05, 0.2, 0.35, 0.65, 0.8, 0.95, 0.99];
/// Quantiles of colours along a direction.
const COLORS: usize = 16;
/// Directions in OKLab.
const COLOR_DIRECTIONS: [[f64; 3]; 9] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.866, 0.0],
    [0.5, -0.866, 0.0],
    [0.5, 0.0, 0.866],
    [0.5, 0.0, -0.866],
    [0.0, 0.707, 0.707],
    [0.0, 0.707, -0.707],
];
/// Chroma of a material spans about a third of its lightness.
const CHROMA: f64 = 3.0;
/// Differences that are hardly seen, by block, and the weights of the blocks.
const NOTICED: [f64; 5] = [0.012, 0.06, 0.06, 0.04, 0.04];
const WEIGHTS: [f64; 5] = [1.0, 1.5, 0.5, 1.0, 0.5];

/// Distances by block of statistics; 0 for equal pictures.
#[cfg_attr(feature = "agents", derive(schemars::JsonSchema))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parts {
    /// Quantiles of colours.
    pub color: f64,
    /// Contrast of each wavelength and direction.
    pub energy: f64,
    /// Distribution of values: dark grooves or bright ridges.
    pub shape: f64,
    /// Correlations of local amplitudes: how structures meet.
    pub corr: f64,
    /// Phases of neighbouring wavelengths: which side of an edge is steep.
    pub phase: f64,
}

impl Parts {
    /// The parts in the order of the blocks.
    pub fn blocks(&self) -> [f64; BLOCKS] {
        [self.color, self.energy, self.shape, self.corr, self.phase]
    }
}

/// The numbers of the five blocks, in the order of [`Parts`].
pub(super) struct Stats {
    blocks: [Vec<f64>; BLOCKS],
}

/// The number of blocks.
pub(super) const BLOCKS: usize = 5;

/// The weights of the numbers of the statistics.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Numbers of each block.
    counts: [usize; BLOCKS],
    /// For each number, the difference that counts as one.
    pub units: Vec<f64>,
}

impl Scale {
    /// The scale if nothing is known about the graph: 2.2 times a difference that is hardly seen.
    pub fn usual(counts: [usize; BLOCKS]) -> Self {
        let units = (0..BLOCKS).flat_map(|block| vec![2.2 * NOTICED[block]; counts[block]]).collect();
        Self { counts, units }
    }

    /// The scale if the variance of each number over seeds is known. Variances are shrunk by a fifth towards the median of their
    /// block.
    #[must_use]
    pub fn of_seeds(&self, variances: &[f64]) -> Self {
        let mut units = Vec::with_capacity(variances.len());
        for (block, range) in self.ranges().into_iter().enumerate() {
            let of_block = &variances[range];
            let mut sorted = of_block.to_vec();
            sorted.sort_unstable_by(f64::total_cmp);
            let median = quantile(&sorted, 0.5);
            let unit = |variance: &f64| {
                (2.0 * (0.8 * variance + 0.2 * median) + NOTICED[block] * NOTICED[block]).max(1e-12).sqrt()
            };
            units.extend(of_block.iter().map(unit));
        }
        Self { counts: self.counts, units }
    }

    /// The numbers of each block, as ranges.
    pub fn ranges(&self) -> [std::ops::Range<usize>; BLOCKS] {
        let mut from = 0;
        self.counts.map(|count| {
            from += count;
            from - count..from
        })
    }

    /// The weight of each number in the distance; their sum is 1.
    pub fn weights(&self) -> Vec<f64> {
        let all: f64 = WEIGHTS.iter().sum();
        let of = |block: usize| vec![WEIGHTS[block] / all / self.counts[block].max(1) as f64; self.counts[block]];
        (0..BLOCKS).flat_map(of).collect()
    }

    /// The distance of two sets of numbers, and its parts by block. Small differences count by their square, large ones by their
    /// size.
    pub fn distance(&self, one: &[f64], other: &[f64]) -> (f64, Parts) {
        let parts = self.ranges().map(|range| {
            let count = range.len().max(1) as f64;
            let rho = |at: usize| {
                let z = (one[at] - other[at]) / self.units[at];
                (1.0 + z * z).sqrt() - 1.0
            };
            range.map(rho).sum::<f64>() / count
        });
        let all = parts.iter().zip(WEIGHTS).map(|(part, weight)| part * weight).sum::<f64>();
        let [color, energy, shape, corr, phase] = parts;
        (all / WEIGHTS.iter().sum::<f64>(), Parts { color, energy, shape, corr, phase })
    }
}

/// One-sided log-Gabor filters of all wavelengths and directions, for pictures of one size. A filter is a product of a part
/// for its wavelength and a part for its direction.
pub(super) struct Filters {
    radial: Vec<Vec<f64>>,
    angular: Vec<Vec<f64>>,
}

impl Filters {
    pub(super) fn of(width: usize, height: usize) -> Self {
        let frequencies =
            (0..width * height).map(|index| (frequency(index % width, width), frequency(index / width, height)));
        let spread = 2.0 * libm::pow(libm::log(0.62), 2.0);
        let (lengths, angles): (Vec<f64>, Vec<f64>) =
            frequencies.map(|(fx, fy)| (libm::hypot(fx, fy), libm::atan2(fy, fx))).unzip();
        let radial = |scale: usize| {
            let middle = 0.34 / libm::exp2(scale as f64);
            let value = |length: &f64| {
                let apart = libm::log(length / middle);
                if *length > 0.0 { 2.0 * libm::exp(-apart * apart / spread) } else { 0.0 }
            };
            lengths.iter().map(value).collect()
        };
        let angular = |direction: usize| {
            let toward = direction as f64 * PI / DIRECTIONS as f64;
            let value = |angle: &f64| {
                let turn = angle - toward;
                let turn = turn - TAU * (turn / TAU).round();
                libm::exp(-turn * turn / (2.0 * 0.35 * 0.35))
            };
            angles.iter().map(value).collect()
        };
        Self { radial: (0..SCALES).map(radial).collect(), angular: (0..DIRECTIONS).map(angular).collect() }
    }

    fn filter(&self, scale: usize, direction: usize) -> Vec<f64> {
        self.radial[scale].iter().zip(&self.angular[direction]).map(|(radial, angular)| radial * angular).collect()
    }
}

/// The filters of all sizes that were needed so far.
#[derive(Default)]
pub(super) struct Bank(BTreeMap<(usize, usize), Filters>);

#[expect(clippy::cast_possible_truncation, reason = "a part of a width in pixels")]
fn round_even(value: f64) -> usize {
    value.round_ties_even() as usize
}

impl Stats {
    /// The statistics of a picture as shown on a screen, at least 9 pixels wide and high.
    pub(super) fn of(rgb: &Colors, bank: &mut Bank) -> Self {
        let (width, height) = (rgb[0].width, rgb[0].height);
        Self::with(rgb, bank.0.entry((width, height)).or_insert_with(|| Filters::of(width, height)))
    }

    /// The statistics with the filters of the picture's size.
    pub(super) fn with(rgb: &Colors, filters_of: &Filters) -> Self {
        let mut lab = oklab(rgb);
        lab[0] = flatten(&lab[0]);
        let (width, height) = (lab[0].width, lab[0].height);
        let least = width.min(height);
        let scales = (2..=SCALES).rev().find(|&scales| least as f64 / 4.5 >= libm::exp2(scales as f64)).unwrap_or(2);
        let margin = (least / 24).max(1);
        let spectrum = Spectrum::of(&periodic(&lab[0].centred()));
        let chroma: Vec<Vec<f64>> = [1, 2].map(|channel: usize| power(&periodic(&lab[channel].centred()))).to_vec();
        let mut bands: Vec<Band> = Vec::new();
        let mut by_scale = [Vec::new(), Vec::new()];
        for scale in 0..scales {
            let by = if scale < 2 { 1 } else { 1 << (scale - 1) };
            let by = if height % by == 0 && width % by == 0 { by } else { 1 };
            let filters: Vec<Vec<f64>> = (0..DIRECTIONS).map(|direction| filters_of.filter(scale, direction)).collect();
            for (sums, power) in by_scale.iter_mut().zip(&chroma) {
                let sum: f64 = filters
                    .iter()
                    .map(|filter| filter.iter().zip(power).map(|(f, p)| p * f * f / 4.0).sum::<f64>())
                    .sum();
                sums.push(0.5 * libm::log(sum + 1e-7));
            }
            bands.extend(filters.iter().map(|filter| Band::of(&spectrum, filter, by, margin)));
        }
        let energy =
            bands.iter().map(|band| libm::log(band.rms + 2e-4)).chain(by_scale.into_iter().flatten()).collect();
        let shape = bands.iter().flat_map(|band| band.shape).collect();
        Self { blocks: [colors(&lab), energy, shape, correlations(&bands), phases(&bands)] }
    }

    /// The distance to another picture, and its parts by block.
    pub(super) fn distance(&self, other: &Self) -> (f64, Parts) {
        self.scale().distance(&self.numbers(), &other.numbers())
    }

    /// All numbers, block by block.
    pub(super) fn numbers(&self) -> Vec<f64> {
        self.blocks.concat()
    }

    /// The usual scale of these numbers.
    pub(super) fn scale(&self) -> Scale {
        let [a, b, c, d, e] = &self.blocks;
        Scale::usual([a, b, c, d, e].map(Vec::len))
    }

    /// The contrast of fine detail, of wavelengths of 3 and 6 pixels, as a logarithm.
    pub(super) fn detail(&self) -> f64 {
        let fine = &self.blocks[1][..2 * DIRECTIONS];
        fine.iter().sum::<f64>() / fine.len() as f64
    }
}

/// The power spectrum of a plane, whose sum is the variance.
fn power(plane: &Plane) -> Vec<f64> {
    let count = plane.values.len() as f64;
    Spectrum::of(plane).values.iter().map(|value| value.norm_sqr() / (count * count)).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "an index into the values")]
fn colors(lab: &Colors) -> Vec<f64> {
    let width = lab[0].width;
    let sampled: Vec<[f64; 3]> = (0..lab[0].values.len())
        .filter(|index| (index % width).is_multiple_of(2) && (index / width).is_multiple_of(2))
        .map(|index| [lab[0].values[index], CHROMA * lab[1].values[index], CHROMA * lab[2].values[index]])
        .collect();
    COLOR_DIRECTIONS
        .iter()
        .flat_map(|direction| {
            let along = |color: &[f64; 3]| color.iter().zip(direction).map(|(a, b)| a * b).sum::<f64>();
            let mut values: Vec<f64> = sampled.iter().map(along).collect();
            values.sort_unstable_by(f64::total_cmp);
            let at = |k: usize| values[((k as f64 + 0.5) / COLORS as f64 * values.len() as f64) as usize];
            (0..COLORS).map(at).collect::<Vec<_>>()
        })
        .collect()
}

/// The part of the lightness of one wavelength and direction.
struct Band {
    /// Root of the mean square.
    rms: f64,
    /// Quantiles over `rms`.
    shape: [f64; 8],
    /// Complex values at places that all bands share.
    values: Vec<Complex64>,
}

impl Band {
    fn of(spectrum: &Spectrum, filter: &[f64], by: usize, margin: usize) -> Self {
        let mut filtered = spectrum.clone();
        filtered.values.iter_mut().zip(filter).for_each(|(value, factor)| *value *= *factor);
        let mut band = filtered.cropped(by).inverse();
        let area = (by * by) as f64;
        band.values.iter_mut().for_each(|value| *value /= area);
        let edge = round_even(margin as f64 / by as f64).max(1);
        let rows = (edge..band.height - edge).step_by(if by == 1 { 2 } else { 1 });
        let mut real: Vec<f64> = rows
            .flat_map(|y| (edge..band.width - edge).map(move |x| (x, y)))
            .map(|(x, y)| band.values[y * band.width + x].re)
            .collect();
        real.sort_unstable_by(f64::total_cmp);
        let square: f64 = real.iter().map(|value| value * value).sum();
        let rms = (square / real.len().max(1) as f64).sqrt() + 1e-6;
        let place = |at: usize, count: usize| ((at + by / 2) / by).min(count - 1);
        let (width, height) = (spectrum.width, spectrum.height);
        let values =
            (margin..height - margin).step_by(2).flat_map(|y| (margin..width - margin).step_by(2).map(move |x| (x, y)));
        let values =
            values.map(|(x, y)| band.values[place(y, band.height) * band.width + place(x, band.width)]).collect();
        Self { rms, shape: SHAPE.map(|share| quantile(&real, share) / rms), values }
    }
}

/// Correlations of the amplitudes of all pairs of bands.
fn correlations(bands: &[Band]) -> Vec<f64> {
    let standard = |band: &Band| {
        let sizes: Vec<f64> = band.values.iter().map(|value| value.norm()).collect();
        let mean = sizes.iter().sum::<f64>() / sizes.len().max(1) as f64;
        let norm = sizes.iter().map(|size| (size - mean) * (size - mean)).sum::<f64>().sqrt();
        sizes.iter().map(|size| if norm > 1e-9 { (size - mean) / norm } else { 0.0 }).collect::<Vec<_>>()
    };
    let standard: Vec<Vec<f64>> = bands.iter().map(standard).collect();
    let of = |one: &Vec<f64>, other: &Vec<f64>| one.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
    standard
        .iter()
        .enumerate()
        .flat_map(|(index, one)| standard[index + 1..].iter().map(move |other| of(one, other)))
        .collect()
}

/// The phase of each band against that of the band an octave coarser, doubled: real parts, then imaginary ones.
fn phases(bands: &[Band]) -> Vec<f64> {
    let pairs = bands.iter().zip(bands.iter().skip(DIRECTIONS));
    let phase = |(fine, coarse): (&Band, &Band)| {
        let unit = |value: &Complex64| value / value.norm().max(1e-9);
        let sum: Complex64 = fine
            .values
            .iter()
            .zip(&coarse.values)
            .map(|(fine_value, coarse_value)| {
                let coarse = unit(coarse_value);
                coarse * coarse * unit(fine_value).conj() * fine_value.norm().min(3.0 * fine.rms)
            })
            .sum();
        sum / fine.values.len().max(1) as f64 / fine.rms
    };
    let phases: Vec<Complex64> = pairs.map(phase).collect();
    phases.iter().map(|phase| phase.re).chain(phases.iter().map(|phase| phase.im)).collect()
}
