//! Rays: sheets of cells from the pith outwards, thin across, tall along the grain.
//!
//! Radii are divided into bands, in two interleaved sets; a band is divided into sectors, a sector into pieces of
//! height, each with one sheet or none. Depending on the cut, sheets appear as flecks, lines, or spindles.
use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::simd::dispatch;
use crate::noise::noise3::Noise3;

/// Parameters of rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayStyle {
    /// The distance of rays around the stem in mm.
    pub pitch: f32,
    /// The height of a sheet in mm.
    pub height: f32,
    /// The thickness of a sheet in mm.
    pub width: f32,
    /// The share of cells with a sheet.
    pub density: f32,
    /// The radial length of a sheet in mm.
    pub length: f32,
    /// Amplitude of the bends of sheets, in distances of rays.
    pub wobble: f32,
}

/// Number of points computed together.
const RUN: usize = 64;

/// Share of a pixel's width across rays where the cut runs along them; not 0, because rays bend.
const ALONG: f32 = 0.1;

/// The polar coordinates of points: radius, angle as a share of a full circle, and bend in sectors; and the width of
/// pixels across rays, in mm.
struct Run {
    a: [f32; RUN],
    turn: [f32; RUN],
    bend: [f32; RUN],
    soft: [f32; RUN],
}

/// Rays, prepared for evaluation.
#[derive(Clone, Copy, Debug)]
pub struct Rays {
    style: RayStyle,
    bend: [Noise3; 3],
    rim: Noise3,
    place: Noise3,
}

impl Rays {
    /// Prepares rays from their settings.
    pub fn new(style: RayStyle, hash: Hash) -> Self {
        let noise = |i| Noise3::new(hash, i);
        Self { style, bend: [noise(0), noise(1), noise(2)], rim: noise(3), place: noise(4) }
    }

    /// The share of rays in pixels of `pixel` mm around points of fibre space, 0..1. On input, `out` holds the share of
    /// a pixel's width that lies across rays, 0..1: 0 where the cut runs along them, so that flecks stay as sharp as
    /// pixels.
    pub fn fill(&self, [x, y, z]: [&[f32]; 3], pixel: f32, out: &mut [f32]) {
        dispatch(
            #[inline(always)]
            || {
                let mut run = Run { a: [0.0; RUN], turn: [0.0; RUN], bend: [0.0; RUN], soft: [0.0; RUN] };
                for from in (0..out.len()).step_by(RUN) {
                    let n = (out.len() - from).min(RUN);
                    let [x, y, z] = [x, y, z].map(|v| &v[from..][..n]);
                    self.bend(x, y, z, &mut run);
                    for (soft, out) in run.soft.iter_mut().zip(&mut out[from..][..n]) {
                        *soft = math::max(pixel * math::max(*out, ALONG), 0.02);
                        *out = 0.0;
                    }
                    for set in [0.0, 0.5] {
                        self.sheets(set, &run, z, &mut out[from..][..n]);
                    }
                }
            },
        );
    }

    /// Computes the radius, the angle as a share of a full circle, and the bend of rays in sectors.
    #[inline(always)]
    fn bend(&self, x: &[f32], y: &[f32], z: &[f32], run: &mut Run) {
        let Run { a, turn, bend, .. } = run;
        let mut far = [0.0; RUN];
        for ((((x, y), a), turn), far) in x.iter().zip(y).zip(a.iter_mut()).zip(turn.iter_mut()).zip(far.iter_mut()) {
            *a = (x * x + y * y).sqrt();
            *turn = math::atan2(*y, *x) * (0.5 * std::f32::consts::FRAC_1_PI);
            *far = *turn * 40.0;
        }
        let wobble = self.style.wobble;
        let [n0, n1, n2] = self.bend;
        let at = [&a[..], &far[..], z];
        n0.each(at, [1.0 / 26.0, 0.15, 1.0 / 60.0], 0.0, bend, |_, v| wobble * v);
        n1.each(at, [1.0 / 6.0, 0.6, 1.0 / 15.0], 0.0, bend, |sum, v| sum + 0.16 * wobble * v);
        n2.each(at, [1.0 / 1.5, 1.0, 1.0 / 4.0], 0.0, bend, |sum, v| sum + 0.04 * wobble * v);
    }

    /// Adds the sheets of one of the two sets: first computes the distance of the nearest sheet for all points at once,
    /// then draws the few points that it covers.
    #[inline(always)]
    fn sheets(&self, set: f32, run: &Run, z: &[f32], out: &mut [f32]) {
        let s = &self.style;
        let n = z.len().min(RUN);
        let (per_length, per_pitch) = (1.0 / s.length, 1.0 / s.pitch);
        let tall = 1.6 * s.height;
        let per_tall = 1.0 / tall;
        let odd = i32::from(set > 0.25);
        let (mut words, mut asides, mut outs, mut ups) = ([0_u32; RUN], [0.0; RUN], [0.0; RUN], [0.0; RUN]);
        let mut spans = [0.0; RUN];
        for i in 0..n {
            let (a, turn) = (run.a[i], run.turn[i]);
            let (floor, band) = math::floor_int(a * per_length + set);
            let middle = (floor + 0.5 - set) * s.length;
            let around = std::f32::consts::TAU * math::max(middle, 2.0) * per_pitch;
            let sectors = math::max(math::floor_int(around + 0.5).0, 6.0);
            let t = (turn + 0.5) * sectors + run.bend[i];
            let below = math::floor_int(t).0;
            // The last sector is adjacent to the first.
            let sector = math::floor_int(below - math::floor_int(below / sectors).0 * sectors).1;
            let key = band.wrapping_mul(2).wrapping_add(odd);
            let along = z[i] * per_tall + byte(self.place.word(key, sector, -1), 0);
            let (low, piece) = math::floor_int(along);
            let word = self.place.word(key, sector, piece);
            let span = std::f32::consts::TAU * math::max(a, 0.5) / sectors;
            let aside = (t - below - 0.5 - 0.5 * (byte(word, 16) - 0.5)) * span;
            words[i] = word;
            spans[i] = span;
            outs[i] = (a - middle) * (2.0 * per_length);
            ups[i] = along - low - 0.5;
            asides[i] = if byte(word, 0) < s.density { aside.abs() } else { f32::INFINITY };
        }
        for i in 0..n {
            // Written so that NaN meets no ray. A pixel wider than half a sector reaches into the next sectors, which
            // are not evaluated. The wider the pixel, the more the mean of its own sector replaces them.
            let span = spans[i];
            let soft = math::min(run.soft[i], span);
            let wide = math::saturate(2.0 * soft / span - 1.0);
            if asides[i] <= 0.7 * s.width + 0.5 * soft + wide * span {
                let size = 0.55 + 0.45 * byte(words[i], 8);
                let (dz, da) = (ups[i] * 2.0 / size, outs[i]);
                let rim = self.rim.at(run.a[i] / 5.0, run.turn[i] * 12.0, z[i] / 7.0);
                let rim = 1.0 - dz * dz - 0.9 * da * da + 0.5 * rim;
                let width = s.width * (0.6 + 0.8 * byte(words[i], 24)) * math::saturate(rim * 1.5);
                // The share of the pixel that the sheet covers.
                let less = math::max(math::min(width, soft), 1e-6);
                let covered = math::saturate((0.5 * (width + soft) - asides[i]) / less) * math::min(1.0, width / soft);
                let inside = math::lerp(covered, math::min(1.0, width / span), wide);
                out[i] = math::max(out[i], inside * math::smooth(rim * 4.0));
            }
        }
    }
}

/// Eight bits of a word as a number 0..1.
#[inline(always)]
fn byte(word: u32, shift: u32) -> f32 {
    ((word >> shift) & 0xff) as f32 * (1.0 / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of end grain at points 0.05 mm apart, for pixels of a size.
    fn mean(style: RayStyle, pixel: f32) -> f32 {
        let rays = Rays::new(style, Hash::new(7));
        let n = 512;
        let mut sum = 0.0;
        for row in 0..n {
            let x: Vec<f32> = (0..n).map(|i| 40.0 + 0.05 * i as f32).collect();
            let y = vec![15.0 + 0.05 * row as f32; n];
            let mut out = vec![1.0; n];
            rays.fill([&x, &y, &vec![3.0; n]], pixel, &mut out);
            sum += out.iter().sum::<f32>() / n as f32;
        }
        sum / n as f32
    }

    #[test]
    fn keeps_mean_of_rays_at_any_pixel_size() {
        for pitch in [0.5, 1.7] {
            let style = RayStyle { pitch, height: 3.0, width: 0.16, density: 0.6, length: 20.0, wobble: 0.5 };
            let fine = mean(style, 0.02);
            assert!(fine > 0.01, "there are rays: {fine}");
            for pixel in [0.1, 0.3, 0.8, 2.5] {
                let ratio = mean(style, pixel) / fine;
                assert!((0.8..1.15).contains(&ratio), "pitch {pitch}, pixel {pixel}: {ratio} of the ray");
            }
        }
    }
}
