//! Environments from panoramas: pictures of all directions by longitude and latitude.
use super::octahedron::{Map, Texel};
use super::prefilter::luma;
use super::{Environment, dot, scenes};
use crate::ground::math::{atan2, clamp, floor_int, max};
use std::f32::consts::{PI, TAU};

/// A panorama: scene-linear planes of red, green and blue by rows. The picture's middle is the direction in which the
/// camera looks, its upper edge is the zenith.
#[derive(Clone, Copy, Debug)]
pub struct Panorama<'a> {
    /// Pixels in a row.
    pub width: usize,
    /// Rows; half the width.
    pub height: usize,
    /// `width · height` values each.
    pub planes: [&'a [f32]; 3],
}

/// Width to which larger panoramas are scaled down.
const WIDTH: usize = 1024;
/// Cosine of the angular radius of the sun around the brightest place.
const SUN_COS: f32 = 0.9976;
/// Light near the sun that exceeds this multiple of the mean is light of the sun.
const SUN: f32 = 8.0;
/// Minimum share of all light for the sun to be the key light.
const WORTH: f32 = 0.05;
/// Values are limited to the maximum of half precision.
const GREATEST: f32 = 65504.0;

/// The environment of a panorama. A sun, if there is one, is its key light. It is scaled so that a white card that faces
/// the camera has the brightness 1.
///
/// # Errors
/// A sentence with the reason, if the picture is no panorama or is black.
pub fn panorama(picture: &Panorama<'_>) -> Result<Environment, String> {
    let (width, height) = (picture.width, picture.height);
    if width < 8 || width.abs_diff(2 * height) > width / 50 + 1 {
        return Err(format!("it has {width} × {height} pixels; a panorama is twice as wide as high"));
    }
    if picture.planes.iter().any(|plane| plane.len() < width * height) {
        return Err("it has too few values".to_owned());
    }
    let scaled = Scaled::of(picture);
    let size = (scaled.width / 4).next_power_of_two().clamp(16, 256);
    let map = Map::of(size, |d| {
        let [r, g, b] = scaled.around(scenes::to_world(d), 2.0 / size_of_map(size));
        [r, g, b, 0.0]
    });
    let [all] = map.sum(|_, [r, g, b, _], angle| [luma([r, g, b]) * angle]);
    if all <= 0.0 {
        return Err("it is black everywhere".to_owned());
    }
    let (map, color) = with_sun(map);
    Ok(Environment::from_map(map, color, false))
}

#[expect(clippy::cast_precision_loss, reason = "at most 256")]
fn size_of_map(size: usize) -> f32 {
    size as f32
}

/// A panorama of a moderate size.
struct Scaled {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
}

impl Scaled {
    /// Each texel is the mean of the pixels under it.
    fn of(picture: &Panorama<'_>) -> Self {
        let by = picture.width.div_ceil(WIDTH).max(1);
        let (width, height) = (picture.width.div_ceil(by), picture.height.div_ceil(by));
        let sound = |v: f32| clamp(v, 0.0, GREATEST);
        let texel = |i: usize| {
            let (x, y) = (by * (i % width), by * (i / width));
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for j in y..(y + by).min(picture.height) {
                for i in x..(x + by).min(picture.width) {
                    for (sum, plane) in sum.iter_mut().zip(picture.planes) {
                        *sum += sound(plane[j * picture.width + i]);
                    }
                    count += 1.0;
                }
            }
            sum.map(|c| c / max(count, 1.0))
        };
        Self { width, height, texels: (0..width * height).map(texel).collect() }
    }

    /// Value in a direction, interpolated between texels. +y is up, the middle of the picture is at -z.
    #[expect(clippy::cast_precision_loss, reason = "some thousand texels")]
    fn at(&self, d: [f32; 3]) -> [f32; 3] {
        let (w, h) = (self.width as f32, self.height as f32);
        let u = (0.5 + atan2(d[0], -d[2]) / TAU) * w - 0.5;
        let polar = atan2((d[0] * d[0] + d[2] * d[2]).sqrt(), d[1]);
        let v = clamp(polar / PI * h - 0.5, 0.0, h - 1.0);
        let ((left, i), (top, j)) = (floor_int(u), floor_int(v));
        let (s, t) = (u - left, v - top);
        let wide = i32::try_from(self.width).unwrap_or(i32::MAX);
        let texel = |i: i32, j: i32| {
            let x = usize::try_from(i.rem_euclid(wide)).unwrap_or(0);
            let y = usize::try_from(j).unwrap_or(0).min(self.height - 1);
            self.texels[y * self.width + x]
        };
        let (a, b, c, e) = (texel(i, j), texel(i + 1, j), texel(i, j + 1), texel(i + 1, j + 1));
        [0, 1, 2].map(|k| {
            let (above, below) = (a[k] + (b[k] - a[k]) * s, c[k] + (e[k] - c[k]) * s);
            above + (below - above) * t
        })
    }

    /// Mean over a square of this width, in radians, around a direction.
    fn around(&self, d: [f32; 3], wide: f32) -> [f32; 3] {
        let side = if d[1].abs() < 0.9 { [-d[2], 0.0, d[0]] } else { [0.0, d[2], -d[1]] };
        let up = [d[1] * side[2] - d[2] * side[1], d[2] * side[0] - d[0] * side[2], d[0] * side[1] - d[1] * side[0]];
        let (long, high) = (dot(side, side).sqrt(), dot(up, up).sqrt());
        let mut sum = [0.0; 3];
        for j in [-1.0, 0.0, 1.0] {
            for i in [-1.0, 0.0, 1.0] {
                let (a, b) = (i * wide / (3.0 * long), j * wide / (3.0 * high));
                let value = self.at([0, 1, 2].map(|k| d[k] + a * side[k] + b * up[k]));
                (0..3).for_each(|k| sum[k] += value[k] / 9.0);
            }
        }
        sum
    }
}

/// Adds the amount of light of the sun to a map; returns the sun's colour, too. Without a sun the amount is 0.
#[expect(clippy::cast_possible_truncation, reason = "light needs no more than f32")]
fn with_sun(map: Map) -> (Map, [f32; 3]) {
    let bright = |t: Texel| luma([t[0], t[1], t[2]]);
    let (mut peak, mut most) = ([0.0, 0.0, 1.0], 0.0);
    map.each(|d, texel| {
        if bright(texel) > most {
            (peak, most) = (d, bright(texel));
        }
    });
    let near = |d: [f32; 3]| dot(d, peak) > SUN_COS;
    let [rest] = map.sum(|d, t, angle| [if near(d) { 0.0 } else { bright(t) * angle }]);
    let bound = SUN * rest as f32 / (4.0 * PI);
    let above = |t: Texel| max(1.0 - bound / max(bright(t), f32::MIN_POSITIVE), 0.0);
    let sun = map.sum(|d, t, angle| {
        let share = if near(d) { above(t) * angle } else { 0.0 };
        [t[0] * share, t[1] * share, t[2] * share]
    });
    let light = luma(sun.map(|c| c as f32));
    if light < WORTH * rest as f32 || light <= 0.0 {
        return (map, [1.0; 3]);
    }
    let color = sun.map(|c| c as f32 / light);
    (map.mapped(|d, t| [t[0], t[1], t[2], if near(d) { above(t) * bright(t) } else { 0.0 }]), color)
}
