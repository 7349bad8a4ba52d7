//! A lit picture of a material seen from above.
//!
//! Key light from the upper left, a weak fill from the opposite side, and a sky whose brightness grows towards the
//! upper left; diffuse Lambert, specular GGX with height-correlated Smith shadowing (E. Heitz, 2014) and Schlick's
//! Fresnel term with 4 % at normal incidence. Ambient occlusion darkens sky and fill fully and the key light by half,
//! as a substitute for cast shadows. Metal reflects its own colour and scatters nothing; sheen is the light of fine
//! fibres seen from the side; a coat is a second, smooth surface of 4 %. Fibres in the surface, as in wood, reflect
//! light of the material's own colour in a cone around them (S. Marschner et al., "Measuring and modeling the
//! appearance of finished wood", 2005); the white gloss over them may be narrower along them than across. A [`Curve`]
//! is applied last. Output is linear light 0..1.
//!
//! The gloss of the fill light is weighted by the square of openness: light from the side does not reach the ground of
//! a groove.

use crate::ground::math::{self, max, min};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index};
use crate::surface::display::{Curve, shown};
use crate::surface::light::{Along, Light, lying};
use shibo_value::Window;

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefSpec {
    /// Size of a pixel, mm.
    pub step: [f64; 2],
    /// Factor on the height; 1 is true to scale.
    pub strength: f64,
    /// Direction to the key light, radians from +x towards +y (y down); 225° is the upper left.
    pub azimuth: f64,
    /// Its elevation above the surface, radians.
    pub elevation: f64,
    /// Factor on all light before the curve.
    pub exposure: f64,
    /// Tone curve.
    pub curve: Curve,
    /// Strength of the reflection of fibres in the surface.
    pub fibers: f64,
    /// Anisotropy of gloss along fibres, 0..1; at 1 it is narrowest along them.
    pub anisotropy: f64,
}

impl ReliefSpec {
    /// Light from the upper left, 40° high.
    pub const fn new(step: [f64; 2]) -> Self {
        Self {
            step,
            strength: 1.0,
            azimuth: 225.0_f64.to_radians(),
            elevation: 40.0_f64.to_radians(),
            exposure: 1.0,
            curve: Curve::Filmic,
            fibers: 0.0,
            anisotropy: 0.0,
        }
    }
}

/// Planes of the material over the window, without gaps.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Base colour, linear light.
    pub color: [&'a [f32]; 3],
    /// Perceptual roughness 0..1.
    pub roughness: &'a [f32],
    /// Openness 0..1.
    pub occlusion: &'a [f32],
    /// A normal that replaces that of the height, ½ + ½n with y up.
    pub normal: Option<[&'a [f32]; 3]>,
    /// Amount of fibres in the surface, 0..1, and their angle in degrees.
    pub fibers: Option<[&'a [f32]; 2]>,
    /// Channels that few materials have.
    pub finish: Option<Finish<'a>>,
}

/// Further planes of a material: shares from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct Finish<'a> {
    /// Metalness.
    pub metallic: &'a [f32],
    /// Strength of the sheen.
    pub sheen: &'a [f32],
    /// Strength of the clear coat.
    pub coat: &'a [f32],
    /// Channels that even fewer materials have.
    pub lacquer: Option<Lacquer<'a>>,
}

/// A coat with its own roughness and normal, and emission.
#[derive(Clone, Copy, Debug)]
pub struct Lacquer<'a> {
    /// Roughness of the coat, 0..1.
    pub roughness: &'a [f32],
    /// Normal of the coat, ½ + ½n with y up; that of the ground if `None`.
    pub normal: Option<[&'a [f32]; 3]>,
    /// Emission, linear light.
    pub emission: [&'a [f32]; 3],
}

/// Pixels of height read beyond the window.
pub const HALO: i32 = 1;

/// Renders `rect` from heights in mm and the surface's planes into linear-light planes.
///
/// # Panics
/// If `height` does not cover `rect` grown by [`HALO`], or a plane is smaller than `rect`.
pub fn relief(height: &View<'_>, rect: Window, surface: &Surface<'_>, spec: &ReliefSpec, out: [&mut [f32]; 3]) {
    let key = Light::new(spec.azimuth, spec.elevation, [2.35, 2.22, 2.05]);
    let fill = Light::new(spec.azimuth + std::f64::consts::PI * 0.9, 0.6, [0.20, 0.24, 0.30]);
    simd::dispatch(
        #[inline(always)]
        || render(height, rect, surface, spec, [key, fill], out),
    );
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "slopes need no more than f32")]
fn render(
    height: &View<'_>,
    rect: Window,
    surface: &Surface<'_>,
    spec: &ReliefSpec,
    lights: [Light; 2],
    mut out: [&mut [f32]; 3],
) {
    let [kx, ky] = spec.step.map(|s| (-0.5 * spec.strength / s) as f32);
    let exposure = spec.exposure as f32;
    let w = rect.columns();
    for (j, y) in (0..rect.rows()).zip(rect.y..) {
        for start in (0..w).step_by(BLOCK) {
            let n = BLOCK.min(w - start);
            let at = j * w + start;
            let mut block = Block::default();
            let rows = [y - 1, y, y + 1].map(|y| height.row(rect.x + index(start) - 1, y, n + 2));
            for (block, row) in block.height.iter_mut().zip(rows) {
                block[..n + 2].copy_from_slice(row);
            }
            for (block, plane) in block.color.iter_mut().zip(surface.color) {
                block[..n].copy_from_slice(&plane[at..at + n]);
            }
            block.rough[..n].copy_from_slice(&surface.roughness[at..at + n]);
            block.slopes([kx, ky]);
            if let Some(normal) = surface.normal {
                unpack(&mut block.normal, normal, at, n);
            }
            if let Some(fibers) = surface.fibers {
                block.fibers(fibers, at, n);
            }
            block.open[..n].copy_from_slice(&surface.occlusion[at..at + n]);
            block.anisotropy = if surface.fibers.is_some() { spec.anisotropy as f32 } else { 0.0 };
            if let Some(finish) = surface.finish {
                for (block, plane) in block.finish.iter_mut().zip([finish.metallic, finish.sheen, finish.coat]) {
                    block[..n].copy_from_slice(&plane[at..at + n]);
                }
                if let Some(lacquer) = finish.lacquer {
                    block.lacquer(&lacquer, at, n);
                    block.shade_with::<2>(&lights);
                } else {
                    block.shade_with::<1>(&lights);
                }
            } else {
                block.shade_with::<0>(&lights);
            }
            if surface.fibers.is_some() {
                block.shine(spec.fibers as f32, &lights[0]);
            }
            block.show(exposure, spec.curve);
            for (plane, block) in out.iter_mut().zip(&block.out) {
                plane[at..at + n].copy_from_slice(&block[..n]);
            }
        }
    }
}

/// Pixels shaded at a time, in local arrays: the compiler cannot know that the caller's fourteen planes do not overlap,
/// and would not vectorise loops over them.
const BLOCK: usize = 64;

struct Block {
    height: [[f32; BLOCK + 2]; 3],
    color: [[f32; BLOCK]; 3],
    rough: [f32; BLOCK],
    open: [f32; BLOCK],
    /// With y down.
    normal: [[f32; BLOCK]; 3],
    /// Amount of fibres in the surface, and the cosine and sine of their angle.
    fiber: [[f32; BLOCK]; 3],
    /// Anisotropy of gloss along fibres.
    anisotropy: f32,
    finish: [[f32; BLOCK]; 3],
    coat_rough: [f32; BLOCK],
    /// Normal of the coat, with y down; of length 0 if it is that of the ground.
    coat_normal: [[f32; BLOCK]; 3],
    emission: [[f32; BLOCK]; 3],
    out: [[f32; BLOCK]; 3],
}

impl Default for Block {
    fn default() -> Self {
        Self {
            height: [[0.0; BLOCK + 2]; 3],
            color: [[0.0; BLOCK]; 3],
            rough: [1.0; BLOCK],
            open: [1.0; BLOCK],
            normal: [[0.0; BLOCK]; 3],
            fiber: [[0.0; BLOCK]; 3],
            anisotropy: 0.0,
            finish: [[0.0; BLOCK]; 3],
            coat_rough: [COAT; BLOCK],
            coat_normal: [[0.0; BLOCK]; 3],
            emission: [[0.0; BLOCK]; 3],
            out: [[0.0; BLOCK]; 3],
        }
    }
}

impl Block {
    #[inline(always)]
    fn lacquer(&mut self, lacquer: &Lacquer<'_>, at: usize, n: usize) {
        self.coat_rough[..n].copy_from_slice(&lacquer.roughness[at..at + n]);
        for (block, plane) in self.emission.iter_mut().zip(lacquer.emission) {
            block[..n].copy_from_slice(&plane[at..at + n]);
        }
        if let Some(normal) = lacquer.normal {
            unpack(&mut self.coat_normal, normal, at, n);
        }
    }

    /// The normals of the height.
    #[inline(always)]
    fn slopes(&mut self, [kx, ky]: [f32; 2]) {
        let [a, b, c] = &self.height;
        let [nx, ny, nz] = &mut self.normal;
        for i in 0..BLOCK {
            let (x, y) = ((b[i + 2] - b[i]) * kx, (c[i + 1] - a[i + 1]) * ky);
            let z = 1.0 / (1.0 + x * x + y * y).sqrt();
            (nx[i], ny[i], nz[i]) = (x * z, y * z, z);
        }
    }

    #[inline(always)]
    fn fibers(&mut self, [lying, angle]: [&[f32]; 2], at: usize, n: usize) {
        let [share, cosine, sine] = &mut self.fiber;
        share[..n].copy_from_slice(&lying[at..at + n]);
        for i in 0..n {
            let (s, c) = math::sin_cos(angle[at + i] * (std::f32::consts::PI / 180.0));
            (cosine[i], sine[i]) = (c, s);
        }
    }

    /// Adds the reflection of fibres: a cone around the fibre, as wide as fibre directions vary, in the colour of the
    /// material.
    #[inline(always)]
    fn shine(&mut self, gain: f32, key: &Light) {
        let color = &self.color;
        let [nx, ny, nz] = &self.normal;
        let [share, cosine, sine] = &self.fiber;
        let [red, green, blue] = &mut self.out;
        for i in 0..BLOCK {
            let (n, t) = ([nx[i], ny[i], nz[i]], [cosine[i], sine[i]]);
            let u = lying(n, t);
            // On the cone, the sines with the light and with the eye sum up to 0.
            let off = u[0] * key.l[0] + u[1] * key.l[1] + u[2] * (key.l[2] + 1.0);
            let facing = max(n[0] * key.l[0] + n[1] * key.l[1] + n[2] * key.l[2], 0.0);
            let cone = math::exp(-off * off * (0.5 / (FIBER_WIDTH * FIBER_WIDTH)));
            let lit = gain * share[i] * facing * (0.5 + 0.5 * self.open[i]) * (cone - FIBER_MEAN);
            for ((out, base), light) in [&mut *red, &mut *green, &mut *blue].into_iter().zip(color).zip(key.color) {
                out[i] = max(out[i] + light * lit * base[i], 0.0);
            }
        }
    }

    #[inline(always)]
    fn show(&mut self, exposure: f32, curve: Curve) {
        let [red, green, blue] = &mut self.out;
        for i in 0..BLOCK {
            let light = [red[i] * exposure, green[i] * exposure, blue[i] * exposure];
            [red[i], green[i], blue[i]] = shown(curve, light);
        }
    }

    #[inline(always)]
    fn shade_with<const FINISH: u8>(&mut self, lights: &[Light; 2]) {
        if self.anisotropy > 0.0 {
            self.shade::<FINISH, true>(lights);
        } else {
            self.shade::<FINISH, false>(lights);
        }
    }

    #[inline(always)]
    fn shade<const FINISH: u8, const ALONG: bool>(&mut self, lights: &[Light; 2]) {
        let [share, cosine, sine] = &self.fiber;
        let [nx, ny, nz] = &self.normal;
        let [red, green, blue] = &mut self.out;
        for i in 0..BLOCK {
            let n = [nx[i], ny[i], nz[i]];
            let along =
                if ALONG { Some(Along::new(n, [cosine[i], sine[i]], self.anisotropy * share[i])) } else { None };
            let pixel = Pixel { n, along, rough: self.rough[i], open: self.open[i] };
            let base = [self.color[0][i], self.color[1][i], self.color[2][i]];
            let finish = [self.finish[0][i], self.finish[1][i], self.finish[2][i]];
            let color = match FINISH {
                0 => pixel.color(base, lights),
                1 => pixel.finished(base, finish, (pixel.n, COAT), lights),
                _ => {
                    let own = [self.coat_normal[0][i], self.coat_normal[1][i], self.coat_normal[2][i]];
                    let normal = if own[2] > 0.0 { own } else { pixel.n };
                    let lit = pixel.finished(base, finish, (normal, self.coat_rough[i]), lights);
                    [lit[0] + self.emission[0][i], lit[1] + self.emission[1][i], lit[2] + self.emission[2][i]]
                }
            };
            [red[i], green[i], blue[i]] = color;
        }
    }
}

/// Unpacks normals from ½ + ½n with y up to vectors with y down.
#[inline(always)]
fn unpack(to: &mut [[f32; BLOCK]; 3], normal: [&[f32]; 3], at: usize, n: usize) {
    for ((block, plane), sign) in to.iter_mut().zip(normal).zip([1.0, -1.0, 1.0]) {
        for (block, stored) in block[..n].iter_mut().zip(&plane[at..at + n]) {
            *block = sign * (2.0 * stored - 1.0);
        }
    }
}

struct Pixel {
    n: [f32; 3],
    /// Fibres in the surface, if gloss is anisotropic; set for all pixels or for none.
    along: Option<Along>,
    rough: f32,
    open: f32,
}

/// A pixel under the lights, without its colour.
struct Lit {
    /// Light from all sides, by channel.
    diffuse: [f32; 3],
    /// Specular factors: of the key light with the area light beside it, and of the fill light.
    gloss: [f32; 2],
    /// The reflected sky at a reflectance of 1.
    mirror: f32,
}

impl Pixel {
    #[inline(always)]
    fn lit(&self, rough: f32, [key, fill]: &[Light; 2]) -> Lit {
        let rough = min(max(rough, 0.06), 1.0);
        let a2 = rough * rough * rough * rough;
        let shade = |light: &Light, a2: f32| match &self.along {
            Some(along) => light.shade_along(self.n, along, a2),
            None => light.shade(self.n, a2),
        };
        let (key_diffuse, key_gloss) = shade(key, a2);
        // An area light beside the key light: a second, wider highlight gives a gloss rather than points.
        let (_, wide) = shade(key, min(a2 * 4.0 + 0.1, 1.0));
        let (fill_diffuse, fill_gloss) = shade(fill, a2);
        let shadow = 0.5 + 0.5 * self.open;
        let toward = self.n[0] * key.l[0] + self.n[1] * key.l[1];
        let sky = self.open * (0.16 + 0.10 * self.n[2] + 0.10 * toward);
        let diffuse = |k: usize| key.color[k] * key_diffuse * shadow + fill.color[k] * fill_diffuse * self.open + sky;
        Lit {
            diffuse: [diffuse(0), diffuse(1), diffuse(2)],
            gloss: [(0.75 * key_gloss + 0.5 * wide) * shadow, fill_gloss * self.open * self.open],
            mirror: self.open * max(0.25 + 1.2 * toward, 0.0) * (1.0 - 0.6 * rough),
        }
    }

    #[inline(always)]
    fn color(&self, base: [f32; 3], lights: &[Light; 2]) -> [f32; 3] {
        let lit = self.lit(self.rough, lights);
        let [key, fill] = lights;
        let channel = |k: usize| {
            let gloss = key.color[k] * key.fresnel * lit.gloss[0] + fill.color[k] * fill.fresnel * lit.gloss[1];
            base[k] * lit.diffuse[k] * 0.96 + gloss + 0.04 * lit.mirror
        };
        [channel(0), channel(1), channel(2)]
    }

    /// Adds metal, sheen and a coat of that normal and roughness.
    #[inline(always)]
    fn finished(
        &self,
        base: [f32; 3],
        [metal, sheen, coat]: [f32; 3],
        (normal, rough): ([f32; 3], f32),
        lights: &[Light; 2],
    ) -> [f32; 3] {
        let (lit, [key, fill]) = (self.lit(self.rough, lights), lights);
        // The coat is smooth: it mirrors the lights themselves, without the wide highlight.
        let rough = min(max(rough, 0.06), 1.0);
        let smooth = rough * rough * rough * rough;
        let shadow = 0.5 + 0.5 * self.open;
        let side = self.open * self.open;
        let (over_key, over_fill) = (key.shade(normal, smooth).1 * shadow, fill.shade(normal, smooth).1 * side);
        let away = 1.0 - min(max(self.n[2], 0.0), 1.0);
        let nap = sheen * away * away;
        let channel = |k: usize| {
            let f0 = 0.04 + (base[k] - 0.04) * metal;
            let fresnel = |light: &Light, f0: f32| light.color[k] * (f0 + (1.0 - f0) * light.grazing);
            let gloss = fresnel(key, f0) * lit.gloss[0] + fresnel(fill, f0) * lit.gloss[1];
            let under = base[k] * (1.0 - metal) * lit.diffuse[k] * 0.96 + gloss + f0 * lit.mirror;
            let fuzz = nap * (0.5 + 0.5 * base[k]) * lit.diffuse[k];
            let clear = fresnel(key, 0.04) * over_key + fresnel(fill, 0.04) * over_fill;
            under * (1.0 - 0.06 * coat) + fuzz + coat * clear
        };
        [channel(0), channel(1), channel(2)]
    }
}

/// Default roughness of a coat.
pub const COAT: f32 = 0.25;

/// Width of the cone in which fibres reflect, as a sum of two sines; and its mean over fibres in all directions of a
/// level surface, by which the material becomes darker elsewhere.
const FIBER_WIDTH: f32 = 0.3;
const FIBER_MEAN: f32 = 0.5;

#[cfg(test)]
mod tests;
