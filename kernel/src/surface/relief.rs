//! A lit picture of a material seen from above, under a lamp or in an [`Environment`].
//!
//! The lamp: key light from the upper left, a weak fill from the opposite side, and a sky whose brightness grows towards the
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

mod shadow;

use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index};
use crate::surface::display::Curve;
use crate::surface::environment::Environment;
use crate::surface::shading::{Around, BLOCK, Block, FIBER_KEY, Light, unpack};
use shadow::Caster;
use shibo_value::Window;

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefSpec<'a> {
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
    /// The surroundings; `None`: the lamp. Their key light stands at `azimuth`, if they have one; `elevation` is that of
    /// the lamp alone.
    pub environment: Option<&'a Environment>,
    /// Longest shadow that the surface casts in an environment, mm; 0: none.
    pub shadows: f64,
}

impl ReliefSpec<'_> {
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
            environment: None,
            shadows: 0.0,
        }
    }

    /// The environment, turned so that it looks as it was made at an azimuth of 225°.
    fn around(&self) -> Option<Around<'_>> {
        self.environment.map(|environment| Around::new(environment, self.azimuth - 225.0_f64.to_radians()))
    }

    /// The light that casts shadows.
    fn caster(&self) -> Option<Caster> {
        let (around, environment) = (self.around()?, self.environment?);
        let casts = self.shadows > 0.0 && self.strength != 0.0;
        casts.then(|| Caster::new(around.key(), environment.key_radius(), self.shadows, self.step, self.strength))
    }

    /// Pixels of height read beyond the window.
    pub fn halo(&self) -> i32 {
        self.caster().map_or(1, |caster| caster.halo())
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

/// Renders `rect` from heights in mm and the surface's planes into linear-light planes.
///
/// # Panics
/// If `height` does not cover `rect` grown by [`ReliefSpec::halo`], or a plane is smaller than `rect`.
pub fn relief(height: &View<'_>, rect: Window, surface: &Surface<'_>, spec: &ReliefSpec<'_>, out: [&mut [f32]; 3]) {
    let lights = match spec.around() {
        None => {
            let key = Light::new(spec.azimuth, spec.elevation, [2.35, 2.22, 2.05]);
            let fill = Light::new(spec.azimuth + std::f64::consts::PI * 0.9, 0.6, [0.24; 3]);
            Lights::Lamp([key, fill])
        }
        Some(around) => {
            let lit = spec.caster().map(|caster| {
                let mut lit = vec![1.0; rect.len()];
                caster.share(height, rect, &mut lit);
                lit
            });
            Lights::Around { around, fiber_key: Light::toward(around.fiber_key(), FIBER_KEY), lit }
        }
    };
    simd::dispatch(
        #[inline(always)]
        || render(height, rect, surface, spec, &lights, out),
    );
}

/// Light on a picture.
enum Lights<'a> {
    /// A key light and a fill light.
    Lamp([Light; 2]),
    /// An environment.
    Around {
        around: Around<'a>,
        /// The light that fibres reflect.
        fiber_key: Light,
        /// Share of the key light that reaches each pixel.
        lit: Option<Vec<f32>>,
    },
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "slopes need no more than f32")]
fn render(
    height: &View<'_>,
    rect: Window,
    surface: &Surface<'_>,
    spec: &ReliefSpec<'_>,
    lights: &Lights<'_>,
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
                }
            }
            if let Lights::Around { lit, .. } = lights {
                block.spreads([kx, ky]);
                match lit {
                    Some(lit) => block.lit[..n].copy_from_slice(&lit[at..at + n]),
                    // Without cast shadows, hollows are darker.
                    None => block.lit = block.open.map(|open| 0.5 + 0.5 * open),
                }
            }
            match surface.finish {
                None => block.shade_under::<0>(lights),
                Some(Finish { lacquer: None, .. }) => block.shade_under::<1>(lights),
                Some(_) => block.shade_under::<2>(lights),
            }
            if surface.fibers.is_some() {
                let (Lights::Lamp([key, _]) | Lights::Around { fiber_key: key, .. }) = lights;
                block.shine(spec.fibers as f32, key);
            }
            block.show(exposure, spec.curve);
            for (plane, block) in out.iter_mut().zip(&block.out) {
                plane[at..at + n].copy_from_slice(&block[..n]);
            }
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

    #[inline(always)]
    fn shade_under<const FINISH: u8>(&mut self, lights: &Lights<'_>) {
        match lights {
            Lights::Lamp(lights) => self.shade_with::<FINISH>(lights),
            Lights::Around { around, .. } => self.shade_around::<FINISH>(around),
        }
    }
}

pub use crate::surface::shading::COAT;

#[cfg(test)]
mod studio_tests;
#[cfg(test)]
mod tests;
