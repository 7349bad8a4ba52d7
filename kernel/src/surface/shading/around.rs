//! Light of an environment on a block of pixels: the split sum of B. Karis, "Real Shading in Unreal Engine 4" (2013),
//! with D. Lazarov's fit of the reflectance ("Getting More Physical in Call of Duty: Black Ops II", 2013). Light that
//! rough surfaces lose between facets is added again in their colour (C. Fdez-Agüera, "A Multiple-Scattering Microfacet
//! Model for Real-Time Image-based Lighting", 2019, section 3).
use super::block::{BLOCK, Block};
use super::light::Along;
use crate::ground::math::{exp2, max, min, saturate};
use crate::surface::environment::{Environment, dot, harmonics, place};

/// An environment, turned about the axis to the viewer.
#[derive(Clone, Copy)]
pub(in crate::surface) struct Around<'a> {
    environment: &'a Environment,
    /// Cosine and sine of the turn from +x towards +y, y down.
    turn: [f32; 2],
}

/// Tilts of facets across fibres, in multiples of the width of their distribution: equal shares of it lie between them.
const TILTS: [f32; 7] = [-1.664, -0.696, -0.298, 0.0, 0.298, 0.696, 1.664];

/// Increase of α² by the squared change of the normal within a pixel: twice the variance of an even spread.
const SPREAD: f32 = 1.0 / 6.0;
/// Greatest increase of α² by normals that differ within a pixel.
const MOST_SPREAD: f32 = 0.18;

impl<'a> Around<'a> {
    /// `turn` in radians.
    pub(in crate::surface) fn new(environment: &'a Environment, turn: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "directions need no more than f32")]
        let turn = [libm::cos(turn) as f32, libm::sin(turn) as f32];
        Self { environment, turn }
    }

    /// From a vector of the picture, with y down, to one of the environment.
    #[inline(always)]
    fn inward(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let [c, s] = self.turn;
        [c * x + s * y, s * x - c * y, z]
    }

    /// Direction of the light that fibres reflect, with y down: between the key light and the viewer, since the light
    /// comes from many sides.
    pub(in crate::surface) fn fiber_key(&self) -> [f32; 3] {
        let [x, y, z] = self.key();
        let z = z + 0.35;
        let long = (x * x + y * y + z * z).sqrt();
        [x / long, y / long, z / long]
    }

    /// Direction to the key light in the picture, with y down.
    pub(in crate::surface) fn key(&self) -> [f32; 3] {
        // A turn with a mirror image is its own inverse.
        self.inward(self.environment.key().0)
    }
}

/// Lookups in the maps of an environment.
struct Mirror {
    /// Places in the maps.
    at: [[f32; BLOCK]; 2],
    /// Roughness.
    rough: [f32; BLOCK],
    /// Light found: red, green, blue and the amount of key light.
    light: [[f32; BLOCK]; 4],
}

impl Mirror {
    const fn new() -> Self {
        Self { at: [[0.0; BLOCK]; 2], rough: [1.0; BLOCK], light: [[0.0; BLOCK]; 4] }
    }

    /// Adds `share` of the light at the places.
    #[inline(always)]
    fn look_up(&mut self, environment: &Environment, share: f32) {
        for i in 0..BLOCK {
            let found = environment.reflected_at([self.at[0][i], self.at[1][i]], self.rough[i]);
            for (light, value) in self.light.iter_mut().zip(found) {
                light[i] += share * value;
            }
        }
    }

    /// Light at a pixel of which the share `lit` of the key light arrives.
    #[inline(always)]
    fn seen(&self, i: usize, key_color: [f32; 3], lit: f32) -> [f32; 3] {
        let lost = (1.0 - lit) * self.light[3][i];
        [0, 1, 2].map(|k| max(self.light[k][i] - key_color[k] * lost, 0.0))
    }
}

/// The direction from which a surface with normal `n` reflects light to the viewer in direction `v`.
#[inline(always)]
fn mirrored(n: [f32; 3], v: [f32; 3]) -> [f32; 3] {
    let twice = 2.0 * dot(n, v);
    [twice * n[0] - v[0], twice * n[1] - v[1], twice * n[2] - v[2]]
}

/// Factor and summand of the reflectance at normal incidence, by roughness and the cosine to the viewer.
#[inline(always)]
fn reflectance(rough: f32, cosine: f32) -> [f32; 2] {
    let x = 1.0 - rough;
    let y = 0.0425 - 0.0275 * rough;
    let z = 1.04 - 0.572 * rough;
    let w = 0.022 * rough - 0.04;
    let a = min(x * x, exp2(-9.28 * cosine)) * x + y;
    [z - 1.04 * a, w + 1.04 * a]
}

/// Schlick's term of a clear coat.
#[inline(always)]
fn coat_reflectance(cosine: f32) -> f32 {
    let away = 1.0 - saturate(cosine);
    let squared = away * away;
    0.04 + 0.96 * squared * squared * away
}

impl Block {
    /// Shades the block; `FINISH` as for the lamp.
    #[inline(always)]
    pub(in crate::surface) fn shade_around<const FINISH: u8>(&mut self, around: &Around<'_>) {
        if self.anisotropy > 0.0 {
            self.around::<FINISH, true>(around);
        } else {
            self.around::<FINISH, false>(around);
        }
    }

    /// The normal and the direction to the viewer, in the environment.
    #[inline(always)]
    fn facing(&self, i: usize, around: &Around<'_>) -> [[f32; 3]; 2] {
        [&self.normal, &self.view].map(|of| around.inward([of[0][i], of[1][i], of[2][i]]))
    }

    /// Roughness of the block, increased by normals that differ within a pixel (Y. Tokuyoshi and A. Kaplanyan, "Improved
    /// Geometric Specular Antialiasing", 2019).
    #[inline(always)]
    fn widened(&self, rough: &[f32; BLOCK]) -> [f32; BLOCK] {
        let mut out = [1.0; BLOCK];
        for i in 0..BLOCK {
            let rough = min(max(rough[i], 0.045), 1.0);
            let squared = rough * rough;
            out[i] = min((squared * squared + min(SPREAD * self.spread[i], MOST_SPREAD)).sqrt().sqrt(), 1.0);
        }
        out
    }

    /// Light that the surface reflects.
    #[inline(always)]
    fn gloss<const ALONG: bool>(&self, rough: &[f32; BLOCK], around: &Around<'_>) -> Mirror {
        let mut mirror = Mirror::new();
        mirror.rough = *rough;
        if !ALONG {
            for i in 0..BLOCK {
                let [n, v] = self.facing(i, around);
                [mirror.at[0][i], mirror.at[1][i]] = place(mirrored(n, v));
            }
            mirror.look_up(around.environment, 1.0);
            return mirror;
        }
        // Along fibres the lobe is narrow: that is a level of the maps. Across them, several of these lobes stand beside
        // each other.
        let [share, cosine, sine] = &self.fiber;
        let (mut wide, mut across) = ([0.0; BLOCK], [[0.0; BLOCK]; 3]);
        for i in 0..BLOCK {
            let n = [self.normal[0][i], self.normal[1][i], self.normal[2][i]];
            let along = Along::new(n, [cosine[i], sine[i]], self.anisotropy * share[i]);
            let [narrow, broad] = along.widths(rough[i] * rough[i]);
            wide[i] = max(broad * broad - narrow * narrow, 0.0).sqrt();
            mirror.rough[i] = max(narrow, 0.3 * wide[i]).sqrt();
            [across[0][i], across[1][i], across[2][i]] = along.across();
        }
        for tilt in TILTS {
            for i in 0..BLOCK {
                let by = tilt * wide[i];
                let [x, y, z] = [0, 1, 2].map(|k| self.normal[k][i] + by * across[k][i]);
                let long = 1.0 / (1.0 + by * by).sqrt();
                let v = around.inward([self.view[0][i], self.view[1][i], self.view[2][i]]);
                let n = around.inward([x * long, y * long, z * long]);
                [mirror.at[0][i], mirror.at[1][i]] = place(mirrored(n, v));
            }
            mirror.look_up(around.environment, 1.0 / 7.0);
        }
        mirror
    }

    /// Light that the clear coat reflects, and the cosine of its normal to the viewer.
    #[inline(always)]
    fn coated(&self, around: &Around<'_>) -> (Mirror, [f32; BLOCK]) {
        let (mut mirror, mut cosine) = (Mirror::new(), [1.0; BLOCK]);
        mirror.rough = self.widened(&self.coat_rough);
        for (i, cosine) in cosine.iter_mut().enumerate() {
            let [ground, v] = self.facing(i, around);
            let own = around.inward([self.coat_normal[0][i], self.coat_normal[1][i], self.coat_normal[2][i]]);
            let n = if own[2] > 0.0 { own } else { ground };
            *cosine = max(dot(n, v), 1e-3);
            [mirror.at[0][i], mirror.at[1][i]] = place(mirrored(n, v));
        }
        mirror.look_up(around.environment, 1.0);
        (mirror, cosine)
    }

    #[inline(always)]
    fn around<const FINISH: u8, const ALONG: bool>(&mut self, around: &Around<'_>) {
        let rough = self.widened(&self.rough);
        let gloss = self.gloss::<ALONG>(&rough, around);
        let (to_key, key_light) = around.environment.key();
        let key_color = around.environment.key_color();
        let factors = around.environment.diffuse();
        for i in 0..BLOCK {
            let [n, v] = self.facing(i, around);
            let cosine = max(dot(n, v), 1e-3);
            let [metal, sheen, _] = if FINISH > 0 { self.finish.map(|plane| plane[i]) } else { [0.0; 3] };
            let (open, lit) = (self.open[i], self.lit[i]);
            let key = max(dot(n, to_key), 0.0) * lit;
            let terms = harmonics(n);
            let [a, b] = reflectance(rough[i], cosine);
            // Less of the surroundings is hidden from a smooth surface in a hollow, and nothing is mirrored from below
            // the surface.
            let seen = 1.0 - (1.0 - open) * (0.4 + 0.6 * rough[i]);
            let shape = around.inward([self.shape[0][i], self.shape[1][i], self.shape[2][i]]);
            let above = saturate(1.0 + 1.1 * dot(mirrored(n, v), shape));
            let seen = seen * above * above;
            let light = gloss.seen(i, key_color, lit);
            let mut color = [0.0; 3];
            for k in 0..3 {
                let mut ambient = 0.0;
                for (factor, term) in factors.iter().zip(terms) {
                    ambient += factor[k] * term;
                }
                let base = self.color[k][i];
                let f0 = 0.04 + (base - 0.04) * metal;
                let once = f0 * a + b;
                let again = 1.0 + f0 * (1.0 / (a + b) - 1.0);
                let diffuse = max(ambient, 0.0) * open + key_light[k] * key;
                color[k] = base * (1.0 - metal) * (1.0 - (0.04 * a + b)) * diffuse + light[k] * once * again * seen;
                if FINISH > 0 {
                    let away = 1.0 - cosine;
                    color[k] += sheen * away * away * (0.5 + 0.5 * base) * diffuse;
                }
            }
            [self.out[0][i], self.out[1][i], self.out[2][i]] = color;
        }
        if FINISH == 0 {
            return;
        }
        if self.finish[2].iter().any(|coat| *coat > 0.0) {
            let (coated, cosine) = self.coated(around);
            for i in 0..BLOCK {
                let through = self.finish[2][i] * coat_reflectance(cosine[i]);
                let light = coated.seen(i, key_color, self.lit[i]);
                for (out, light) in self.out.iter_mut().zip(light) {
                    out[i] = out[i] * (1.0 - through) + through * light;
                }
            }
        }
        if FINISH > 1 {
            for (out, emission) in self.out.iter_mut().zip(&self.emission) {
                for (out, emission) in out.iter_mut().zip(emission) {
                    *out += emission;
                }
            }
        }
    }
}
