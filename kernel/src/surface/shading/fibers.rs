//! The reflection of fibres in a surface.
use super::block::{BLOCK, Block};
use super::light::{Light, lying};
use crate::ground::math::{self, max};

impl Block {
    /// Adds the reflection of fibres: a cone around the fibre, as wide as fibre directions vary, in the colour of the
    /// material. Metal has no fibres: its anisotropy is that of scratches.
    #[inline(always)]
    pub(in crate::surface) fn shine(&mut self, gain: f32, key: &Light) {
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
            let lit =
                gain * share[i] * (1.0 - self.finish[0][i]) * facing * (0.5 + 0.5 * self.open[i]) * (cone - FIBER_MEAN);
            for ((out, base), light) in [&mut *red, &mut *green, &mut *blue].into_iter().zip(color).zip(key.color) {
                out[i] = max(out[i] + light * lit * base[i], 0.0);
            }
        }
    }
}

/// Width of the cone in which fibres reflect, as a sum of two sines; and its mean over fibres in all directions of a
/// level surface, by which the material becomes darker elsewhere.
const FIBER_WIDTH: f32 = 0.3;
const FIBER_MEAN: f32 = 0.5;
