//! Rays: sheets of cells from the pith outwards, thin across, tall along the grain (WOOD-LOOK §4.5).
//!
//! Radii fall into bands, two interleaved sets of them; a band is divided into sectors, a sector into pieces of height,
//! each with one sheet or none. What is seen of a sheet depends on the cut: flecks, lines, or spindles.
use crate::kernel::hash::Hash;
use crate::kernel::math;
use crate::kernel::noise3::Noise3;
use crate::kernel::simd::dispatch;

/// What rays are like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayStyle {
    /// The distance of rays round the stem in mm.
    pub pitch: f32,
    /// The height of a sheet in mm.
    pub height: f32,
    /// The thickness of a sheet in mm.
    pub width: f32,
    /// The share of places with a sheet.
    pub density: f32,
    /// The length of a sheet outwards in mm.
    pub length: f32,
    /// How far sheets bend, in distances of rays.
    pub wobble: f32,
}

/// Points computed together.
const RUN: usize = 64;

/// Rays, ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Rays {
    style: RayStyle,
    bend: [Noise3; 3],
    rim: Noise3,
    place: Noise3,
}

impl Rays {
    /// From their parameters.
    pub fn new(style: RayStyle, hash: Hash) -> Self {
        let noise = |i| Noise3::new(hash, i);
        Self { style, bend: [noise(0), noise(1), noise(2)], rim: noise(3), place: noise(4) }
    }

    /// How much of pixels of `pixel` mm around points of fibre space is ray, 0..1.
    pub fn fill(&self, [x, y, z]: [&[f32]; 3], pixel: f32, out: &mut [f32]) {
        let (mut a, mut turn, mut bend) = ([0.0; RUN], [0.0; RUN], [0.0; RUN]);
        for from in (0..out.len()).step_by(RUN) {
            let n = (out.len() - from).min(RUN);
            let [x, y, z] = [x, y, z].map(|v| &v[from..][..n]);
            dispatch(
                #[inline(always)]
                || self.bend(x, y, z, &mut a, &mut turn, &mut bend),
            );
            for (i, out) in out[from..][..n].iter_mut().enumerate() {
                *out = self.cover(a[i], turn[i], bend[i], z[i], pixel);
            }
        }
    }

    /// The radius, the angle in turns, and how far rays are bent there, in sectors.
    #[inline(always)]
    fn bend(&self, x: &[f32], y: &[f32], z: &[f32], a: &mut [f32; RUN], turn: &mut [f32; RUN], bend: &mut [f32; RUN]) {
        let [n0, n1, n2] = self.bend;
        for (((x, y), a), turn) in x.iter().zip(y).zip(a.iter_mut()).zip(turn.iter_mut()) {
            *a = (x * x + y * y).sqrt();
            *turn = math::atan2(*y, *x) * (0.5 * std::f32::consts::FRAC_1_PI);
        }
        for (((a, turn), z), bend) in a.iter().zip(turn.iter()).zip(z).zip(bend.iter_mut()) {
            let far = turn * 40.0;
            *bend = n0.at(a / 26.0, far * 0.15, z / 60.0);
            *bend += 0.16 * n1.at(a / 6.0, far * 0.6, z / 15.0);
            *bend += 0.04 * n2.at(a / 1.5, far, z / 4.0);
            *bend *= self.style.wobble;
        }
    }

    /// How much of a pixel is ray.
    #[inline]
    fn cover(&self, a: f32, turn: f32, bend: f32, z: f32, pixel: f32) -> f32 {
        let s = &self.style;
        let far = turn * 40.0;
        let mut cover = 0.0;
        for set in [0.0_f32, 0.5] {
            let (floor, band) = math::floor_int(a / s.length + set);
            let middle = (floor + 0.5 - set) * s.length;
            let sectors = math::max((std::f32::consts::TAU * math::max(middle, 2.0) / s.pitch).round(), 6.0);
            let t = (turn + 0.5) * sectors + bend;
            let (below, sector) = math::floor_int(t);
            let (whole, _) = math::floor_int(sectors);
            // The last sector is the neighbour of the first.
            #[expect(clippy::cast_possible_truncation, reason = "a few thousand sectors")]
            let sector = sector.rem_euclid(whole as i32);
            let key = band * 2 + i32::from(set > 0.25);
            let word = self.place.word(key, sector, -1);
            let unit = |word: u32, shift: u32| ((word >> shift) & 0xff) as f32 * (1.0 / 255.0);
            let pitch = 1.6 * s.height;
            let along = z / pitch + unit(word, 0);
            let (low, piece) = math::floor_int(along);
            let word = self.place.word(key, sector, piece);
            if unit(word, 0) >= s.density {
                continue;
            }
            let size = 0.55 + 0.45 * unit(word, 8);
            let aside = (t - below - 0.5 - 0.5 * (unit(word, 16) - 0.5))
                * (std::f32::consts::TAU * math::max(a, 0.5) / sectors);
            let soft = math::max(pixel, 0.02);
            if aside.abs() > 0.7 * s.width + 0.5 * soft {
                continue;
            }
            let dz = (along - low - 0.5) * 2.0 * 1.6 / (2.0 * size) * 1.25;
            let da = (a - middle) * 2.0 / s.length;
            let rim = 1.0 - dz * dz - 0.9 * da * da + 0.5 * self.rim.at(a / 5.0, far * 0.3, z / 7.0);
            let width = s.width * (0.6 + 0.8 * unit(word, 24)) * math::saturate(rim * 1.5);
            let inside = math::saturate((0.5 * width - aside.abs()) / soft + 0.5) * math::min(1.0, width / soft);
            cover = math::max(cover, inside * math::smooth(rim * 4.0));
        }
        cover
    }
}
