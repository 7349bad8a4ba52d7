//! The pixels of a lit picture that are shaded together.
use super::COAT;
use crate::ground::math;
use crate::surface::display::{Curve, shown};

/// Pixels shaded at a time, in local arrays: the compiler cannot know that the caller's fourteen planes do not overlap,
/// and would not vectorise loops over them.
pub(in crate::surface) const BLOCK: usize = 64;

pub(in crate::surface) struct Block {
    pub(in crate::surface) height: [[f32; BLOCK + 2]; 3],
    pub(in crate::surface) color: [[f32; BLOCK]; 3],
    pub(in crate::surface) rough: [f32; BLOCK],
    pub(in crate::surface) open: [f32; BLOCK],
    /// With y down.
    pub(in crate::surface) normal: [[f32; BLOCK]; 3],
    /// Amount of fibres in the surface, and the cosine and sine of their angle.
    pub(in crate::surface) fiber: [[f32; BLOCK]; 3],
    /// Anisotropy of gloss along fibres.
    pub(in crate::surface) anisotropy: f32,
    /// Direction to the viewer, with y down.
    pub(in crate::surface) view: [[f32; BLOCK]; 3],
    /// Normal of the shape without its relief, with y down.
    pub(in crate::surface) shape: [[f32; BLOCK]; 3],
    /// Share of the key light that the surface itself leaves visible.
    pub(in crate::surface) lit: [f32; BLOCK],
    /// Squared change of the normal within a pixel.
    pub(in crate::surface) spread: [f32; BLOCK],
    pub(in crate::surface) finish: [[f32; BLOCK]; 3],
    pub(in crate::surface) coat_rough: [f32; BLOCK],
    /// Normal of the coat, with y down; of length 0 if it is that of the ground.
    pub(in crate::surface) coat_normal: [[f32; BLOCK]; 3],
    pub(in crate::surface) emission: [[f32; BLOCK]; 3],
    pub(in crate::surface) out: [[f32; BLOCK]; 3],
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
            view: [[0.0; BLOCK], [0.0; BLOCK], [1.0; BLOCK]],
            shape: [[0.0; BLOCK], [0.0; BLOCK], [1.0; BLOCK]],
            lit: [1.0; BLOCK],
            spread: [0.0; BLOCK],
            finish: [[0.0; BLOCK]; 3],
            coat_rough: [COAT; BLOCK],
            coat_normal: [[0.0; BLOCK]; 3],
            emission: [[0.0; BLOCK]; 3],
            out: [[0.0; BLOCK]; 3],
        }
    }
}

impl Block {
    /// The normals of the height.
    #[inline(always)]
    pub(in crate::surface) fn slopes(&mut self, [kx, ky]: [f32; 2]) {
        let [a, b, c] = &self.height;
        let [nx, ny, nz] = &mut self.normal;
        for i in 0..BLOCK {
            let (x, y) = ((b[i + 2] - b[i]) * kx, (c[i + 1] - a[i + 1]) * ky);
            let z = 1.0 / (1.0 + x * x + y * y).sqrt();
            (nx[i], ny[i], nz[i]) = (x * z, y * z, z);
        }
    }

    /// The change of the normal of the height within a pixel.
    #[inline(always)]
    pub(in crate::surface) fn spreads(&mut self, [kx, ky]: [f32; 2]) {
        let [a, b, c] = &self.height;
        for i in 0..BLOCK {
            let bend = [b[i] - 2.0 * b[i + 1] + b[i + 2], a[i + 1] - 2.0 * b[i + 1] + c[i + 1]];
            let (x, y) = (2.0 * bend[0] * kx, 2.0 * bend[1] * ky);
            self.spread[i] = x * x + y * y;
        }
    }

    #[inline(always)]
    pub(in crate::surface) fn fibers(&mut self, [lying, angle]: [&[f32]; 2], at: usize, n: usize) {
        let [share, cosine, sine] = &mut self.fiber;
        share[..n].copy_from_slice(&lying[at..at + n]);
        for i in 0..n {
            let (s, c) = math::sin_cos(angle[at + i] * (std::f32::consts::PI / 180.0));
            (cosine[i], sine[i]) = (c, s);
        }
    }

    #[inline(always)]
    pub(in crate::surface) fn show(&mut self, exposure: f32, curve: Curve) {
        let [red, green, blue] = &mut self.out;
        for i in 0..BLOCK {
            let light = [red[i] * exposure, green[i] * exposure, blue[i] * exposure];
            [red[i], green[i], blue[i]] = shown(curve, light);
        }
    }
}

/// Unpacks normals from ½ + ½n with y up to vectors with y down.
#[inline(always)]
pub(in crate::surface) fn unpack(to: &mut [[f32; BLOCK]; 3], normal: [&[f32]; 3], at: usize, n: usize) {
    for ((block, plane), sign) in to.iter_mut().zip(normal).zip([1.0, -1.0, 1.0]) {
        for (block, stored) in block[..n].iter_mut().zip(&plane[at..at + n]) {
            *block = sign * (2.0 * stored - 1.0);
        }
    }
}
