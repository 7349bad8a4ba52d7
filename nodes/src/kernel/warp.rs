//! Displacement of a plane by two planes of offsets.

use super::sample::Sampler;
use super::window::{Rect, index};

/// How far a window is displaced, and at which pixel size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpSpec {
    /// Size of a pixel, mm.
    pub step: [f64; 2],
    /// Largest displacement in x and y, mm; longer ones are cut.
    pub limit: [f64; 2],
}

impl WarpSpec {
    /// Pixels read beyond the window with a filter that needs `filter` of them itself (`Sampler::halo`).
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a displacement in pixels")]
    pub fn halo(&self, filter: usize) -> [usize; 2] {
        [0, 1].map(|k| (self.limit[k] / self.step[k]).ceil().max(0.0) as usize + filter)
    }
}

/// out(p) = source(p + (dx, dy)·amount), with displacements in mm over `rect` without gaps.
///
/// # Panics
/// If a plane is smaller than `rect`.
#[expect(clippy::cast_possible_truncation, reason = "displacements need no more than f32")]
pub fn warp(source: &Sampler<'_>, rect: Rect, [dx, dy]: [&[f32]; 2], spec: &WarpSpec, out: &mut [f32]) {
    let limit = spec.limit.map(|l| l as f32);
    let scale = spec.step.map(|s| (1.0 / s) as f32);
    let (mut xs, mut ys) = (vec![0.0; rect.w], vec![0.0; rect.w]);
    let w = rect.w.max(1);
    let rows = out.chunks_exact_mut(w).zip(dx.chunks_exact(w)).zip(dy.chunks_exact(w));
    for (j, ((out, dx), dy)) in (0..rect.h).zip(rows) {
        let y = (rect.y0 + index(j)) as f32 + 0.5;
        for ((i, (x, d)), (ys, e)) in (rect.x0..).zip(xs.iter_mut().zip(dx)).zip(ys.iter_mut().zip(dy)) {
            *x = i as f32 + 0.5 + super::math::clamp(*d, -limit[0], limit[0]) * scale[0];
            *ys = y + super::math::clamp(*e, -limit[1], limit[1]) * scale[1];
        }
        source.fill(&xs, &ys, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::sample::{Filter, Outside};
    use crate::kernel::window::View;

    #[test]
    fn whole_pixels_shift() {
        let rect = Rect::new(0, 0, 6, 5);
        let spec = WarpSpec { step: [0.5, 0.25], limit: [1.0, 0.5] };
        let big = rect.grow(spec.halo(Sampler::halo(Filter::CatmullRom)));
        let data: Vec<f32> = (0..big.area()).map(|k| (k * k % 17) as f32).collect();
        let view = View::new(&data, big);
        let sampler = Sampler::new(view, Filter::CatmullRom, [Outside::Clamp; 2]);
        let mut out = vec![0.0; 30];
        warp(&sampler, rect, [&[1.0; 30], &[-0.25; 30]], &spec, &mut out);
        for (k, v) in (0..).zip(&out) {
            assert_eq!(*v, view.at(k % 6 + 2, k / 6 - 1));
        }
    }
}
