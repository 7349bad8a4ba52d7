//! Surroundings that light a surface: a few built-in ones, or a panorama.
//!
//! The light is stored by direction, blurred by the reflection of surfaces of several roughnesses (B. Karis, "Real
//! Shading in Unreal Engine 4", 2013: the split sum with the viewer at the normal). Diffuse light is stored as
//! spherical harmonics (R. Ramamoorthi and P. Hanrahan, "An Efficient Representation for Irradiance Environment Maps",
//! 2001). The key light, which is the strongest one, is also stored apart, since it alone casts shadows: a texel holds
//! all light and, as a fourth number, the amount of key light in it.
//!
//! Directions are those of a camera that looks at the surface: +x to the right, +y up, +z to the viewer. Every
//! environment is scaled, channel by channel, so that a white card that faces the camera is exactly white.
mod octahedron;
mod panorama;
mod prefilter;
mod scenes;

pub use octahedron::{Map, Texel, place};
pub use panorama::{Panorama, panorama};

use crate::ground::math::{max, saturate};
use octahedron::mix;
use std::sync::{Arc, OnceLock};

/// A built-in environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// Soft boxes in a gray room; all light is neutral.
    Studio,
    /// A cloudy sky.
    Overcast,
    /// A room with one window.
    Window,
    /// The sun in a blue sky.
    Sky,
}

impl Scene {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Studio, Self::Overcast, Self::Window, Self::Sky];
}

/// Light around a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Light by the reflected direction, for roughness 0, 1/6 … 1.
    levels: Vec<Map>,
    /// Light without the key light on a white surface, by its normal: factors of the polynomials of [`harmonics`].
    diffuse: [[f32; 3]; 9],
    /// Direction to the key light; length 1.
    key: [f32; 3],
    /// Angular radius of the key light.
    key_radius: f32,
    /// Light of the key light on a white surface that faces it.
    key_light: [f32; 3],
    /// Colour of one unit of key light in a texel.
    key_color: [f32; 3],
}

/// The scalar product of two vectors.
#[inline(always)]
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The polynomials of the real spherical harmonics of the first three bands, without their factors.
#[inline(always)]
pub(crate) fn harmonics([x, y, z]: [f32; 3]) -> [f32; 9] {
    [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y]
}

/// Texels along an edge of the sharpest map of a built-in environment.
const SIZE: usize = 256;

impl Environment {
    /// A built-in environment. It is computed at the first call, in about .05 s, and kept.
    pub fn of(scene: Scene) -> Arc<Self> {
        static KNOWN: [OnceLock<Arc<Environment>>; 4] = [const { OnceLock::new() }; 4];
        let index = Scene::ALL.iter().position(|known| *known == scene).unwrap_or(0);
        if let Some(known) = KNOWN[index].get() {
            return Arc::clone(known);
        }
        // Not computed inside of `get_or_init`: while a thread waits for others, it takes further work, which may need the
        // same environment. It would then wait for itself.
        let map = Map::of(SIZE, |d| scenes::light(scene, d));
        let made = Arc::new(Self::from_map(map, scenes::key_color(scene), true));
        Arc::clone(KNOWN[index].get_or_init(|| made))
    }

    /// The levels, the sharpest first.
    pub fn levels(&self) -> &[Map] {
        &self.levels
    }

    /// Light without the key light on a white surface: factors of 1, y, z, x, xy, yz, 3z² - 1, xz and x² - y² of its
    /// normal.
    pub const fn diffuse(&self) -> &[[f32; 3]; 9] {
        &self.diffuse
    }

    /// Direction to the key light, and its light on a white surface that faces it.
    pub const fn key(&self) -> ([f32; 3], [f32; 3]) {
        (self.key, self.key_light)
    }

    /// Angular radius of the key light, in radians.
    pub const fn key_radius(&self) -> f32 {
        self.key_radius
    }

    /// Colour of one unit of key light in a texel.
    pub const fn key_color(&self) -> [f32; 3] {
        self.key_color
    }

    /// Light that a surface with this roughness, 0..1, reflects from around direction `d`, and the amount of key light
    /// in it.
    #[inline(always)]
    pub fn reflected(&self, d: [f32; 3], roughness: f32) -> Texel {
        self.reflected_at(place(d), roughness)
    }

    /// [`Self::reflected`] for the [place] of a direction.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number from 0 to 6")]
    #[expect(clippy::cast_precision_loss, reason = "a number from 0 to 6")]
    pub fn reflected_at(&self, at: [f32; 2], roughness: f32) -> Texel {
        let level = saturate(roughness) * (self.levels.len() - 1) as f32;
        let lower = (level as usize).min(self.levels.len().saturating_sub(2));
        match self.levels.get(lower..lower + 2) {
            Some([sharp, blurred]) => mix(sharp.at(at), blurred.at(at), level - lower as f32),
            _ => [0.0; 4],
        }
    }

    /// Light without the key light on a white surface with normal `n`.
    #[inline(always)]
    pub fn ambient(&self, n: [f32; 3]) -> [f32; 3] {
        ambient(&self.diffuse, n)
    }
}

/// [`Environment::ambient`] for the factors of the harmonics.
#[inline(always)]
fn ambient(diffuse: &[[f32; 3]; 9], n: [f32; 3]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for (factors, term) in diffuse.iter().zip(harmonics(n)) {
        for k in 0..3 {
            sum[k] += factors[k] * term;
        }
    }
    sum.map(|c| max(c, 0.0))
}

#[cfg(test)]
mod tests;
