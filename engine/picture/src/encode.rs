//! Encodes rows of `f32` samples as the bytes of a file.

use super::spec::{Depth, Format, PictureSpec, Transfer};
use super::{Encoding, SrgbEncoder};
use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Statistics of the encoded samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Tally {
    pub(super) clipped: u64,
    pub(super) non_finite: u64,
    #[serde(with = "bits")]
    pub(super) least: f32,
    #[serde(with = "bits")]
    pub(super) greatest: f32,
}

/// Serializes floats by their bits, because JSON has no infinity.
mod bits {
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(value: &f32, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u32(value.to_bits())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f32, D::Error> {
        u32::deserialize(from).map(f32::from_bits)
    }
}

impl Default for Tally {
    fn default() -> Self {
        Self { clipped: 0, non_finite: 0, least: f32::INFINITY, greatest: f32::NEG_INFINITY }
    }
}

impl Tally {
    /// Merges two tallies. The order does not matter, so threads cannot change the result.
    pub(super) fn with(self, other: Self) -> Self {
        Self {
            clipped: self.clipped + other.clipped,
            non_finite: self.non_finite + other.non_finite,
            least: self.least.min(other.least),
            greatest: self.greatest.max(other.greatest),
        }
    }
}

/// A band of whole rows.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    /// The samples of each channel, row by row.
    pub(super) planes: &'a [&'a [f32]],
    /// Index of the first row in the picture.
    pub(super) first: u32,
    pub(super) count: u32,
}

impl<'a> Rows<'a> {
    fn row(&self, channel: usize, row: usize, width: usize) -> &'a [f32] {
        &self.planes[channel][row * width..][..width]
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Arrangement {
    /// Pixel-interleaved, big-endian.
    PixelsBigEndian,
    /// Pixel-interleaved, little-endian.
    PixelsLittleEndian,
    /// Row-interleaved (channel after channel within a row), little-endian.
    Channels,
}

pub(super) struct RowEncoder {
    width: usize,
    depth: Depth,
    encoding: Encoding,
    alpha: Option<usize>,
    arrangement: Arrangement,
    /// Channel indices in the order of the file.
    order: Vec<usize>,
    srgb: Option<SrgbEncoder>,
}

/// Scratch memory of a thread that encodes a row.
#[derive(Default)]
struct Scratch {
    values: Vec<f32>,
    codes: Vec<u16>,
    halves: Vec<f16>,
}

/// The largest finite 16-bit float.
const F16_MAX: f32 = 65504.0;

impl RowEncoder {
    pub(super) fn new(spec: &PictureSpec) -> Self {
        let mut order: Vec<usize> = (0..spec.channels.len()).collect();
        let arrangement = match spec.format {
            Format::Png | Format::Jpeg(_) => Arrangement::PixelsBigEndian,
            // SVG has no pixels, so its arrangement is arbitrary.
            Format::Tiff | Format::Svg => Arrangement::PixelsLittleEndian,
            Format::Exr => {
                // EXR requires channels sorted by name.
                order.sort_by_key(|index| &spec.channels[*index]);
                Arrangement::Channels
            }
        };
        let curve = spec.depth.is_integer() && spec.encoding.transfer == Transfer::Srgb;
        Self {
            width: spec.width as usize,
            depth: spec.depth,
            encoding: spec.encoding,
            alpha: spec.alpha(),
            arrangement,
            order,
            srgb: curve.then(SrgbEncoder::new),
        }
    }

    /// Bytes of a row.
    pub(super) fn row_bytes(&self) -> usize {
        self.width * self.order.len() * self.depth.bytes()
    }

    /// Appends the bytes of a band.
    pub(super) fn encode(&self, rows: Rows<'_>, out: &mut Vec<u8>) -> Tally {
        let start = out.len();
        out.resize(start + rows.count as usize * self.row_bytes(), 0);
        let lines = out[start..].par_chunks_exact_mut(self.row_bytes()).zip(0..rows.count as usize).with_min_len(4);
        lines
            .map_init(Scratch::default, |scratch, (line, row)| self.row(rows, row, line, scratch))
            .reduce(Tally::default, Tally::with)
    }

    fn row(&self, rows: Rows<'_>, row: usize, line: &mut [u8], scratch: &mut Scratch) -> Tally {
        let mut tally = Tally::default();
        let y = rows.first.wrapping_add(u32::try_from(row).unwrap_or(u32::MAX));
        for (place, channel) in self.order.iter().enumerate() {
            let samples = rows.row(*channel, row, self.width);
            tally = tally.with(match self.depth {
                Depth::U8 | Depth::U16 => self.integers(samples, *channel, y, scratch),
                Depth::F16 => halves(samples, &mut scratch.halves, &mut scratch.values),
                Depth::F32 => range_of(samples),
            });
            let codes = scratch.codes.iter();
            match self.depth {
                Depth::U8 => self.put(line, place, codes.map(|code| code.to_le_bytes()[0]).map(|byte| [byte])),
                Depth::U16 => self.put(line, place, codes.map(|code| code.to_le_bytes())),
                Depth::F16 => self.put(line, place, scratch.halves.iter().map(|half| half.to_le_bytes())),
                Depth::F32 => self.put(line, place, samples.iter().map(|sample| sample.to_le_bytes())),
            }
        }
        tally
    }

    /// Stores the samples of a channel in a row.
    #[inline]
    fn put<const BYTES: usize>(&self, line: &mut [u8], place: usize, samples: impl Iterator<Item = [u8; BYTES]>) {
        let (cells, _) = line.as_chunks_mut::<BYTES>();
        match self.arrangement {
            Arrangement::Channels => {
                cells[place * self.width..][..self.width]
                    .iter_mut()
                    .zip(samples)
                    .for_each(|(cell, bytes)| *cell = bytes);
            }
            Arrangement::PixelsLittleEndian => {
                cells[place..]
                    .iter_mut()
                    .step_by(self.order.len())
                    .zip(samples)
                    .for_each(|(cell, bytes)| *cell = bytes);
            }
            Arrangement::PixelsBigEndian => {
                let samples = samples.map(|mut bytes| {
                    bytes.reverse();
                    bytes
                });
                cells[place..]
                    .iter_mut()
                    .step_by(self.order.len())
                    .zip(samples)
                    .for_each(|(cell, bytes)| *cell = bytes);
            }
        }
    }

    /// Quantises a row into `scratch.codes`.
    fn integers(&self, samples: &[f32], channel: usize, y: u32, scratch: &mut Scratch) -> Tally {
        let max = if self.depth == Depth::U8 { 255.0 } else { 65535.0 };
        let is_alpha = self.alpha == Some(channel);
        let (low, high) = self.encoding.range.filter(|_| !is_alpha).unwrap_or((0.0, 1.0));
        let scale = 1.0 / (high - low);
        scratch.values.clear();
        scratch.values.extend(samples.iter().map(|sample| (sample - low) * scale));
        let values = &mut scratch.values;
        let mut tally = range_of(samples);
        tally.clipped = clipped(values, 0.5 / max);

        scratch.codes.clear();
        let curve = self.srgb.as_ref().filter(|_| !is_alpha);
        if let (Some(curve), Depth::U8, false) = (curve, self.depth, self.encoding.dither) {
            scratch.codes.extend(values.iter().map(|value| u16::from(curve.code(*value))));
            return tally;
        }
        if let Some(curve) = curve {
            values.iter_mut().for_each(|value| *value = curve.encode(*value));
        }
        if self.encoding.dither {
            let channel = u32::try_from(channel).unwrap_or(0);
            let (left, top) = self.encoding.origin;
            let offsets = (0_u32..).map(|x| threshold(x.wrapping_add(left), y.wrapping_add(top), channel));
            scratch.codes.extend(values.iter().zip(offsets).map(|(value, offset)| quantise(*value, max, offset)));
        } else {
            scratch.codes.extend(values.iter().map(|value| quantise(*value, max, 0.5)));
        }
        tally
    }
}

/// Adds an offset between 0 and 1, then rounds down; ½ rounds to nearest.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "the value is clamped to the range of the integers before")]
#[expect(clippy::cast_sign_loss, reason = "the value is clamped to the range of the integers before")]
fn quantise(value: f32, max: f32, offset: f32) -> u16 {
    // Converts through i32, which processors support directly. `max` turns NaN into 0.
    ((value * max).max(0.0) + offset).min(max) as i32 as u16
}

/// The dither pattern: thresholds between 0 and 1, evenly distributed in every neighbourhood (the R2 sequence of M.
/// Roberts, "The unreasonable effectiveness of quasirandom sequences"), in integer arithmetic.
#[inline]
#[expect(clippy::cast_precision_loss, reason = "24 bits fit a float")]
fn threshold(x: u32, y: u32, channel: u32) -> f32 {
    let x = x.wrapping_add(channel.wrapping_mul(17));
    let y = y.wrapping_add(channel.wrapping_mul(59));
    let position = x.wrapping_mul(3_242_174_889).wrapping_add(y.wrapping_mul(2_447_445_414));
    (position >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Counts values that lie outside 0..1 by more than the tolerance; NaN counts.
fn clipped(values: &[f32], tolerance: f32) -> u64 {
    let (low, high) = (-tolerance, 1.0 + tolerance);
    // Short runs, so that a lane of 32 bits can hold the count.
    let runs = values.chunks(1 << 12);
    runs.map(|run| u64::from(run.iter().map(|value| u32::from(!(*value >= low && *value <= high))).sum::<u32>())).sum()
}

/// The least and greatest sample, and the number of samples that are not finite.
pub(super) fn range_of(samples: &[f32]) -> Tally {
    let mut tally = Tally::default();
    for run in samples.chunks(1 << 12) {
        let (mut least, mut greatest, mut non_finite) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8], 0_u32);
        let (blocks, rest) = run.as_chunks::<8>();
        for block in blocks {
            for lane in 0..8 {
                least[lane] = if block[lane] < least[lane] { block[lane] } else { least[lane] };
                greatest[lane] = if block[lane] > greatest[lane] { block[lane] } else { greatest[lane] };
            }
            non_finite += block.iter().map(|sample| u32::from(!sample.is_finite())).sum::<u32>();
        }
        for sample in rest {
            least[0] = least[0].min(*sample);
            greatest[0] = greatest[0].max(*sample);
            non_finite += u32::from(!sample.is_finite());
        }
        tally.least = least.iter().fold(tally.least, |a, b| a.min(*b));
        tally.greatest = greatest.iter().fold(tally.greatest, |a, b| a.max(*b));
        tally.non_finite += u64::from(non_finite);
    }
    tally
}

/// Converts samples into `halves`; `values` is scratch memory. Finite values beyond the range become the largest finite
/// value, not infinity.
pub(super) fn halves(samples: &[f32], halves: &mut Vec<f16>, values: &mut Vec<f32>) -> Tally {
    let mut tally = range_of(samples);
    halves.resize(samples.len(), f16::ZERO);
    if tally.least >= -F16_MAX && tally.greatest <= F16_MAX {
        halves.convert_from_f32_slice(samples);
        return tally;
    }
    let beyond = |sample: f32| sample.is_finite() && sample.abs() > F16_MAX;
    tally.clipped = samples.iter().filter(|sample| beyond(**sample)).count() as u64;
    let clamp = |sample: f32| if beyond(sample) { F16_MAX.copysign(sample) } else { sample };
    values.clear();
    values.extend(samples.iter().map(|sample| clamp(*sample)));
    halves.convert_from_f32_slice(values);
    tally
}
