//! Wear of raised parts, and dirt in low parts: weights by the height above or below the surroundings.

use crate::ground::math::{saturate, smooth};
use crate::ground::simd;

/// Settings for converting a height above the surroundings to a weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WearSpec {
    /// 1 for edges, which are above their surroundings; -1 for grooves, which are below.
    pub sign: f32,
    /// Height difference that counts as 1, mm.
    pub depth: f32,
    /// Covered share: 0 nothing, 1 all parts that are above their surroundings at all.
    pub amount: f32,
    /// Width of the transition between covered and bare, in units of `depth`.
    pub softness: f32,
    /// Shift of the transition by the noise, in units of `depth`.
    pub breakup: f32,
}

impl WearSpec {
    /// `smoothstep(l - s, l + s, sign·(height - around)/depth + breakup·(2·noise - 1))` with `l = 1 - amount`, `s` half
    /// the softness; 0 where the amount is 0. `around` is the height of the surroundings. All lengths are in mm.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn weights(&self, height: &[f32], around: &[f32], noise: Option<&[f32]>, out: &mut [f32]) {
        assert!(height.len() == out.len() && around.len() == out.len() && noise.is_none_or(|n| n.len() == out.len()));
        if self.amount <= 0.0 {
            out.fill(0.0);
            return;
        }
        let scale = self.sign / self.depth;
        let half = 0.5 * self.softness.max(1e-6);
        let (low, over) = (1.0 - self.amount - half, 0.5 / half);
        let breakup = self.breakup;
        simd::dispatch(
            #[inline(always)]
            || match noise {
                Some(noise) => {
                    for (out, ((height, around), noise)) in out.iter_mut().zip(height.iter().zip(around).zip(noise)) {
                        let t = (height - around) * scale + breakup * (2.0 * noise - 1.0);
                        *out = smooth(saturate((t - low) * over));
                    }
                }
                None => {
                    for (out, (height, around)) in out.iter_mut().zip(height.iter().zip(around)) {
                        *out = smooth(saturate(((height - around) * scale - low) * over));
                    }
                }
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGES: WearSpec = WearSpec { sign: 1.0, depth: 0.2, amount: 0.5, softness: 0.5, breakup: 0.4 };

    fn weight(spec: WearSpec, height: f32, around: f32, noise: Option<f32>) -> f32 {
        let mut out = [f32::NAN];
        let noise = noise.map(|n| [n]);
        spec.weights(&[height], &[around], noise.as_ref().map(<[f32; 1]>::as_slice), &mut out);
        out[0]
    }

    #[test]
    fn edges_are_worn_and_grooves_gather_dirt() {
        // 0.1 mm of 0.2 mm is 0.5, the middle of the transition at amount ½; 0.125 mm is 0.625: t = 0.75 of the
        // transition from 0.25 to 0.75, and 3t² - 2t³ = 0.84375.
        for (height, expected) in [(0.0, 0.0), (0.05, 0.0), (0.1, 0.5), (0.125, 0.84375), (0.15, 1.0), (9.0, 1.0)] {
            assert!((weight(EDGES, 1.0 + height, 1.0, None) - expected).abs() < 1e-4, "{height}");
            let grooves = WearSpec { sign: -1.0, ..EDGES };
            assert!((weight(grooves, 1.0 - height, 1.0, None) - expected).abs() < 1e-4, "{height}");
            assert_eq!(weight(grooves, 1.0 + height.max(0.01), 1.0, None), 0.0);
        }
        // Noise at ½ changes nothing; at 1 it counts as 0.4 · 0.2 mm more.
        assert_eq!(weight(EDGES, 1.1, 1.0, Some(0.5)), weight(EDGES, 1.1, 1.0, None));
        assert!((weight(EDGES, 1.02, 1.0, Some(1.0)) - 0.5).abs() < 1e-4);
        assert_eq!(weight(WearSpec { amount: 0.0, ..EDGES }, 99.0, 0.0, Some(1.0)), 0.0);
    }
}
