//! Quantization, with and without dither.

use crate::ground::math::{clamp, floor_int, lerp, saturate, smooth};
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt};
use shibo_macros::choice;
use std::sync::OnceLock;

/// The quantized values: `levels` evenly spaced values, from the first to the last of `range`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    /// The lowest and the highest value.
    pub range: [f32; 2],
    /// Number of values, at least 2 and at most 2^20.
    pub levels: u32,
}

impl Steps {
    /// Index of the highest value, and the scale from values to indices.
    #[inline(always)]
    fn scale(&self) -> (f32, f32) {
        let width = self.range[1] - self.range[0];
        (self.levels.max(2).saturating_sub(1) as f32, if width.abs() < 1e-30 { 1e30 } else { 1.0 / width })
    }
}

/// The nearest quantized value. `softness`, a fraction 0..1 of a step, rounds the steps: 1 is the smoothest staircase.
pub fn quantize(input: &[f32], spec: &Steps, softness: f32, out: &mut [f32]) {
    let (last, scale) = spec.scale();
    let [low, high] = spec.range;
    simd::dispatch(
        #[inline(always)]
        || {
            for (out, x) in out.iter_mut().zip(input) {
                let at = saturate((x - low) * scale) * last;
                let floor = floor_int(at).0;
                let rest = at - floor - 0.5;
                let up = if softness > 0.0 { smooth(rest / softness + 0.5) } else { f32::from(u8::from(rest >= 0.0)) };
                *out = lerp(low, high, (floor + up) / last);
            }
        },
    );
}

/// The threshold pattern of a dither.
#[choice]
pub enum DitherPattern {
    /// Irregular and even, without lines or clusters: hardly visible
    #[default]
    BlueNoise,
    /// Cross-hatched squares of 2 × 2 pixels (Bayer)
    Bayer2,
    /// Cross-hatched squares of 4 × 4 pixels (Bayer)
    Bayer4,
    /// Cross-hatched squares of 8 × 8 pixels (Bayer)
    Bayer8,
}

/// Side of the blue-noise mask, in pixels.
const SIDE: usize = 64;

impl DitherPattern {
    /// The threshold of a pixel, between 0 and 1.
    #[inline(always)]
    #[expect(clippy::cast_sign_loss, reason = "reduced to a few bits")]
    fn threshold(self, mask: &[f32], x: i32, y: i32) -> f32 {
        let bayer = |bits: u32| {
            let mut rank = 0;
            for bit in 0..bits {
                let (a, b) = ((x >> bit) & 1, (y >> bit) & 1);
                rank = rank * 4 + ((a ^ b) * 2 + b);
            }
            (rank as f32 + 0.5) / (1u32 << (2 * bits)) as f32
        };
        match self {
            Self::BlueNoise => mask[(y as usize % SIDE) * SIDE + x as usize % SIDE],
            Self::Bayer2 => bayer(1),
            Self::Bayer4 => bayer(2),
            Self::Bayer8 => bayer(3),
        }
    }
}

/// Replaces each value by one of the two nearest of `spec`, as if at random, so that averages over a few pixels are
/// kept. Pixels count from the canvas' corner. With `period`, the pattern restarts after that number of pixels, so that
/// it repeats with the canvas. `channel` shifts the pattern; `amount` 0 is no dither.
///
/// # Panics
/// If a plane is smaller than the frame.
pub fn dither(
    input: &[f32],
    frame: &Frame,
    period: [Option<i32>; 2],
    (spec, pattern, amount): (&Steps, DitherPattern, f32),
    channel: i32,
    out: &mut [f32],
) {
    let (last, scale) = spec.scale();
    let [low, high] = spec.range;
    let mask = blue_noise();
    let place = |k: usize, at: i32| {
        #[expect(clippy::cast_possible_truncation, reason = "pixels of a canvas")]
        let first = libm::round(frame.origin[k] / frame.step[k]).clamp(-1e9, 1e9) as i32;
        let at = at.saturating_add(first);
        let at = period[k].map_or(at, |period| at.rem_euclid(period.max(1)));
        // Never negative, and 2^30 is a multiple of all pattern sizes.
        at.wrapping_add(1 << 30) & i32::MAX
    };
    let width = frame.window.columns().max(1);
    let columns: Vec<i32> =
        (frame.window.x..).take(frame.window.columns()).map(|x| place(0, x) + channel * 23).collect();
    for ((out, input), y) in out.chunks_exact_mut(width).zip(input.chunks_exact(width)).zip(frame.window.y..) {
        let y = place(1, y) + channel * 41;
        for ((out, x), column) in out.iter_mut().zip(input).zip(&columns) {
            let threshold = 0.5 + (pattern.threshold(mask, *column, y) - 0.5) * amount;
            let at = saturate((x - low) * scale) * last;
            let up = floor_int(at + 1.0 - threshold).0;
            *out = lerp(low, high, clamp(up, 0.0, last) / last);
        }
    }
}

/// The blue-noise mask, computed on first use: thresholds 0..1, each once.
fn blue_noise() -> &'static [f32] {
    static MASK: OnceLock<Vec<f32>> = OnceLock::new();
    MASK.get_or_init(void_and_cluster)
}

/// The set pixels on a torus of [`SIDE`]² pixels, and their density around each pixel.
struct Crowd {
    on: Vec<bool>,
    energy: Vec<f64>,
    bell: Vec<f64>,
}

/// Radius of the Gaussian in pixels; beyond it the value is 0.
const REACH: i32 = 8;

impl Crowd {
    fn new() -> Self {
        let around = || (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| f64::from(x * x + y * y)));
        let bell = around().map(|square| libm::exp(-square / (2.0 * 1.5 * 1.5))).collect();
        Self { on: vec![false; SIDE * SIDE], energy: vec![0.0; SIDE * SIDE], bell }
    }

    fn set(&mut self, at: usize, on: bool) {
        self.on[at] = on;
        let sign = if on { 1.0 } else { -1.0 };
        let (x, y, reach) = (at % SIDE, at / SIDE, REACH.unsigned_abs() as usize);
        for (k, bell) in self.bell.iter().enumerate() {
            let (dx, dy) = (k % (2 * reach + 1), k / (2 * reach + 1));
            let (px, py) = ((x + SIDE + dx - reach) % SIDE, (y + SIDE + dy - reach) % SIDE);
            self.energy[py * SIDE + px] += sign * bell;
        }
    }

    /// The set pixel at the highest density, or the unset pixel at the lowest; the first of several.
    fn extreme(&self, ones: bool) -> usize {
        let sign = if ones { 1.0 } else { -1.0 };
        let mut best = (f64::MIN, 0);
        for (k, energy) in self.energy.iter().enumerate() {
            if self.on[k] == ones && sign * energy > best.0 + 1e-9 {
                best = (sign * energy, k);
            }
        }
        best.1
    }
}

/// The method of R. Ulichney ("The void-and-cluster method for dither array generation", 1993).
fn void_and_cluster() -> Vec<f32> {
    let (mut crowd, count) = (Crowd::new(), SIDE * SIDE);
    let hash = crate::ground::hash::Hash::new(0x53_4849_424f);
    (0..count).filter(|k| hash.unit(*k as u64) < 0.1).for_each(|k| crowd.set(k, true));
    // Moves the pixel of the tightest cluster to the largest void, until both are the same pixel. The bound guarantees
    // termination.
    for _ in 0..count {
        let from = crowd.extreme(true);
        crowd.set(from, false);
        let to = crowd.extreme(false);
        crowd.set(to, true);
        if from == to {
            break;
        }
    }
    let mut rank = vec![0usize; count];
    let begin = crowd.on.iter().filter(|on| **on).count();
    let start = crowd.on.clone();
    for place in (0..begin).rev() {
        let at = crowd.extreme(true);
        crowd.set(at, false);
        rank[at] = place;
    }
    (0..count).filter(|k| start[*k]).for_each(|k| crowd.set(k, true));
    for place in begin..count {
        let at = crowd.extreme(false);
        crowd.set(at, true);
        rank[at] = place;
    }
    rank.into_iter().map(|rank| (rank as f32 + 0.5) / count as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::window::WindowExt;
    use shibo_value::Window;

    const UNIT: Steps = Steps { range: [0.0, 1.0], levels: 3 };

    fn frame(w: usize, h: usize) -> Frame {
        Frame::new(Window::of(0, 0, w, h), [0.5; 2])
    }

    #[test]
    fn quantizes_to_the_nearest_value() {
        let input = [-1.0, 0.1, 0.24, 0.26, 0.6, 0.8, 2.0];
        let mut out = [0.0; 7];
        quantize(&input, &UNIT, 0.0, &mut out);
        assert_eq!(out, [0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0]);
        quantize(&input, &Steps { range: [1.0, -1.0], levels: 2 }, 0.0, &mut out);
        assert_eq!(out, [-1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
        let mut soft = [0.0; 1];
        quantize(&[0.25], &UNIT, 1.0, &mut soft);
        assert!((soft[0] - 0.25).abs() < 1e-6);
    }

    #[test]
    fn the_mask_holds_every_threshold_once_and_has_no_low_frequencies() {
        let mask = void_and_cluster();
        let mut sorted = mask.clone();
        sorted.sort_by(f32::total_cmp);
        assert!(sorted.iter().enumerate().all(|(k, v)| *v == (k as f32 + 0.5) / 4096.0));
        // Means over 8 × 8 pixels of white noise would vary by 1/√12/8 = 0.036.
        let mut squares = 0.0;
        for block in 0..64 {
            let (x, y) = (block % 8 * 8, block / 8 * 8);
            let mean: f32 = (0..64).map(|k| mask[(y + k / 8) * SIDE + x + k % 8]).sum::<f32>() / 64.0;
            squares += (mean - 0.5) * (mean - 0.5) / 64.0;
        }
        assert!(squares.sqrt() < 0.012, "{}", squares.sqrt());
    }

    #[test]
    fn dither_keeps_averages() {
        for pattern in [DitherPattern::BlueNoise, DitherPattern::Bayer2, DitherPattern::Bayer4, DitherPattern::Bayer8] {
            for value in [0.0, 0.1, 0.33, 0.5, 0.77, 1.0] {
                let mut out = vec![9.0; 64 * 64];
                let input = vec![value; 64 * 64];
                dither(&input, &frame(64, 64), [None; 2], (&UNIT, pattern, 1.0), 0, &mut out);
                assert!(out.iter().all(|v| [0.0, 0.5, 1.0].contains(v)));
                let mean = out.iter().sum::<f32>() / 4096.0;
                let step = if pattern == DitherPattern::Bayer2 { 0.07 } else { 0.02 };
                assert!((mean - value).abs() < step, "{pattern:?}: {value} became {mean}");
            }
        }
        let mut out = [9.0; 4];
        dither(&[0.2, 0.3, 0.7, 0.8], &frame(2, 2), [None; 2], (&UNIT, DitherPattern::BlueNoise, 0.0), 0, &mut out);
        assert_eq!(out, [0.0, 0.5, 0.5, 1.0]);
    }

    #[test]
    fn matches_the_bayer_matrix() {
        let at = |x: i32, y: i32| DitherPattern::Bayer2.threshold(&[], x, y) * 4.0 - 0.5;
        assert_eq!([at(0, 0), at(1, 0), at(0, 1), at(1, 1)], [0.0, 2.0, 3.0, 1.0]);
        let mut ranks: Vec<f32> =
            (0..64).map(|k| DitherPattern::Bayer8.threshold(&[], k % 8, k / 8) * 64.0 - 0.5).collect();
        ranks.sort_by(f32::total_cmp);
        assert!(ranks.iter().enumerate().all(|(k, v)| *v == k as f32));
    }

    #[test]
    fn dither_pattern_is_fixed_to_the_canvas() {
        let input = vec![0.3; 40 * 4];
        let (mut whole, mut part) = (vec![0.0; 160], vec![0.0; 160]);
        let spec = (&UNIT, DitherPattern::BlueNoise, 1.0);
        dither(&input, &frame(40, 4), [Some(20), None], spec, 0, &mut whole);
        assert_eq!(whole[..20], whole[20..40]);
        // The same pixels on a grid with another origin.
        let moved = Frame { origin: [3.5, 0.0], step: [0.5; 2], window: Window::of(-7, 0, 40, 4) };
        dither(&input, &moved, [Some(20), None], spec, 0, &mut part);
        assert_eq!(whole, part);
    }
}
