//! Ambient occlusion of a height field.
//!
//! At three scales (0.35, 1 and 2 times the radius) a point lies below its surroundings by G_r h - h; divided by r this
//! is the tangent of the mean angle at which they stand above it, and 1/(1 + tan²) the part of a cosine-weighted sky
//! that such a slope all around leaves open. Smooth, without the directions and steps of a ray march, and as cheap as
//! three blurs.

use super::blur;
use super::math::max;
use super::simd;
use super::window::{Rect, View};

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OcclusionSpec {
    /// Size of what darkens, mm.
    pub radius: f64,
    /// 1 is natural; more is darker.
    pub strength: f64,
    /// Size of a pixel, mm.
    pub step: [f64; 2],
}

const SCALES: [f64; 3] = [0.35, 1.0, 2.0];
/// A Gaussian's mean over a walled groove understates the walls: they stand at one distance, not spread around.
const GAIN: f64 = 2.5;

impl OcclusionSpec {
    /// Width of the Gaussian in pixels for a scale; half of it is what the eye calls the radius.
    fn sigma(&self, scale: f64) -> [f64; 2] {
        self.step.map(|step| 0.5 * scale * self.radius / step)
    }

    /// Pixels read beyond the window.
    pub fn halo(&self) -> [usize; 2] {
        let all = SCALES.map(|s| self.sigma(s).map(blur::halo));
        [0, 1].map(|k| all[0][k].max(all[1][k]).max(all[2][k]))
    }
}

/// Openness 0..1 (1: open) over `rect` from heights in mm.
///
/// # Panics
/// If `input` does not cover `rect` grown by the halo, or `out` is smaller than `rect`.
pub fn occlusion(input: &View<'_>, rect: Rect, spec: &OcclusionSpec, out: &mut [f32]) {
    let out = &mut out[..rect.area()];
    let mut mean = vec![0.0; rect.area()];
    out.fill(0.0);
    for scale in SCALES {
        blur::blur(input, rect, spec.sigma(scale), &mut mean);
        #[expect(clippy::cast_possible_truncation, reason = "a slope needs no more than f32")]
        let gain = (GAIN * spec.strength / (scale * spec.radius)) as f32;
        simd::dispatch(
            #[inline(always)]
            || {
                for ((out, mean), y) in
                    out.chunks_exact_mut(rect.w.max(1)).zip(mean.chunks_exact(rect.w.max(1))).zip(rect.y0..)
                {
                    for ((out, mean), h) in out.iter_mut().zip(mean).zip(input.row(y, rect.x0, rect.w)) {
                        let slope = max((mean - h) * gain, 0.0);
                        *out += slope * slope;
                    }
                }
            },
        );
    }
    simd::dispatch(
        #[inline(always)]
        || {
            for out in out {
                *out = 1.0 / (1.0 + *out).sqrt();
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_open_and_grooves_dark() {
        let rect = Rect::new(0, 0, 64, 16);
        let spec = OcclusionSpec { radius: 0.8, strength: 1.0, step: [0.1, 0.1] };
        let big = rect.grow(spec.halo());
        let groove = |x: i32| if (30..34).contains(&x) { -0.3 } else { 0.0 };
        let rows = |f: &dyn Fn(i32) -> f32| -> Vec<f32> {
            (0..big.h).flat_map(|_| (big.x0..).take(big.w).map(f).collect::<Vec<_>>()).collect()
        };
        let mut out = vec![0.0; rect.area()];
        occlusion(&View::new(&rows(&|x| x as f32 * 0.07), big), rect, &spec, &mut out);
        assert!(out.iter().all(|v| *v > 0.995));
        occlusion(&View::new(&rows(&groove), big), rect, &spec, &mut out);
        assert!(out[32] < 0.8 && out[32] > 0.2 && out[8] > 0.99, "{} {}", out[32], out[8]);
    }
}
