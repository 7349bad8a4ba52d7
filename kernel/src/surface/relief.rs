//! A lit picture of a material seen from above.
//!
//! Key light from the upper left, a weak fill from the opposite side, and a sky whose brightness grows towards the
//! upper left; diffuse Lambert, specular GGX with height-correlated Smith shadowing (E. Heitz, 2014) and Schlick's
//! Fresnel term with 4 % at normal incidence. Ambient occlusion darkens sky and fill fully and the key light by half,
//! which stands in for cast shadows. Metal reflects its own colour and scatters nothing; sheen is the light of fine
//! fibres seen from the side; a coat is a second, smooth surface of 4 %. A filmic curve (K. Narkowicz's fit of ACES)
//! ends it. Output is linear light 0..1.

use crate::ground::math::{max, min};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index};
use shibo_engine::value::Window;

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefSpec {
    /// Size of a pixel, mm.
    pub step: [f64; 2],
    /// Factor on the height; 1 is true to scale.
    pub strength: f64,
    /// Direction the key light comes from, radians from +x towards +y (y down); 225° is the upper left.
    pub azimuth: f64,
    /// Its height above the surface, radians.
    pub elevation: f64,
    /// Factor on all light before the filmic curve.
    pub exposure: f64,
}

impl ReliefSpec {
    /// Light from the upper left, 40° high.
    pub const fn new(step: [f64; 2]) -> Self {
        Self { step, strength: 1.0, azimuth: 225.0_f64.to_radians(), elevation: 40.0_f64.to_radians(), exposure: 1.0 }
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
    /// What fewer still have.
    pub lacquer: Option<Lacquer<'a>>,
}

/// A coat with a roughness and a normal of its own, and light that the surface gives off.
#[derive(Clone, Copy, Debug)]
pub struct Lacquer<'a> {
    /// Roughness of the coat, 0..1.
    pub roughness: &'a [f32],
    /// Normal of the coat, ½ + ½n with y up; that of the ground if there is none.
    pub normal: Option<[&'a [f32]; 3]>,
    /// Emission, linear light.
    pub emission: [&'a [f32]; 3],
}

/// Pixels of height read beyond the window.
pub const HALO: i32 = 1;

#[derive(Clone, Copy)]
struct Light {
    /// Towards the light.
    l: [f32; 3],
    /// Half-way to the viewer.
    h: [f32; 3],
    /// How far Schlick's term goes from normal incidence to 1: the same for every pixel since viewer and light are far.
    grazing: f32,
    /// Schlick's term for dielectrics.
    fresnel: f32,
    color: [f32; 3],
}

impl Light {
    #[expect(clippy::cast_possible_truncation, reason = "directions need no more than f32")]
    fn new(azimuth: f64, elevation: f64, color: [f32; 3]) -> Self {
        let flat = libm::cos(elevation);
        let l = [flat * libm::cos(azimuth), flat * libm::sin(azimuth), libm::sin(elevation)];
        let length = (2.0 + 2.0 * l[2]).sqrt();
        let h = [l[0] / length, l[1] / length, (l[2] + 1.0) / length];
        let away = 1.0 - h[2];
        let grazing = away * away * away * away * away;
        let fresnel = 0.04 + 0.96 * grazing;
        Self { l: l.map(|x| x as f32), h: h.map(|x| x as f32), grazing: grazing as f32, fresnel: fresnel as f32, color }
    }

    /// Diffuse factor for normal `n` (its z is also the cosine to the viewer), and specular for α² = `a2`, to be
    /// multiplied with Fresnel's.
    #[inline(always)]
    fn shade(&self, n: [f32; 3], a2: f32) -> (f32, f32) {
        let dot = |v: [f32; 3]| n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        let (nl, nh, nv) = (max(dot(self.l), 0.0), max(dot(self.h), 0.0), max(n[2], 1e-3));
        let d = nh * nh * (a2 - 1.0) + 1.0;
        let smith = nl * (nv * nv * (1.0 - a2) + a2).sqrt() + nv * (nl * nl * (1.0 - a2) + a2).sqrt();
        // The π of the distribution cancels with that of a light given by its irradiance / π.
        (nl, nl * a2 * 0.5 / max(d * d * smith, 1e-6))
    }
}

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
            block.open[..n].copy_from_slice(&surface.occlusion[at..at + n]);
            if let Some(finish) = surface.finish {
                for (block, plane) in block.finish.iter_mut().zip([finish.metallic, finish.sheen, finish.coat]) {
                    block[..n].copy_from_slice(&plane[at..at + n]);
                }
                if let Some(lacquer) = finish.lacquer {
                    block.lacquer(&lacquer, at, n);
                    block.shade::<2>([kx, ky], exposure, &lights);
                } else {
                    block.shade::<1>([kx, ky], exposure, &lights);
                }
            } else {
                block.shade::<0>([kx, ky], exposure, &lights);
            }
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
    finish: [[f32; BLOCK]; 3],
    coat_rough: [f32; BLOCK],
    /// Of the coat, with y down; of no length where it is that of the ground.
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
            for ((block, plane), sign) in self.coat_normal.iter_mut().zip(normal).zip([1.0, -1.0, 1.0]) {
                for (block, stored) in block[..n].iter_mut().zip(&plane[at..at + n]) {
                    *block = sign * (2.0 * stored - 1.0);
                }
            }
        }
    }

    #[inline(always)]
    fn shade<const FINISH: u8>(&mut self, [kx, ky]: [f32; 2], exposure: f32, lights: &[Light; 2]) {
        let [a, b, c] = &self.height;
        let [red, green, blue] = &mut self.out;
        for i in 0..BLOCK {
            let (x, y) = ((b[i + 2] - b[i]) * kx, (c[i + 1] - a[i + 1]) * ky);
            let z = 1.0 / (1.0 + x * x + y * y).sqrt();
            let pixel = Pixel { n: [x * z, y * z, z], rough: self.rough[i], open: self.open[i] };
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
            red[i] = filmic(color[0] * exposure);
            green[i] = filmic(color[1] * exposure);
            blue[i] = filmic(color[2] * exposure);
        }
    }
}

struct Pixel {
    n: [f32; 3],
    rough: f32,
    open: f32,
}

/// A pixel under the lights, without its colour.
struct Lit {
    /// Light that arrives from all sides, by channel.
    diffuse: [f32; 3],
    /// Specular factors of the key light and of the area light beside it, and of the fill light.
    gloss: [f32; 2],
    /// The reflected sky at a reflectance of 1.
    mirror: f32,
}

impl Pixel {
    #[inline(always)]
    fn lit(&self, rough: f32, [key, fill]: &[Light; 2]) -> Lit {
        let rough = min(max(rough, 0.06), 1.0);
        let a2 = rough * rough * rough * rough;
        let (key_diffuse, key_gloss) = key.shade(self.n, a2);
        // An area light beside the key light: a second, wider highlight gives a gloss rather than points.
        let (_, wide) = key.shade(self.n, min(a2 * 4.0 + 0.1, 1.0));
        let (fill_diffuse, fill_gloss) = fill.shade(self.n, a2);
        let shadow = 0.5 + 0.5 * self.open;
        let toward = self.n[0] * key.l[0] + self.n[1] * key.l[1];
        let sky = self.open * (0.16 + 0.10 * self.n[2] + 0.10 * toward);
        let diffuse = |k: usize| key.color[k] * key_diffuse * shadow + fill.color[k] * fill_diffuse * self.open + sky;
        Lit {
            diffuse: [diffuse(0), diffuse(1), diffuse(2)],
            gloss: [(0.75 * key_gloss + 0.5 * wide) * shadow, fill_gloss * self.open],
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

    /// With metal, sheen and a coat of that normal and roughness.
    #[inline(always)]
    fn finished(
        &self,
        base: [f32; 3],
        [metal, sheen, coat]: [f32; 3],
        (normal, rough): ([f32; 3], f32),
        lights: &[Light; 2],
    ) -> [f32; 3] {
        let (lit, [key, fill]) = (self.lit(self.rough, lights), lights);
        // The coat is smooth, so it shows the lights themselves and not the wide highlight.
        let rough = min(max(rough, 0.06), 1.0);
        let smooth = rough * rough * rough * rough;
        let shadow = 0.5 + 0.5 * self.open;
        let (over_key, over_fill) = (key.shade(normal, smooth).1 * shadow, fill.shade(normal, smooth).1 * self.open);
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

/// Roughness of a coat that has none of its own.
pub const COAT: f32 = 0.25;

/// Narkowicz's fit of the ACES curve, 0..∞ → 0..1.
#[inline(always)]
fn filmic(x: f32) -> f32 {
    let x = max(x, 0.0) * 0.8;
    min((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_towards_the_light_are_brighter() {
        let (rect, big) = (Window::of(0, 0, 8, 8), Window::of(-1, -1, 10, 10));
        let one = vec![1.0; 64];
        let half = vec![0.3; 64];
        let surface = Surface { color: [&half; 3], roughness: &half, occlusion: &one, finish: None };
        let mut values = Vec::new();
        for slope in [-0.2, 0.0, 0.2] {
            let data: Vec<f32> = (0..100u8).map(|k| slope * f32::from(k % 10)).collect();
            let [mut r, mut g, mut b] = [(); 3].map(|()| vec![0.0; 64]);
            relief(&View::new(&data, big), rect, &surface, &ReliefSpec::new([1.0; 2]), [&mut r, &mut g, &mut b]);
            assert!(r.iter().chain(&g).chain(&b).all(|v| (0.0..=1.0).contains(v)));
            values.push(g[27]);
        }
        assert!(values[2] > values[1] && values[1] > values[0], "{values:?}");
    }

    /// The picture of a slope up to the lower right, of a colour with a finish. At .33 it mirrors the light.
    fn finished(slope: f32, base: [f32; 3], finish: Option<[f32; 3]>) -> [f32; 3] {
        lacquered(slope, base, finish, None)
    }

    /// The same, with the coat's roughness, its normal and the emission.
    fn lacquered(
        slope: f32,
        base: [f32; 3],
        finish: Option<[f32; 3]>,
        lacquer: Option<(f32, Option<[f32; 3]>, f32)>,
    ) -> [f32; 3] {
        let own = lacquer.map(|(rough, normal, glow)| {
            (vec![rough; 64], normal.map(|n| n.map(|v| vec![0.5 + 0.5 * v; 64])), vec![glow; 64])
        });
        let lacquer = own.as_ref().map(|(roughness, normal, glow)| Lacquer {
            roughness,
            normal: normal.as_ref().map(|n| n.each_ref().map(|plane| &plane[..])),
            emission: [glow; 3],
        });
        let (rect, big) = (Window::of(0, 0, 8, 8), Window::of(-1, -1, 10, 10));
        let plane = |v: f32| vec![v; 64];
        let (color, half, one) = (base.map(plane), plane(0.5), plane(1.0));
        let finish = finish.map(|shares| shares.map(plane));
        let finish = finish.as_ref().map(|[metallic, sheen, coat]| Finish { metallic, sheen, coat, lacquer });
        let surface = Surface { color: color.each_ref().map(|c| &c[..]), roughness: &half, occlusion: &one, finish };
        let data: Vec<f32> = (0..100u8).map(|k| slope * f32::from(k % 10 + k / 10)).collect();
        let mut out = [plane(0.0), plane(0.0), plane(0.0)];
        let planes = out.each_mut().map(|plane| &mut plane[..]);
        relief(&View::new(&data, big), rect, &surface, &ReliefSpec::new([1.0; 2]), planes);
        out.map(|plane| plane[27])
    }

    #[test]
    fn metal_coat_and_sheen_show() {
        let red = [0.5, 0.1, 0.1];
        let plain = finished(0.3, red, None);
        let none = finished(0.3, red, Some([0.0; 3]));
        assert!(plain.iter().zip(none).all(|(a, b)| (a - b).abs() < 1e-5), "{plain:?} {none:?}");
        // Metal colours its highlight: the share of red in it is that of the metal.
        let metal = finished(0.1, red, Some([1.0, 0.0, 0.0]));
        assert!(metal[0] / metal[1] > 2.0, "{metal:?}");
        // A coat shines where its own highlight is, white; sheen is bright where it is seen from the side.
        let coat = finished(0.33, red, Some([0.0, 0.0, 1.0]));
        assert!(coat[1] - finished(0.33, red, None)[1] > 0.05, "{coat:?}");
        let gain = |slope| finished(slope, red, Some([0.0, 1.0, 0.0]))[1] - finished(slope, red, None)[1];
        assert!(gain(2.0) > 0.01 && gain(0.0).abs() < 1e-6, "{} {}", gain(2.0), gain(0.0));
    }

    #[test]
    fn a_lacquer_has_a_surface_of_its_own() {
        let (gray, coat) = ([0.2; 3], Some([0.0, 0.0, 1.0]));
        // As the ground where it has no normal, and as rough as a coat is.
        let same = lacquered(0.33, gray, coat, Some((COAT, None, 0.0)));
        assert!(same.iter().zip(finished(0.33, gray, coat)).all(|(a, b)| (a - b).abs() < 1e-6));
        // A level coat on a slope that mirrors the light does not; one that slopes so on level ground does.
        let level = lacquered(0.33, gray, coat, Some((COAT, Some([0.0, 0.0, 1.0]), 0.0)));
        assert!(same[1] - level[1] > 0.05, "{same:?} {level:?}");
        // The ground falls towards the upper left: the normal points there, which is up with y up.
        let z = 1.0 / (1.0 + 2.0 * 0.33_f32 * 0.33).sqrt();
        let sloping = Some([-0.33 * z, 0.33 * z, z]);
        let tilted = lacquered(0.0, gray, coat, Some((COAT, sloping, 0.0)));
        assert!(tilted[1] - finished(0.0, gray, coat)[1] > 0.05, "{tilted:?}");
        let glowing = lacquered(0.0, gray, None.or(Some([0.0; 3])), Some((COAT, None, 0.3)));
        assert!(glowing[1] > finished(0.0, gray, None)[1] + 0.05, "{glowing:?}");
    }
}
