//! Cast shadows: the share of a light of some width that the surface itself leaves visible.
//!
//! From each pixel the height is followed towards the light, row by row or column by column. The steepest rise is the
//! horizon. A light whose lower edge is above the horizon is visible as a whole, one whose upper edge is below it is
//! hidden. So a shadow has the length height / tan(elevation), and its edge is wider farther from its cause.
use crate::ground::math::{atan2, max, smooth};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt};
use shibo_value::Window;
use std::f64::consts::FRAC_PI_2;

/// A light that casts shadows.
#[derive(Clone, Debug)]
pub(super) struct Caster {
    /// Pixels across and down to the sample of number 1.
    toward: [f64; 2],
    /// Distance to it, mm.
    apart: f64,
    /// Numbers of the samples.
    numbers: Vec<u16>,
    /// Elevations of the light's lower and upper edge, radians.
    edges: [f32; 2],
    /// Factor on the height.
    strength: f32,
}

/// Most samples of a pixel: the longest shadow in pixels.
const MOST: u16 = 2048;

impl Caster {
    /// A light in direction `to` (y down) with an angular radius, seen at most `reach` mm away, for pixels of `step` mm.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to a small number")]
    pub(super) fn new(to: [f32; 3], radius: f32, reach: f64, step: [f64; 2], strength: f64) -> Self {
        let (x, y) = (f64::from(to[0]) / step[0], f64::from(to[1]) / step[1]);
        // One pixel along the axis that is closer to the direction.
        let longer = x.abs().max(y.abs()).max(1e-12);
        let toward = [x / longer, y / longer];
        let apart = libm::hypot(toward[0] * step[0], toward[1] * step[1]).max(1e-12);
        let flat = libm::hypot(f64::from(to[0]), f64::from(to[1])).max(1e-3);
        let elevation = libm::atan2(f64::from(to[2]), flat);
        let edge = |by: f64| (elevation + by * f64::from(radius.max(0.01))).clamp(0.0, FRAC_PI_2) as f32;
        let count = (reach / apart).clamp(0.0, f64::from(MOST)).ceil() as u16;
        // Near samples are a pixel apart, farther ones a twelfth of their distance.
        let next = |number: &u16| Some(number + (number / 12).max(1)).filter(|next| *next <= count);
        let numbers = std::iter::successors(Some(1).filter(|first| *first <= count), next).collect();
        Self { toward, apart, numbers, edges: [edge(-1.0), edge(1.0)], strength: strength as f32 }
    }

    /// Pixels read beyond the window.
    pub(super) fn halo(&self) -> i32 {
        i32::from(self.numbers.last().copied().unwrap_or(0)) + 1
    }

    /// The visible share of the light, 0..1, over `rect`.
    pub(super) fn share(&self, height: &View<'_>, rect: Window, out: &mut [f32]) {
        out.fill(0.0);
        simd::dispatch(
            #[inline(always)]
            || self.horizon(height, rect, out),
        );
        let [low, high] = self.edges;
        let scale = 1.0 / max(high - low, 1e-3);
        for share in out {
            *share = 1.0 - smooth((atan2(*share, 1.0) - low) * scale);
        }
    }

    /// The tangent of the horizon's elevation.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "offsets are small")]
    fn horizon(&self, height: &View<'_>, rect: Window, out: &mut [f32]) {
        let w = rect.columns();
        for (row, y) in out.chunks_exact_mut(w.max(1)).zip(rect.y..) {
            let own = height.row(rect.x, y, w);
            for number in self.numbers.iter().copied() {
                let by = self.toward.map(|k| k * f64::from(number));
                let (left, top) = (libm::floor(by[0]), libm::floor(by[1]));
                let (s, t) = ((by[0] - left) as f32, (by[1] - top) as f32);
                let (i, j) = (rect.x + left as i32, y + top as i32);
                let scale = self.strength / (f64::from(number) * self.apart) as f32;
                // One of the two offsets is a whole number.
                if t == 0.0 {
                    let there = height.row(i, j, w + 1);
                    for x in 0..w {
                        let h = there[x] + (there[x + 1] - there[x]) * s;
                        row[x] = max(row[x], (h - own[x]) * scale);
                    }
                } else {
                    let (above, below) = (height.row(i, j, w), height.row(i, j + 1, w));
                    for x in 0..w {
                        let h = above[x] + (below[x] - above[x]) * t;
                        row[x] = max(row[x], (h - own[x]) * scale);
                    }
                }
            }
        }
    }
}
