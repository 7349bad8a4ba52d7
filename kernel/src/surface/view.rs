//! A lit picture of a material on a shape, seen by a camera: a ball, a cube, a plane or a mesh.
//!
//! Rays through a grid of points in each pixel meet the shape; the material is read there and shaded as in the
//! [lit picture](super::relief) in the same [`Environment`]. The shape does not mirror itself and casts no shadow, except
//! for a soft one on the ground. Output is linear light 0..1 for a screen.
mod body;
mod shapes;

pub use body::Body;

use crate::ground::math::{exp, lerp, saturate, sin_cos};
use crate::ground::simd;
use crate::surface::display::{Curve, shown};
use crate::surface::environment::Environment;
use crate::surface::shading::{Around, BLOCK, Block, COAT, FIBER_KEY, Light};
use rayon::prelude::*;
use shapes::{Camera, Hit};

/// A shape that shows a material.
#[derive(Clone, Copy, Debug)]
pub enum Shape<'a> {
    /// A ball.
    Ball,
    /// A cube that shows three of its faces.
    Cube,
    /// A plane that is seen at an angle.
    Plane,
    /// A mesh; the material lies on it by its atlas.
    Body(&'a Body),
}

/// Planes of a material over the whole canvas, by rows. A plane with one value holds that value everywhere.
#[derive(Clone, Copy, Debug)]
pub struct Maps<'a> {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// The canvas, mm.
    pub size_mm: [f64; 2],
    /// True where the material repeats, across and down. Elsewhere its edges are continued.
    pub repeats: [bool; 2],
    /// Base colour, linear light.
    pub color: [&'a [f32]; 3],
    /// Perceptual roughness 0..1.
    pub roughness: &'a [f32],
    /// Metalness 0..1.
    pub metallic: &'a [f32],
    /// Openness 0..1.
    pub occlusion: &'a [f32],
    /// Height, mm; used for the normal if there is no plane for it.
    pub height: &'a [f32],
    /// Normal, ½ + ½n with y up.
    pub normal: Option<[&'a [f32]; 3]>,
    /// Strength of the sheen.
    pub sheen: &'a [f32],
    /// Strength of the clear coat.
    pub coat: &'a [f32],
    /// Roughness of the coat; [`COAT`] if empty.
    pub coat_roughness: &'a [f32],
    /// Emission, linear light.
    pub emission: [&'a [f32]; 3],
    /// Anisotropy of gloss, 0..1, and the angle of its fibres in degrees.
    pub anisotropy: [&'a [f32]; 2],
}

/// Parameters.
#[derive(Clone, Copy, Debug)]
pub struct ViewSpec<'a> {
    /// The shape.
    pub shape: Shape<'a>,
    /// Pixels across and down. The shape fills the square in the middle.
    pub pixels: [usize; 2],
    /// The surroundings.
    pub environment: &'a Environment,
    /// Factor on all light.
    pub exposure: f32,
    /// Strength of the reflection of fibres in the surface, as in the lit picture.
    pub fibers: f32,
}

/// Numbers of a texel.
const NUMBERS: usize = 19;
type Texel = [f32; NUMBERS];

/// Points along an edge of a pixel.
const GRID: usize = 3;

/// Texels of a material, with their normals.
struct Texture {
    size: [usize; 2],
    repeats: [bool; 2],
    /// Texels per mm.
    density: [f32; 2],
    texels: Vec<Texel>,
}

/// The value of a plane that may hold one value.
fn of(plane: &[f32], i: usize, default: f32) -> f32 {
    plane.get(if plane.len() == 1 { 0 } else { i }).copied().unwrap_or(default)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "sizes of pictures")]
impl Texture {
    fn of(maps: &Maps<'_>) -> Self {
        let [w, h] = maps.size;
        let density = [0, 1].map(|k| (maps.size[k] as f64 / maps.size_mm[k]) as f32);
        let beside = |x: usize, by: i32, count: usize, repeats: bool| {
            let (x, count) = (x as i32 + by, count as i32);
            (if repeats { x.rem_euclid(count) } else { x.clamp(0, count - 1) }) as usize
        };
        let texel = |i: usize| {
            let (x, y) = (i % w, i / w);
            let at = |dx: i32, dy: i32| {
                of(maps.height, beside(y, dy, h, maps.repeats[1]) * w + beside(x, dx, w, maps.repeats[0]), 0.0)
            };
            let slope = [0.5 * density[0] * (at(1, 0) - at(-1, 0)), 0.5 * density[1] * (at(0, 1) - at(0, -1))];
            let bend = [
                density[0] * (at(1, 0) - 2.0 * at(0, 0) + at(-1, 0)),
                density[1] * (at(0, 1) - 2.0 * at(0, 0) + at(0, -1)),
            ];
            let normal = match maps.normal {
                Some(planes) => {
                    let [x, y, z] = planes.map(|plane| 2.0 * of(plane, i, 0.5) - 1.0);
                    [x, -y, z]
                }
                None => [-slope[0], -slope[1], 1.0],
            };
            let [r, g, b] = maps.color.map(|plane| of(plane, i, 0.5));
            let [er, eg, eb] = maps.emission.map(|plane| of(plane, i, 0.0));
            let angle = of(maps.anisotropy[1], i, 0.0) * (std::f32::consts::PI / 180.0);
            let (sine, cosine) = sin_cos(angle);
            let [metal, sheen, coat] = [maps.metallic, maps.sheen, maps.coat].map(|plane| of(plane, i, 0.0));
            let gloss = of(maps.coat_roughness, i, COAT);
            let [nx, ny, nz] = normal;
            let spread = bend[0] * bend[0] + bend[1] * bend[1];
            let rough = of(maps.roughness, i, 0.5);
            let open = of(maps.occlusion, i, 1.0);
            let along = of(maps.anisotropy[0], i, 0.0);
            [r, g, b, rough, metal, open, nx, ny, nz, sheen, coat, gloss, er, eg, eb, along, cosine, sine, spread]
        };
        let texels = (0..w * h).into_par_iter().map(texel).collect();
        Self { size: maps.size, repeats: maps.repeats, density, texels }
    }

    /// The material at a place in mm, interpolated between texels.
    fn at(&self, place: [f32; 2]) -> Texel {
        let axis = |k: usize| {
            let at = place[k] * self.density[k] - 0.5;
            let count = self.size[k] as f32;
            let at = if self.repeats[k] { at - count * (at / count).floor() } else { at.clamp(0.0, count - 1.0) };
            let left = (at.max(0.0) as usize).min(self.size[k] - 1);
            let right = if left + 1 < self.size[k] {
                left + 1
            } else if self.repeats[k] {
                0
            } else {
                left
            };
            (left, right, (at - left as f32).clamp(0.0, 1.0))
        };
        let ((left, right, s), (top, bottom, t)) = (axis(0), axis(1));
        let w = self.size[0];
        let corners = [top * w + left, top * w + right, bottom * w + left, bottom * w + right];
        let [a, b, c, d] = corners.map(|i| &self.texels[i]);
        std::array::from_fn(|k| lerp(lerp(a[k], b[k], s), lerp(c[k], d[k], s), t))
    }
}

/// Renders the material on the shape: planes of red, green and blue by rows.
///
/// # Panics
/// If a plane has neither one value nor one for each pixel.
pub fn view(maps: &Maps<'_>, spec: &ViewSpec<'_>) -> [Vec<f32>; 3] {
    let texture = Texture::of(maps);
    let camera = Camera::new(spec.shape, maps.size_mm, maps.repeats);
    let rows: Vec<Vec<[f32; 3]>> =
        (0..spec.pixels[1]).into_par_iter().map(|y| row(&texture, &camera, spec, y)).collect();
    [0, 1, 2].map(|k| rows.iter().flatten().map(|pixel| pixel[k]).collect())
}

/// One row of the picture.
#[expect(clippy::cast_precision_loss, reason = "sizes of pictures")]
fn row(texture: &Texture, camera: &Camera<'_>, spec: &ViewSpec<'_>, y: usize) -> Vec<[f32; 3]> {
    let [w, h] = spec.pixels;
    let mut pixels = vec![[0.0; 3]; w];
    let mut hits: Vec<(usize, Hit)> = Vec::new();
    let share = 1.0 / (GRID * GRID) as f32;
    let scale = 1.0 / w.min(h) as f32;
    for (x, pixel) in pixels.iter_mut().enumerate() {
        for k in 0..GRID * GRID {
            let place = |pixel: usize, part: usize, count: usize| {
                (2.0 * (pixel as f32 + (part as f32 + 0.5) / GRID as f32) - count as f32) * scale
            };
            let at = [place(x, k % GRID, w), place(y, k / GRID, h)];
            match camera.meet(at) {
                Some(hit) => hits.push((x, hit)),
                None => {
                    let behind = shown(Curve::Neutral, backdrop(at, spec.shape).map(|c| c * spec.exposure));
                    (0..3).for_each(|k| pixel[k] += share * behind[k]);
                }
            }
        }
    }
    for hits in hits.chunks(BLOCK) {
        let shaded = shade(texture, spec, hits);
        for ((x, _), color) in hits.iter().zip(shaded) {
            (0..3).for_each(|k| pixels[*x][k] += share * color[k]);
        }
    }
    pixels
}

/// A gray backdrop that is brighter below, with a soft shadow under the shape.
fn backdrop([x, y]: [f32; 2], shape: Shape<'_>) -> [f32; 3] {
    let wall = lerp(0.13, 0.3, saturate(0.5 + 0.55 * y));
    // The lowest point of the shape, and half the width of its shadow.
    let ground = match shape {
        Shape::Plane => None,
        Shape::Ball => Some([0.86, 0.62]),
        Shape::Cube => Some([0.66, 0.62]),
        Shape::Body(body) => Some(body.ground()).map(|[low, half]| [0.8 * low + 0.06, 0.72 * half]),
    };
    let shadow = ground.map_or(0.0, |[low, half]| {
        let (dx, dy) = ((x - 0.1) / half, (y - low) / 0.16);
        0.7 * exp(-(dx * dx + dy * dy))
    });
    [wall * (1.0 - shadow); 3]
}

/// The colours of up to [`BLOCK`] points.
fn shade(texture: &Texture, spec: &ViewSpec<'_>, hits: &[(usize, Hit)]) -> Vec<[f32; 3]> {
    let mut block = Block::default();
    for (i, (_, hit)) in hits.iter().enumerate() {
        let texel = texture.at(hit.place);
        let [r, g, b, rough, metal, open, nx, ny, nz, sheen, coat, gloss, er, eg, eb, along, cosine, sine, spread] =
            texel;
        (0..3).for_each(|k| block.color[k][i] = [r, g, b][k]);
        block.rough[i] = rough;
        block.open[i] = open * hit.open;
        block.lit[i] = (0.7 + 0.3 * open) * saturate(1.6 * hit.open);
        block.spread[i] = spread;
        let normal = hit.turned([nx, ny, nz]);
        let fibers = hit.turned([cosine, sine, 0.0]);
        for k in 0..3 {
            block.normal[k][i] = normal[k];
            block.view[k][i] = hit.view[k];
            block.shape[k][i] = hit.normal[k];
            block.coat_normal[k][i] = hit.normal[k];
            block.finish[k][i] = [metal, sheen, coat][k];
            block.emission[k][i] = [er, eg, eb][k];
        }
        block.coat_rough[i] = gloss;
        block.fiber[0][i] = along;
        (block.fiber[1][i], block.fiber[2][i]) = (fibers[0], fibers[1]);
        block.anisotropy = block.anisotropy.max(f32::from(u8::from(along > 0.0)));
    }
    let around = Around::new(spec.environment, 0.0);
    let key = Light::toward(around.fiber_key(), FIBER_KEY);
    simd::dispatch(
        #[inline(always)]
        || {
            block.shade_around::<2>(&around);
            if spec.fibers > 0.0 {
                block.shine(spec.fibers, &key);
            }
            block.show(spec.exposure, Curve::Neutral);
        },
    );
    (0..hits.len()).map(|i| [block.out[0][i], block.out[1][i], block.out[2][i]]).collect()
}

#[cfg(test)]
mod tests;
