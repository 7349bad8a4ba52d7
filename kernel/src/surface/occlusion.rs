//! Ambient occlusion of a height field.
//!
//! At three scales (0.35, 1 and 2 times the radius) a point is below its surroundings by G_r h - h. Divided by r, this
//! is the tangent of the mean elevation angle of the surroundings; 1/(1 + tan²) is the part of a cosine-weighted sky
//! that such a slope on all sides leaves open. The result is smooth, without the directions and steps of a ray march,
//! and costs as much as three blurs.

use crate::filter::blur;
use crate::ground::math::max;
use crate::ground::simd;
use crate::ground::window::{View, WindowExt};
use shibo_value::Buffer;
use shibo_value::Window;

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OcclusionSpec {
    /// Size of features that darken, mm.
    pub radius: f64,
    /// 1 is natural; more is darker.
    pub strength: f64,
    /// Size of a pixel, mm.
    pub step: [f64; 2],
}

const SCALES: [f64; 3] = [0.35, 1.0, 2.0];
/// Compensation: the Gaussian mean over a groove underestimates its walls, which are all at one distance.
const GAIN: f64 = 2.5;

/// Widths (σ) in mm of the three Gaussians for a radius in mm: the reach of a Gaussian is about twice σ.
pub fn widths(radius: f64) -> [f64; 3] {
    SCALES.map(|scale| 0.5 * scale * radius)
}

impl OcclusionSpec {
    /// Width of the Gaussian in pixels for a scale.
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
pub fn occlusion(input: &View<'_>, rect: Window, spec: &OcclusionSpec, out: &mut [f32]) {
    let mut means = SCALES.map(|_| Buffer::zeros(rect.len()));
    for (mean, scale) in means.iter_mut().zip(SCALES) {
        blur::blur(input, rect, spec.sigma(scale), mean);
    }
    let mut height = Vec::with_capacity(rect.len());
    (rect.y..).take(rect.rows()).for_each(|y| height.extend_from_slice(input.row(rect.x, y, rect.columns())));
    let [a, b, c] = &means;
    openness(&height, [a, b, c], spec, out);
}

/// Openness of each pixel from its height and the heights blurred by [`widths`] mm.
///
/// # Panics
/// If a plane is smaller than `height`.
pub fn openness(height: &[f32], means: [&[f32]; 3], spec: &OcclusionSpec, out: &mut [f32]) {
    #[expect(clippy::cast_possible_truncation, reason = "a slope needs no more than f32")]
    let [ga, gb, gc] = SCALES.map(|scale| (GAIN * spec.strength / (scale * spec.radius)) as f32);
    let n = height.len();
    let ([a, b, c], out) = (means.map(|mean| &mean[..n]), &mut out[..n]);
    simd::dispatch(
        #[inline(always)]
        || {
            for i in 0..n {
                let h = height[i];
                let (a, b, c) = (max((a[i] - h) * ga, 0.0), max((b[i] - h) * gb, 0.0), max((c[i] - h) * gc, 0.0));
                out[i] = 1.0 / (1.0 + (a * a + b * b + c * c)).sqrt();
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_open_and_grooves_dark() {
        let rect = Window::of(0, 0, 64, 16);
        let spec = OcclusionSpec { radius: 0.8, strength: 1.0, step: [0.1, 0.1] };
        let big = rect.with_halo(spec.halo());
        let groove = |x: i32| if (30..34).contains(&x) { -0.3 } else { 0.0 };
        let rows = |f: &dyn Fn(i32) -> f32| -> Vec<f32> {
            (0..big.rows()).flat_map(|_| (big.x..).take(big.columns()).map(f).collect::<Vec<_>>()).collect()
        };
        let mut out = vec![0.0; rect.len()];
        occlusion(&View::new(&rows(&|x| x as f32 * 0.07), big), rect, &spec, &mut out);
        assert!(out.iter().all(|v| *v > 0.995));
        occlusion(&View::new(&rows(&groove), big), rect, &spec, &mut out);
        assert!(out[32] < 0.8 && out[32] > 0.2 && out[8] > 0.99, "{} {}", out[32], out[8]);
    }
}
