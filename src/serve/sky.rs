//! Turns a panorama into light for the lit view: blurred by the reflection of surfaces of several roughnesses, with its
//! sun as a separate light.
//!
//! After B. Karis, "Real Shading in Unreal Engine 4" (2013): the split sum with the eye at the normal. The samples read
//! the mip level that suits their density, after J. Křivánek and M. Colbert, "Real-time Shading with Filtered
//! Importance Sampling" (2008). Diffuse light by spherical harmonics, after R. Ramamoorthi and P. Hanrahan, "An
//! Efficient Representation for Irradiance Environment Maps" (2001). Directions: y up; the middle of the panorama is at
//! -z, and +x is to the right of it.
use glam::Vec3;
use rayon::prelude::*;
use shibo_picture::Picture;
use std::f32::consts::{PI, TAU};

/// Width of the sharpest level in texels; the height is half of it.
const WIDTH: usize = 1024;
/// Minimum width of the sharpest level, for small panoramas.
const LEAST: usize = 64;
/// Number of levels: for roughness 0, 0.2 … 1, each half as wide as the one before.
pub(super) const LEVELS: usize = 6;
/// Samples per texel of each level but the first.
const SAMPLES: [u32; LEVELS - 1] = [64, 128, 256, 512, 512];
/// Mean brightness to which panoramas are scaled: about that of the studio.
const BRIGHTNESS: f32 = 0.9;
/// Cosine of the angular radius of the sun around the brightest texel.
const SUN_COS: f32 = 0.9976;
/// Texels near the sun that exceed this multiple of the mean brightness belong to it.
const SUN: f32 = 8.0;
/// Minimum share of all light for the sun to become a separate light.
const WORTH: f32 = 0.05;
/// Greatest value that is not clamped: the maximum of half precision.
const GREATEST: f32 = 65504.0;

/// Light by direction, by latitude and longitude.
#[derive(Clone, Debug)]
pub(super) struct Map {
    pub(super) width: usize,
    pub(super) texels: Vec<Vec3>,
}

/// A panorama as light.
pub(super) struct Sky {
    /// Levels, the sharpest first.
    pub(super) levels: Vec<Map>,
    /// Light on a white surface by its normal, as coefficients of spherical harmonics.
    pub(super) diffuse: [Vec3; 9],
    /// Direction of the sun.
    pub(super) sun: Vec3,
    /// Light of the sun on a surface that faces it; black without a sun.
    pub(super) sun_light: Vec3,
}

impl Map {
    const fn height(&self) -> usize {
        self.width / 2
    }

    /// Direction of the middle of a texel.
    fn direction(&self, x: usize, y: usize) -> Vec3 {
        let (sin, cos) = (TAU * ((x as f32 + 0.5) / self.width as f32 - 0.5)).sin_cos();
        let (flat, up) = (PI * (y as f32 + 0.5) / self.height() as f32).sin_cos();
        Vec3::new(flat * sin, up, -flat * cos)
    }

    /// Solid angle of a texel of row `y`.
    fn angle(&self, y: usize) -> f32 {
        let edge = |y: usize| (PI * y as f32 / self.height() as f32).cos();
        (TAU / self.width as f32) * (edge(y) - edge(y + 1))
    }

    /// Value in a direction, interpolated between texels.
    fn at(&self, d: Vec3) -> Vec3 {
        let (w, h) = (self.width, self.height());
        let u = (0.5 + d.x.atan2(-d.z) / TAU) * w as f32 - 0.5;
        let v = (d.y.clamp(-1.0, 1.0).acos() / PI * h as f32 - 0.5).clamp(0.0, (h - 1) as f32);
        let (left, s) = whole(u + w as f32);
        let (top, t) = whole(v);
        let row = |y: usize| {
            let texel = |x: usize| self.texels[y.min(h - 1) * w + x % w];
            texel(left).lerp(texel(left + 1), s)
        };
        row(top).lerp(row(top + 1), t)
    }

    /// Map of half the width and height.
    fn halved(&self) -> Self {
        let width = self.width / 2;
        let texel = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let of = |x: usize, y: usize| self.texels[y * self.width + x];
            0.25 * (of(x, y) + of(x + 1, y) + of(x, y + 1) + of(x + 1, y + 1))
        };
        Self { width, texels: (0..width * width / 2).map(texel).collect() }
    }

    /// Sums `f` over all texels, given direction, value and solid angle of each.
    fn sum<T: std::ops::AddAssign>(&self, mut sum: T, f: impl Fn(Vec3, Vec3, f32) -> T) -> T {
        for y in 0..self.height() {
            let angle = self.angle(y);
            for x in 0..self.width {
                sum += f(self.direction(x, y), self.texels[y * self.width + x], angle);
            }
        }
        sum
    }
}

/// Integer and fractional part of a number that is not negative.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "places in a map, not negative")]
fn whole(v: f32) -> (usize, f32) {
    let floor = v.max(0.0).floor();
    (floor as usize, v.max(0.0) - floor)
}

fn luma(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

impl Sky {
    /// Computes the light of a panorama.
    ///
    /// # Errors
    /// Fails if the picture is no panorama.
    pub(super) fn of(picture: &Picture) -> Result<Self, String> {
        let mut map = panorama(picture)?;
        let sphere = 4.0 * PI;
        let (sun, mut sun_light) = take_sun(&mut map);
        // Brightness of a white ball as seen by a camera, hence with the sun on it.
        let bright = map.sum(0.0, |_, c, angle| luma(c) * angle) / sphere + 2.0 * luma(sun_light) / sphere;
        if bright <= 0.0 {
            return Err("it is black everywhere".to_owned());
        }
        let scale = BRIGHTNESS / bright;
        map.texels.iter_mut().for_each(|c| *c *= scale);
        sun_light *= scale;
        let diffuse = harmonics(&map);
        let pyramid: Vec<Map> = std::iter::successors(Some(map), |map| (map.width > 2).then(|| map.halved())).collect();
        let levels = (0..LEVELS).map(|level| blurred(&pyramid, level)).collect();
        Ok(Self { levels, diffuse, sun, sun_light })
    }

    /// Encodes the light for pages: width, height and number of levels as integers; the nine coefficients, the
    /// direction and the light of the sun as three floats each; then the levels by rows, with nine bits per colour and
    /// a shared exponent of five bits.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let first = &self.levels[0];
        let head = [first.width, first.height(), self.levels.len()].map(|n| u32::try_from(n).unwrap_or(0));
        let numbers = self.diffuse.iter().chain([&self.sun, &self.sun_light]).flat_map(|v| v.to_array());
        let texels = self.levels.iter().flat_map(|level| level.texels.iter().map(|c| shared_exponent(*c)));
        let words = head.into_iter().chain(numbers.map(f32::to_bits)).chain(texels);
        words.flat_map(u32::to_le_bytes).collect()
    }
}

/// Resamples a picture to a panorama: each texel is the mean of the pixels under it.
fn panorama(picture: &Picture) -> Result<Map, String> {
    let (width, height) = (picture.width as usize, picture.height as usize);
    if width < 8 || width.abs_diff(2 * height) > width / 50 + 1 {
        return Err(format!("it has {width} × {height} pixels; a panorama is twice as wide as high"));
    }
    let plane = |c: u8| picture.plane(if picture.channels < 3 { 0 } else { c });
    let planes = [plane(0), plane(1), plane(2)];
    let sound = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(0.0, GREATEST) };
    let wide = WIDTH.min(1 << width.ilog2()).max(LEAST);
    let high = wide / 2;
    // Pixels under texel `n` of `count`, and the share of each that lies there.
    let under = |n: usize, count: usize, pixels: usize| {
        let (from, to) = (n as f32 * pixels as f32 / count as f32, (n + 1) as f32 * pixels as f32 / count as f32);
        let (first, last) = (whole(from).0, whole(to.ceil()).0.clamp(whole(from).0 + 1, pixels));
        (first..last).map(move |i| (i, (to.min((i + 1) as f32) - from.max(i as f32)).max(0.0)))
    };
    let columns: Vec<Vec<(usize, f32)>> = (0..wide).map(|x| under(x, wide, width).collect()).collect();
    let row = |y: usize| {
        let rows: Vec<(usize, f32)> = under(y, high, height).collect();
        let texel = |under: &Vec<(usize, f32)>| {
            let (mut sum, mut all) = (Vec3::ZERO, 0.0);
            for (j, share) in &rows {
                for (i, part) in under {
                    let at = j * width + i;
                    let weight = share * part;
                    sum += weight * Vec3::from_array(planes.map(|plane| sound(plane[at])));
                    all += weight;
                }
            }
            sum / all.max(f32::MIN_POSITIVE)
        };
        columns.iter().map(texel).collect::<Vec<Vec3>>()
    };
    let texels = (0..high).into_par_iter().flat_map_iter(row).collect();
    Ok(Map { width: wide, texels })
}

/// Removes the sun from a panorama; returns its direction and its light on a surface that faces it. The remaining
/// texels there are as bright as other bright texels. Without a sun nothing changes.
fn take_sun(map: &mut Map) -> (Vec3, Vec3) {
    let brightest = (0..map.texels.len()).max_by(|a, b| luma(map.texels[*a]).total_cmp(&luma(map.texels[*b])));
    let at = brightest.unwrap_or(0);
    let peak = map.direction(at % map.width, at / map.width);
    let near = |d: Vec3| d.dot(peak) > SUN_COS;
    let rest = map.sum(0.0, |d, c, angle| if near(d) { 0.0 } else { luma(c) * angle });
    let bound = SUN * rest / (4.0 * PI);
    let above = |c: Vec3| c * (1.0 - bound / luma(c).max(f32::MIN_POSITIVE)).max(0.0);
    let light = map.sum(Vec3::ZERO, |d, c, angle| if near(d) { above(c) * angle } else { Vec3::ZERO });
    if luma(light) < WORTH * rest {
        return (Vec3::Y, Vec3::ZERO);
    }
    let way = map.sum(Vec3::ZERO, |d, c, angle| if near(d) { d * luma(above(c)) * angle } else { Vec3::ZERO });
    let width = map.width;
    for i in 0..map.texels.len() {
        if near(map.direction(i % width, i / width)) {
            let c = map.texels[i];
            map.texels[i] = c - above(c);
        }
    }
    (way.normalize_or(peak), light)
}

/// Light on a white surface by its normal, divided by π like the values of a map.
fn harmonics(map: &Map) -> [Vec3; 9] {
    let mut sums = [Vec3::ZERO; 9];
    for y in 0..map.height() {
        let angle = map.angle(y);
        for x in 0..map.width {
            let basis = basis(map.direction(x, y));
            let light = map.texels[y * map.width + x] * angle;
            sums.iter_mut().zip(basis).for_each(|(sum, b)| *sum += light * b);
        }
    }
    // A cosine lobe scales the bands by 1, 2/3 and 1/4; the page multiplies by the same polynomials without their
    // factors.
    let bands = [1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25];
    let mut out = [Vec3::ZERO; 9];
    for (i, sum) in sums.into_iter().enumerate() {
        out[i] = sum * bands[i] * FACTORS[i];
    }
    out
}

/// Factors of the real spherical harmonics of the first three bands.
const FACTORS: [f32; 9] =
    [0.282_095, 0.488_603, 0.488_603, 0.488_603, 1.092_548, 1.092_548, 0.315_392, 1.092_548, 0.546_274];

/// Real spherical harmonics of a direction.
fn basis(d: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = d;
    let plain = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
    let mut out = [0.0; 9];
    for (out, (p, f)) in out.iter_mut().zip(plain.into_iter().zip(FACTORS)) {
        *out = p * f;
    }
    out
}

/// Reflection of a surface with the roughness of `level`, by the reflected direction.
fn blurred(pyramid: &[Map], level: usize) -> Map {
    let Some(count) = level.checked_sub(1).map(|n| SAMPLES[n]) else { return pyramid[0].clone() };
    let size = Map { width: (pyramid[0].width >> level).max(2), texels: Vec::new() };
    let (width, source) = (size.width, &pyramid[0]);
    let roughness = level as f32 / (LEVELS - 1) as f32;
    let alpha2 = roughness.powi(4);
    // Directions around +z from which light arrives, their weights, and the binary logarithm of the solid angle each
    // represents.
    let mut lobe = Vec::new();
    for i in 0..count {
        let (a, b) = ((i as f32 + 0.5) / count as f32, f32::from_bits(0x3f80_0000 | (i.reverse_bits() >> 9)) - 1.0);
        let cos2 = (1.0 - b) / (1.0 + (alpha2 - 1.0) * b);
        let (cos, sin) = (cos2.sqrt(), (1.0 - cos2).max(0.0).sqrt());
        let half = Vec3::new(sin * (TAU * a).cos(), sin * (TAU * a).sin(), cos);
        let light = 2.0 * cos * half - Vec3::Z;
        if light.z > 0.0 {
            let d = alpha2 / (PI * (cos2 * (alpha2 - 1.0) + 1.0).powi(2));
            // The density of directions is d · n·h / (4 v·h); here n·h = v·h.
            lobe.push((light, light.z, -(count as f32 * d / 4.0).log2()));
        }
    }
    let row = |y: usize| {
        let size = &size;
        let lobe = &lobe;
        (0..width).map(move |x| {
            let z = size.direction(x, y);
            let side = if z.y.abs() < 0.99 { Vec3::Y } else { Vec3::X };
            let right = side.cross(z).normalize();
            let up = z.cross(right);
            let (mut sum, mut all) = (Vec3::ZERO, 0.0);
            for (light, weight, angle) in lobe {
                let d = light.x * right + light.y * up + light.z * z;
                let texel = source
                    .angle(whole(d.y.clamp(-1.0, 1.0).acos() / PI * source.height() as f32).0.min(source.height() - 1));
                let (at, between) = whole((0.5 * (angle - texel.log2()) + 0.5).min((pyramid.len() - 1) as f32));
                let value = pyramid[at].at(d);
                let value = if between > 0.0 {
                    value.lerp(pyramid[(at + 1).min(pyramid.len() - 1)].at(d), between)
                } else {
                    value
                };
                sum += *weight * value;
                all += *weight;
            }
            sum / all.max(f32::MIN_POSITIVE)
        })
    };
    let texels = (0..width / 2).into_par_iter().flat_map_iter(row).collect();
    Map { width, texels }
}

/// Packs a colour into 32 bits: nine bits per channel and a shared exponent of five.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "numbers from 0 to 511")]
fn shared_exponent(c: Vec3) -> u32 {
    const MOST: f32 = 65408.0;
    let c = c.clamp(Vec3::ZERO, Vec3::splat(MOST));
    let most = c.max_element();
    // Exponent of the next power of two; small values get the minimum.
    let mut exponent = (((most.to_bits() >> 23) & 255).cast_signed() - 126).max(-15);
    let step = |exponent: i32| 2.0_f32.powi(exponent - 9);
    if (most / step(exponent) + 0.5).floor() >= 512.0 {
        exponent += 1;
    }
    let code = |v: f32| (v / step(exponent) + 0.5).floor() as u32;
    (exponent + 15).cast_unsigned() << 27 | code(c.z) << 18 | code(c.y) << 9 | code(c.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_picture::SampleKind;

    /// Makes a panorama from a function of the direction.
    fn picture(width: u32, f: impl Fn(Vec3) -> Vec3) -> Picture {
        let map = Map { width: width as usize, texels: Vec::new() };
        let colours: Vec<Vec3> = (0..map.height())
            .flat_map(|y| (0..map.width).map(move |x| (x, y)))
            .map(|(x, y)| f(map.direction(x, y)))
            .collect();
        let planes = [0, 1, 2].map(|k| colours.iter().map(|c| c[k]).collect::<Vec<f32>>()).concat();
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        Picture { width, height: width / 2, channels: 3, planes, source: SampleKind::F32, names, has_alpha: false }
    }

    fn light(sky: &Sky, n: Vec3) -> Vec3 {
        let plain = [1.0, n.y, n.z, n.x, n.x * n.y, n.y * n.z, 3.0 * n.z * n.z - 1.0, n.x * n.z, n.x * n.x - n.y * n.y];
        sky.diffuse.iter().zip(plain).map(|(c, p)| *c * p).sum()
    }

    #[test]
    fn even_sky_gives_even_light() {
        let sky = Sky::of(&picture(256, |_| Vec3::new(2.0, 4.0, 2.0))).unwrap();
        let even = Vec3::new(2.0, 4.0, 2.0) * BRIGHTNESS / luma(Vec3::new(2.0, 4.0, 2.0));
        assert_eq!(sky.levels.iter().map(|level| level.width).collect::<Vec<_>>(), [256, 128, 64, 32, 16, 8]);
        for level in &sky.levels {
            assert!(level.texels.iter().all(|c| c.distance(even) < 1e-4), "{}", level.width);
        }
        for n in [Vec3::X, Vec3::Y, Vec3::NEG_Z, Vec3::ONE.normalize()] {
            assert!(light(&sky, n).distance(even) < 1e-3, "{n}: {}", light(&sky, n));
        }
        assert_eq!(sky.sun_light, Vec3::ZERO);
        assert_eq!(sky.bytes().len(), 4 * (3 + 33 + sky.levels.iter().map(|l| l.texels.len()).sum::<usize>()));
    }

    #[test]
    fn half_sky_lights_from_its_side() {
        let sky = Sky::of(&picture(256, |d| Vec3::splat(if d.x > 0.0 { 1.0 } else { 0.0 }))).unwrap();
        // A surface facing the half gets all its light, one at right angles half, one facing away none.
        let full = 2.0 * BRIGHTNESS;
        for (n, share) in [(Vec3::X, 1.0), (Vec3::Z, 0.5), (Vec3::Y, 0.5), (Vec3::NEG_X, 0.0)] {
            assert!((light(&sky, n).x / full - share).abs() < 0.04, "{n}: {}", light(&sky, n).x / full);
        }
        // A mirror shows the edge sharp, rough surfaces show it blurred.
        let beside = Vec3::new(0.2, 0.0, 1.0).normalize();
        let seen = sky.levels.iter().map(|level| level.at(beside).x / full).collect::<Vec<_>>();
        assert!(seen[0] > 0.999 && seen.is_sorted_by(|a, b| a >= b) && seen[5] < 0.7, "{seen:?}");
        for level in &sky.levels {
            assert!((level.at(Vec3::Z).x / full - 0.5).abs() < 0.05);
        }
    }

    #[test]
    fn extracts_sun_as_separate_light() {
        let toward = Vec3::new(0.4, 0.5, -0.6).normalize();
        let radius = 0.02_f32;
        let with =
            |sun: f32| picture(1024, move |d| if d.dot(toward) > radius.cos() { Vec3::splat(sun) } else { Vec3::ONE });
        let sky = Sky::of(&with(20_000.0)).unwrap();
        assert!(sky.sun.dot(toward) > 0.9999, "{}", sky.sun);
        // The sun's light is that of its disk; the remaining panorama is nearly even.
        let disk = 20_000.0 * PI * radius * radius;
        let even = sky.levels[0].at(Vec3::NEG_Y).x;
        let share = sky.sun_light.x / even / disk;
        assert!((share - 1.0).abs() < 0.05, "{share}");
        assert!(sky.levels[0].texels.iter().all(|c| c.x < 8.5 * even));
        // A spot that is hardly brighter is no sun.
        assert_eq!(Sky::of(&with(12.0)).unwrap().sun_light, Vec3::ZERO);
        // Values that are not finite do no harm.
        let mut odd = with(1.0);
        odd.planes[7] = f32::NAN;
        odd.planes[8] = f32::INFINITY;
        odd.planes[9] = -5.0;
        assert!(
            Sky::of(&odd)
                .unwrap()
                .levels
                .iter()
                .all(|l| l.texels.iter().all(|c| c.is_finite() && c.min_element() >= 0.0))
        );
    }

    #[test]
    fn rejects_pictures_that_are_no_panoramas() {
        let mut wide = picture(256, |_| Vec3::ONE);
        wide.height = 64;
        wide.planes.truncate(3 * 256 * 64);
        assert!(Sky::of(&wide).err().unwrap().contains("twice as wide as high"));
        assert!(Sky::of(&picture(256, |_| Vec3::ZERO)).err().unwrap().contains("black"));
    }

    #[test]
    fn packs_colours_with_shared_exponent() {
        let back = |code: u32| {
            let step = 2.0_f32.powi((code >> 27).cast_signed() - 24);
            Vec3::new((code & 511) as f32, (code >> 9 & 511) as f32, (code >> 18 & 511) as f32) * step
        };
        for c in [[0.0, 0.0, 0.0], [1.0, 0.5, 0.25], [0.999, 0.001, 3.2], [40_000.0, 1.0, 70_000.0], [1e-6, 2e-7, 0.0]]
        {
            let c = Vec3::from_array(c);
            let off = (back(shared_exponent(c)) - c.min(Vec3::splat(65408.0))).abs().max_element();
            assert!(off <= c.max_element() / 512.0 + 1e-7, "{c} {}", back(shared_exponent(c)));
        }
    }
}
