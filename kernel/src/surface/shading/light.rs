//! Lights of the [lit picture](super::relief) and their gloss: GGX with height-correlated Smith shadowing, isotropic
//! and, along fibres, anisotropic (E. Heitz, "Understanding the masking-shadowing function in microfacet-based BRDFs",
//! 2014, sections 5.3 and 5.4). Viewer and lights are far away. Vectors have y down.
use crate::ground::math::{max, min};

/// A light.
#[derive(Clone, Copy)]
pub(in crate::surface) struct Light {
    /// Direction to the light.
    pub(super) l: [f32; 3],
    /// Half vector between light and viewer.
    h: [f32; 3],
    /// Position of Schlick's term between normal incidence (0) and grazing (1): the same for every pixel since viewer
    /// and light are far away.
    pub(super) grazing: f32,
    /// Schlick's term for dielectrics.
    pub(super) fresnel: f32,
    pub(super) color: [f32; 3],
}

/// Projects the fibre direction `t`, seen from above, into the surface with normal `n`.
#[inline(always)]
pub(super) fn lying(n: [f32; 3], t: [f32; 2]) -> [f32; 3] {
    let away = n[0] * t[0] + n[1] * t[1];
    let u = [t[0] - away * n[0], t[1] - away * n[1], -away * n[2]];
    let long = 1.0 / max((u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt(), 1e-3);
    u.map(|c| c * long)
}

/// Fibres in a surface: the directions along and across them, and their anisotropy of gloss.
pub(super) struct Along {
    u: [f32; 3],
    v: [f32; 3],
    aspect: f32,
}

impl Along {
    /// From the normal, the fibre direction seen from above, and the anisotropy, 0..1: at 1 gloss is ten times narrower
    /// along fibres than across them, as in Burley's "Physically-based shading at Disney", 2012.
    #[inline(always)]
    pub(super) fn new(n: [f32; 3], t: [f32; 2], anisotropy: f32) -> Self {
        let u = lying(n, t);
        let v = [n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0]];
        let aspect = (1.0 - 0.9 * min(max(anisotropy, 0.0), 1.0)).sqrt();
        Self { u, v, aspect }
    }

    /// The direction across the fibres.
    #[inline(always)]
    pub(super) const fn across(&self) -> [f32; 3] {
        self.v
    }

    /// α along the fibres and across them; `a` is the isotropic α.
    #[inline(always)]
    pub(super) fn widths(&self, a: f32) -> [f32; 2] {
        [max(a * self.aspect, 1e-3), min(a / self.aspect, 1.0)]
    }

    /// Reciprocal of the facet distribution, without its factor π, for the half vector `h`; `nh` is its cosine to the
    /// surface normal.
    #[inline(always)]
    fn rarity(&self, h: [f32; 3], nh: f32, widths: [f32; 2]) -> f32 {
        let dot = |a: [f32; 3]| a[0] * h[0] + a[1] * h[1] + a[2] * h[2];
        let (hu, hv) = (dot(self.u) / widths[0], dot(self.v) / widths[1]);
        let d = hu * hu + hv * hv + nh * nh;
        widths[0] * widths[1] * d * d
    }
}

impl Light {
    #[expect(clippy::cast_possible_truncation, reason = "directions need no more than f32")]
    pub(in crate::surface) fn new(azimuth: f64, elevation: f64, color: [f32; 3]) -> Self {
        let flat = libm::cos(elevation);
        let l = [flat * libm::cos(azimuth), flat * libm::sin(azimuth), libm::sin(elevation)];
        let length = (2.0 + 2.0 * l[2]).sqrt();
        let h = [l[0] / length, l[1] / length, (l[2] + 1.0) / length];
        let away = 1.0 - h[2];
        let grazing = away * away * away * away * away;
        let fresnel = 0.04 + 0.96 * grazing;
        Self { l: l.map(|x| x as f32), h: h.map(|x| x as f32), grazing: grazing as f32, fresnel: fresnel as f32, color }
    }

    /// A light from direction `l`, with y down.
    pub(in crate::surface) fn toward([x, y, z]: [f32; 3], color: [f32; 3]) -> Self {
        let [x, y, z] = [x, y, z].map(f64::from);
        Self::new(libm::atan2(y, x), libm::asin(z.clamp(-1.0, 1.0)), color)
    }

    /// Diffuse and specular factor for normal `n` (its z is also the cosine to the viewer) and α² = `a2`. The specular
    /// factor is to be multiplied by Fresnel's term.
    #[inline(always)]
    pub(super) fn shade(&self, n: [f32; 3], a2: f32) -> (f32, f32) {
        let dot = |v: [f32; 3]| n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        let (nl, nh, nv) = (max(dot(self.l), 0.0), max(dot(self.h), 0.0), max(n[2], 1e-3));
        let d = nh * nh * (a2 - 1.0) + 1.0;
        let smith = nl * (nv * nv * (1.0 - a2) + a2).sqrt() + nv * (nl * nl * (1.0 - a2) + a2).sqrt();
        // The π of the distribution cancels with that of a light given by its irradiance / π.
        (nl, nl * a2 * 0.5 / max(d * d * smith, 1e-6))
    }

    /// The same with fibres: α is smaller along them and larger across.
    #[inline(always)]
    pub(super) fn shade_along(&self, n: [f32; 3], along: &Along, a2: f32) -> (f32, f32) {
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (nl, nh, nv) = (max(dot(n, self.l), 0.0), max(dot(n, self.h), 0.0), max(n[2], 1e-3));
        let widths = along.widths(a2.sqrt());
        let squared = widths.map(|width| width * width);
        let stretched = |u: f32, v: f32, n: f32| (squared[0] * u * u + squared[1] * v * v + n * n).sqrt();
        let to_viewer = stretched(along.u[2], along.v[2], nv);
        let to_light = stretched(dot(along.u, self.l), dot(along.v, self.l), nl);
        let smith = nl * to_viewer + nv * to_light;
        (nl, nl * 0.5 / max(along.rarity(self.h, nh, widths) * smith, 1e-6))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key() -> Light {
        Light::new(225.0_f64.to_radians(), 40.0_f64.to_radians(), [1.0; 3])
    }

    fn tilted(x: f32, y: f32) -> [f32; 3] {
        let z = 1.0 / (1.0 + x * x + y * y).sqrt();
        [x * z, y * z, z]
    }

    #[test]
    fn equals_isotropic_gloss_without_anisotropy() {
        for a2 in [0.001, 0.05, 0.5, 1.0] {
            for (x, y) in [(0.0, 0.0), (-0.2, -0.3), (0.4, 0.1)] {
                let (n, t) = (tilted(x, y), [0.6, 0.8]);
                let (plain, along) = (key().shade(n, a2), key().shade_along(n, &Along::new(n, t, 0.0), a2));
                assert!(
                    (plain.1 - along.1).abs() < 1e-3 * plain.1.abs().max(0.01),
                    "{a2} {x} {y}: {plain:?} {along:?}"
                );
            }
        }
    }

    /// Normals tilted across the fibres still shine; those tilted as much along them do not.
    #[test]
    fn gloss_is_wide_across_and_narrow_along() {
        let (key, t) = (key(), [1.0, 0.0]);
        // Around the normal that mirrors the light.
        let gloss = |dx: f32, dy: f32| {
            let n = tilted(key.h[0] / key.h[2] + dx, key.h[1] / key.h[2] + dy);
            key.shade_along(n, &Along::new(n, t, 0.8), 0.03).1
        };
        assert!(gloss(0.0, 0.25) > 3.0 * gloss(0.25, 0.0), "{} {}", gloss(0.0, 0.25), gloss(0.25, 0.0));
    }

    /// Energy conservation at any anisotropy: the distribution, projected to the surface, integrates to 1.
    #[test]
    fn normalises_anisotropic_distribution() {
        let area = |anisotropy: f32| {
            let along = Along::new([0.0, 0.0, 1.0], [0.8, 0.6], anisotropy);
            let widths = along.widths(0.3);
            let mut sum = 0.0;
            for i in -200_i16..200 {
                for j in -200_i16..200 {
                    // Over the slopes of the facets; the fourth power of the facet normal's z converts to solid angle.
                    let facet = tilted(0.025 * (f32::from(i) + 0.5), 0.025 * (f32::from(j) + 0.5));
                    let density = 1.0 / (std::f32::consts::PI * along.rarity(facet, facet[2], widths));
                    sum += 0.025 * 0.025 * density * facet[2].powi(4);
                }
            }
            sum
        };
        for anisotropy in [0.0, 0.5, 1.0] {
            assert!((area(anisotropy) - 1.0).abs() < 0.03, "{anisotropy} {}", area(anisotropy));
        }
    }
}
