//! From a map of light to an [`Environment`]: diffuse light, key light, and maps blurred by roughness.
//!
//! The samples of a blurred map read the mip level that suits their density, after J. Křivánek and M. Colbert,
//! "Real-time Shading with Filtered Importance Sampling" (2008). So the result has no noise.
use super::octahedron::{Map, Texel, mix, place};
use super::{Environment, ambient, dot, harmonics};
use crate::ground::math::{clamp, log2, max, min, sin_cos};
use std::f32::consts::{PI, TAU};

/// Number of levels: for roughness 0, 1/6 … 1.
const LEVELS: u8 = 7;
/// Least number of texels along an edge of a level.
const LEAST: usize = 16;
/// Samples of a texel of each level but the first.
const SAMPLES: [u32; LEVELS as usize - 1] = [64, 96, 128, 256, 256, 512];
/// Factors of the real spherical harmonics of the first three bands.
const FACTORS: [f32; 9] =
    [0.282_095, 0.488_603, 0.488_603, 0.488_603, 1.092_548, 1.092_548, 0.315_392, 1.092_548, 0.546_274];
/// A cosine lobe scales the bands by these (Ramamoorthi and Hanrahan, equation 8), divided by π.
const BANDS: [f32; 9] = [1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25];

/// The brightness of a colour.
pub(super) fn luma([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl Environment {
    /// The environment of a map. It is scaled so that a white card that faces the camera has the brightness 1; with
    /// `balanced` it is white, too. Black light stays black.
    pub(super) fn from_map(mut map: Map, mut key_color: [f32; 3], balanced: bool) -> Self {
        let (key, key_radius, amount) = key_light(&map);
        let mut key_light = key_color.map(|c| c * amount);
        let mut diffuse = diffuse(&map, key_color);
        let rest = ambient(&diffuse, [0.0, 0.0, 1.0]);
        let card = [0, 1, 2].map(|k| max(rest[k] + key_light[k] * max(key[2], 0.0), f32::MIN_POSITIVE));
        let scale = card.map(|c| min(1.0 / if balanced { c } else { luma(card) }, 1e6));
        for k in 0..3 {
            map.scale(k, scale[k]);
            key_light[k] *= scale[k];
            key_color[k] *= scale[k];
            diffuse.iter_mut().for_each(|factors| factors[k] *= scale[k]);
        }
        let halved = |map: &Map| (map.size() > 2).then(|| map.halved());
        let pyramid: Vec<Map> = std::iter::successors(Some(map), halved).collect();
        let levels = (0..LEVELS).map(|level| blurred(&pyramid, level)).collect();
        Self { levels, diffuse, key, key_radius, key_light, key_color }
    }
}

/// Direction of the key light, its angular radius, and its light, divided by π, on a white surface that faces it.
#[expect(clippy::cast_possible_truncation, reason = "light needs no more than f32")]
fn key_light(map: &Map) -> ([f32; 3], f32, f32) {
    let sums = map.sum(|d, [.., key], angle| [d[0], d[1], d[2], 1.0].map(|c| c * key * angle)).map(|c| c as f32);
    let [x, y, z, all] = sums;
    let (way, long) = ([x, y, z], dot([x, y, z], [x, y, z]).sqrt());
    if long <= 0.0 {
        return ([0.0, 0.0, 1.0], 0.0, 0.0);
    }
    // The mean cosine over an even disk is half the sum of 1 and the cosine of its radius.
    let cosine = f64::from(clamp(2.0 * long / all - 1.0, -1.0, 1.0));
    let radius = libm::acos(cosine) as f32;
    let to = way.map(|c| c / long);
    let [amount] = map.sum(|d, texel, angle| [max(dot(d, to), 0.0) * texel[3] * angle / PI]);
    (to, radius, amount as f32)
}

/// Light without the key light on a white surface.
#[expect(clippy::cast_possible_truncation, reason = "light needs no more than f32")]
fn diffuse(map: &Map, key_color: [f32; 3]) -> [[f32; 3]; 9] {
    let sums = map.sum(|d, [r, g, b, key], angle| {
        let rest = [r - key_color[0] * key, g - key_color[1] * key, b - key_color[2] * key];
        let terms = harmonics(d);
        let mut out = [0.0; 27];
        for (i, term) in terms.iter().enumerate() {
            for k in 0..3 {
                out[3 * i + k] = rest[k] * term * angle;
            }
        }
        out
    });
    let mut out = [[0.0; 3]; 9];
    for (i, factors) in out.iter_mut().enumerate() {
        for (k, factor) in factors.iter_mut().enumerate() {
            *factor = BANDS[i] * FACTORS[i] * FACTORS[i] * sums[3 * i + k] as f32;
        }
    }
    out
}

/// Radical inverse of `i` in base 2.
fn inverse(i: u32) -> f32 {
    f32::from_bits(0x3f80_0000 | (i.reverse_bits() >> 9)) - 1.0
}

/// Reflection of a surface with the roughness of `level`, by the reflected direction.
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
fn blurred(pyramid: &[Map], level: u8) -> Map {
    let source = &pyramid[0];
    let Some(&count) = level.checked_sub(1).and_then(|n| SAMPLES.get(usize::from(n))) else { return source.clone() };
    let size = (source.size() >> level).max(LEAST.min(source.size()));
    let roughness = f32::from(level) / f32::from(LEVELS - 1);
    let alpha2 = roughness * roughness * roughness * roughness;
    // Light arrives from directions around +z: each with its weight and its mip level.
    let mut lobe = Vec::new();
    for i in 0..count {
        let (a, b) = ((i as f32 + 0.5) / count as f32, inverse(i));
        let cos2 = (1.0 - b) / (1.0 + (alpha2 - 1.0) * b);
        let (cos, sin) = (cos2.sqrt(), max(1.0 - cos2, 0.0).sqrt());
        let (s, c) = sin_cos(TAU * a);
        let light = [2.0 * cos * sin * c, 2.0 * cos * sin * s, 2.0 * cos2 - 1.0];
        if light[2] > 0.0 {
            let spread = cos2 * (alpha2 - 1.0) + 1.0;
            // The density of directions is D · n·h / (4 v·h), and here n·h = v·h. The mip level is that of texels with
            // the solid angle that the sample stands for.
            let density = alpha2 / (4.0 * PI * spread * spread);
            let texel = 4.0 * PI / (source.size() * source.size()) as f32;
            let mip = 0.5 * log2(1.0 / (count as f32 * density * texel)) + 0.5;
            lobe.push((light, light[2], max(mip, 0.0)));
        }
    }
    Map::of(size, |z| {
        let side = if z[1].abs() < 0.99 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] };
        let right = cross(side, z);
        let long = dot(right, right).sqrt();
        let right = right.map(|c| c / long);
        let up = cross(z, right);
        let (mut sum, mut all) = ([0.0; 4], 0.0);
        for (light, weight, mip) in &lobe {
            let d = [0, 1, 2].map(|k| light[0] * right[k] + light[1] * up[k] + light[2] * z[k]);
            let value = at_level(pyramid, place(d), *mip);
            for k in 0..4 {
                sum[k] += weight * value[k];
            }
            all += weight;
        }
        sum.map(|c| c / max(all, f32::MIN_POSITIVE))
    })
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The value between two levels of a pyramid.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "levels are small and not negative")]
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
fn at_level(pyramid: &[Map], at: [f32; 2], level: f32) -> Texel {
    let level = min(level, (pyramid.len() - 1) as f32);
    let lower = level as usize;
    let upper = (lower + 1).min(pyramid.len() - 1);
    mix(pyramid[lower].at(at), pyramid[upper].at(at), level - lower as f32)
}
