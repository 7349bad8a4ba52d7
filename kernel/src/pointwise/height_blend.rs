//! Which of two heights lies on top, with a soft border.

use crate::ground::math::{max, saturate, smooth};
use crate::ground::simd;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What becomes of the heights where the upper one shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum HeightMode {
    /// The upper height
    #[default]
    Replace,
    /// The sum of both: the upper one as a layer on the lower
    Add,
    /// The larger of both
    Max,
}

/// Parameters: all in mm but `opacity`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightBlend {
    /// Width of the border, in differences of height.
    pub contrast: f32,
    /// Added to the upper height.
    pub offset: f32,
    /// Heights differ by no more than this where the mask can still decide.
    pub range: f32,
    /// Factor on the weight, 0..1.
    pub opacity: f32,
    /// What becomes of the heights.
    pub mode: HeightMode,
}

/// How much of `top` shows: smoothstep(−c/2, c/2, top + offset − base + (2·mask − 1)·(range + c/2)), times the opacity.
///
/// # Panics
/// If the planes differ in length.
pub fn weight(base: &[f32], top: &[f32], mask: &[f32], spec: &HeightBlend, out: &mut [f32]) {
    assert!(base.len() == out.len() && top.len() == out.len() && mask.len() == out.len(), "planes of one size");
    let HeightBlend { contrast, offset, range, opacity, .. } = *spec;
    let reach = range + 0.5 * contrast;
    simd::dispatch(
        #[inline(always)]
        || {
            for (((out, base), top), mask) in out.iter_mut().zip(base).zip(top).zip(mask) {
                let above = (top + offset) - base + (2.0 * saturate(*mask) - 1.0) * reach;
                let w = if contrast > 0.0 {
                    smooth(above / contrast + 0.5)
                } else if above > 0.0 {
                    1.0
                } else {
                    0.0
                };
                *out = w * opacity;
            }
        },
    );
}

/// The blended height, from the weights.
///
/// # Panics
/// If the planes differ in length.
pub fn height(base: &[f32], top: &[f32], weight: &[f32], spec: &HeightBlend, out: &mut [f32]) {
    assert!(base.len() == out.len() && top.len() == out.len() && weight.len() == out.len(), "planes of one size");
    let (offset, mode) = (spec.offset, spec.mode);
    simd::dispatch(
        #[inline(always)]
        || {
            for (((out, base), top), weight) in out.iter_mut().zip(base).zip(top).zip(weight) {
                let top = top + offset;
                let full = match mode {
                    HeightMode::Replace => top,
                    HeightMode::Add => base + top,
                    HeightMode::Max => max(*base, top),
                };
                // Exact at both ends.
                *out = base * (1.0 - weight) + full * weight;
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_higher_one_wins_where_the_mask_leaves_it_open() {
        let spec = HeightBlend { contrast: 0.2, offset: 0.1, range: 1.0, opacity: 0.5, mode: HeightMode::Replace };
        let (base, top) = ([0.0, 0.5, 0.5, 0.5, 0.5, 0.5], [0.3, 0.1, 0.4, 0.45, 0.9, 0.1]);
        let mask = [0.5, 0.5, 0.5, 0.5, 0.0, 1.0];
        let mut out = [9.0; 6];
        weight(&base, &top, &mask, &spec, &mut out);
        // Differences 0.4, -0.3, 0, 0.05; the border runs from -0.1 to 0.1. Of 0.75: 3·0.5625 - 2·0.421875 = 0.84375.
        for (got, want) in out.iter().zip([0.5, 0.0, 0.25, 0.5 * 0.843_75, 0.0, 0.5]) {
            assert!((got - want).abs() < 1e-5, "{out:?}");
        }
        weight(&base, &top, &mask, &HeightBlend { contrast: 0.0, opacity: 1.0, ..spec }, &mut out);
        assert_eq!((out[0], out[1], out[3], out[4], out[5]), (1.0, 0.0, 1.0, 0.0, 1.0));
        for (mode, want) in [(HeightMode::Replace, 0.8), (HeightMode::Add, 1.1), (HeightMode::Max, 0.8)] {
            let mut out = [9.0];
            height(&[0.6], &[0.9], &[0.5], &HeightBlend { mode, ..spec }, &mut out);
            assert!((out[0] - want).abs() < 1e-6, "{mode:?} {out:?}");
        }
    }
}
