//! Variation of growth around and along a stem: moves points towards or away from the pith before the time is computed.
//!
//! d' = d (1 + e(θ, z)) + Σ aᵢ d / (d + lᵢ/2) nᵢ(x/lᵢ, y/lᵢ, z/mᵢ). e is noise on the unit circle, so it has no seam;
//! multiplied by d it is continuous at the pith although e is not, and the factor d / (d + l/2) has the same effect on
//! the rest. x and y are relative to the pith: no polar pinching. z does not change, so level rows stay level.
use super::trunk::{Places, Trunk};
use crate::ground::hash::Hash;
use crate::ground::number::narrow;
use crate::ground::simd::dispatch;
use crate::noise::noise3::{Noise3, SLOPE, visible};

/// Waves of the growth rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Maximum shift of rings, in mm.
    pub amplitude: f64,
    /// Wavelength across the grain, in mm.
    pub across: f64,
    /// Wavelength along the grain, in mm.
    pub along: f64,
}

/// Lower bound of the derivative of the displaced radius by the radius, 1 without variation. If it is above 0, time
/// rises outward everywhere.
pub fn reserve(eccentricity: f64, waves: &[Wave]) -> f64 {
    1.0 - 1.5 * eccentricity - SLOPE * waves.iter().map(|w| w.amplitude / w.across).sum::<f64>()
}

/// The largest number of waves.
pub const WAVES: usize = 8;

/// Variation of growth, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct Shape {
    eccentricity: f32,
    lobes: [Noise3; 2],
    /// Inverse sizes, half of the first size, amplitude, and the noise.
    waves: Vec<([f32; 2], f32, f32, Noise3)>,
}

impl Shape {
    /// Prepares the variation from its settings.
    pub fn new(eccentricity: f64, waves: &[Wave], hash: Hash) -> Self {
        let wave = |(i, w): (usize, &Wave)| {
            let inverse = [narrow(1.0 / w.across), narrow(1.0 / w.along)];
            (inverse, narrow(0.5 * w.across), narrow(w.amplitude), Noise3::new(hash, 2 + i as u64))
        };
        Self {
            eccentricity: narrow(eccentricity),
            lobes: [Noise3::new(hash, 0), Noise3::new(hash, 1)],
            waves: waves.iter().take(WAVES).enumerate().map(wave).collect(),
        }
    }

    /// The points at which the even tree is evaluated instead, for pixels of `pixel` mm.
    pub fn place(&self, trunk: &Trunk<f32>, at: &Places<'_, f32>, pixel: f32, out: [&mut [f32]; 3]) {
        let [px, py, pz] = out;
        pz.copy_from_slice(at.z);
        dispatch(
            #[inline(always)]
            || {
                trunk.runs(
                    at,
                    #[inline(always)]
                    |from, to, qx, qy| {
                        // With a known bound of 64, no index needs a check.
                        let n = (to - from).min(64);
                        let z = &at.z[from..][..n];
                        let (mut dx, mut dy, mut d, mut factor) =
                            ([0.0_f32; 64], [0.0_f32; 64], [0.0_f32; 64], [1.0_f32; 64]);
                        for (i, (x, y)) in at.x[from..to].iter().zip(&at.y[from..to]).enumerate() {
                            dx[i] = x - qx[i];
                            dy[i] = y - qy[i];
                            d[i] = (dx[i] * dx[i] + dy[i] * dy[i]).sqrt();
                        }
                        if self.eccentricity > 0.0 {
                            let (mut c, mut s) = ([0.0_f32; 64], [0.0_f32; 64]);
                            for i in 0..n {
                                let inverse = 1.0 / (d[i] + 1e-6);
                                (c[i], s[i]) = (dx[i] * inverse, dy[i] * inverse);
                            }
                            let e = self.eccentricity;
                            let at = [&c[..n], &s[..n], z];
                            self.lobes[0].each(at, [0.9, 0.9, 1.0 / 900.0], 0.0, &mut factor, |f, v| f + e * v);
                            self.lobes[1].each(at, [2.1, 2.1, 1.0 / 500.0], 0.0, &mut factor, |f, v| f + 0.5 * e * v);
                        }
                        for ([across, along], half, amplitude, noise) in &self.waves {
                            let amplitude = amplitude * visible(2.0 * half, pixel);
                            if amplitude > 0.0 {
                                let mut wave = [0.0_f32; 64];
                                let scale = [*across, *across, *along];
                                noise.each([&dx[..n], &dy[..n], z], scale, 0.0, &mut wave, |_, v| v);
                                for i in 0..n {
                                    factor[i] += amplitude / (d[i] + half) * wave[i];
                                }
                            }
                        }
                        let (px, py) = (&mut px[from..][..n], &mut py[from..][..n]);
                        for i in 0..n {
                            px[i] = qx[i] + dx[i] * factor[i];
                            py[i] = qy[i] + dy[i] * factor[i];
                        }
                    },
                );
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wood::trunk::Rows;

    #[test]
    fn radii_rise_within_the_reserve() {
        let waves = [
            Wave { amplitude: 4.6, across: 46.0, along: 360.0 },
            Wave { amplitude: 1.0, across: 14.0, along: 120.0 },
            Wave { amplitude: 0.12, across: 3.0, along: 30.0 },
        ];
        assert!(
            reserve(0.1, &waves) > 0.0 && reserve(0.2, &[Wave { amplitude: 9.0, across: 30.0, along: 60.0 }]) < 0.0
        );
        let shape = Shape::new(0.1, &waves, Hash::new(5));
        let trunk = Trunk::<f32>::new(&[]);
        let n = 2000;
        for ray in 0..40_i16 {
            let (s, c) = (f32::from(ray) * 0.157).sin_cos();
            let x: Vec<f32> = (0..n).map(|i| c * 0.1 * i as f32).collect();
            let y: Vec<f32> = (0..n).map(|i| s * 0.1 * i as f32).collect();
            let z = vec![f32::from(ray) * 31.0; n];
            let (mut px, mut py, mut pz) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
            let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
            shape.place(&trunk, &at, 0.0, [&mut px, &mut py, &mut pz]);
            let d: Vec<f32> = px.iter().zip(&py).map(|(x, y)| x.hypot(*y)).collect();
            assert!(d.windows(2).all(|w| w[1] > w[0]), "ray {ray}");
            assert_eq!(pz, z);
        }
    }
}
