//! Blending of planes: result = base + (mode(base, top) - base)·opacity·mask, per channel.

use crate::ground::math::{max, min, saturate};
use crate::ground::simd;
use shibo_macros::choice;

/// The blend mode of the base `a` and the top layer `b`.
#[choice]
pub enum BlendMode {
    /// b
    #[default]
    Normal,
    /// a + b
    Add,
    /// a - b
    Subtract,
    /// a·b
    Multiply,
    /// a / b; 0 where b is 0
    Divide,
    /// 1 - (1-a)(1-b): brightens
    Screen,
    /// Multiply where a is dark, screen where it is bright: more contrast
    Overlay,
    /// Multiply where b is dark, screen where it is bright
    HardLight,
    /// Like overlay, but gentler
    SoftLight,
    /// a + 2b - 1
    LinearLight,
    /// Darken where b is below ½, lighten above
    PinLight,
    /// The larger of a and b
    Lighten,
    /// The smaller of a and b
    Darken,
    /// |a - b|
    Difference,
    /// a + b - 2ab
    Exclusion,
    /// a / (1-b), at most 1
    ColorDodge,
    /// 1 - (1-a)/b, at least 0
    ColorBurn,
    /// a + b - 1
    LinearBurn,
    /// (a + b) / 2
    Average,
    /// a + b - ½: adds detail that varies around ½
    AddSub,
}

/// Blends one plane. `mask` (limited to 0..1) and `opacity` set the strength; for colours call it per channel.
///
/// # Panics
/// If the slices differ in length.
pub fn blend(mode: BlendMode, base: &[f32], top: &[f32], mask: Option<&[f32]>, opacity: f32, out: &mut [f32]) {
    assert!(base.len() == out.len() && top.len() == out.len() && mask.is_none_or(|m| m.len() == out.len()));
    let mix = Mix { base, top, mask, opacity };
    simd::dispatch(
        #[inline(always)]
        || mix.mode(mode, out),
    );
}

/// The product of two masks, each limited to 0..1.
pub fn both_masks(a: &[f32], b: &[f32], out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || {
            for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
                *out = saturate(*a) * saturate(*b);
            }
        },
    );
}

struct Mix<'a> {
    base: &'a [f32],
    top: &'a [f32],
    mask: Option<&'a [f32]>,
    opacity: f32,
}

impl Mix<'_> {
    #[inline(always)]
    fn apply(&self, out: &mut [f32], f: impl Fn(f32, f32) -> f32) {
        let pairs = out.iter_mut().zip(self.base.iter().zip(self.top));
        if let Some(mask) = self.mask {
            for ((out, (a, b)), m) in pairs.zip(mask) {
                let weight = saturate(*m) * self.opacity;
                let (full, between) = (f(*a, *b), a + (f(*a, *b) - a) * weight);
                // At full weight the result has exactly the bits of `full`, so that hidden layers need not be computed.
                *out = if weight >= 1.0 { full } else { between };
            }
        } else if self.opacity == 1.0 {
            for (out, (a, b)) in pairs {
                *out = f(*a, *b);
            }
        } else {
            for (out, (a, b)) in pairs {
                *out = a + (f(*a, *b) - a) * self.opacity;
            }
        }
    }

    #[inline(always)]
    fn mode(&self, mode: BlendMode, out: &mut [f32]) {
        match mode {
            BlendMode::Normal => self.apply(out, |_, b| b),
            BlendMode::Add => self.apply(out, |a, b| a + b),
            BlendMode::Subtract => self.apply(out, |a, b| a - b),
            BlendMode::Multiply => self.apply(out, |a, b| a * b),
            BlendMode::Divide => self.apply(out, |a, b| if b == 0.0 { 0.0 } else { a / b }),
            BlendMode::Screen => self.apply(out, screen),
            BlendMode::Overlay => self.apply(out, |a, b| hard_light(b, a)),
            BlendMode::HardLight => self.apply(out, hard_light),
            BlendMode::SoftLight => self.apply(out, soft_light),
            BlendMode::LinearLight => self.apply(out, |a, b| a + 2.0 * b - 1.0),
            BlendMode::PinLight => {
                self.apply(out, |a, b| if b < 0.5 { min(a, 2.0 * b) } else { max(a, 2.0 * b - 1.0) });
            }
            BlendMode::Lighten => self.apply(out, max),
            BlendMode::Darken => self.apply(out, min),
            BlendMode::Difference => self.apply(out, |a, b| (a - b).abs()),
            BlendMode::Exclusion => self.apply(out, |a, b| a + b - 2.0 * a * b),
            BlendMode::ColorDodge => self.apply(out, color_dodge),
            BlendMode::ColorBurn => self.apply(out, |a, b| 1.0 - color_dodge(1.0 - a, 1.0 - b)),
            BlendMode::LinearBurn => self.apply(out, |a, b| a + b - 1.0),
            BlendMode::Average => self.apply(out, |a, b| 0.5 * (a + b)),
            BlendMode::AddSub => self.apply(out, |a, b| a + b - 0.5),
        }
    }
}

#[inline(always)]
fn screen(a: f32, b: f32) -> f32 {
    a + b - a * b
}

#[inline(always)]
fn hard_light(a: f32, b: f32) -> f32 {
    if b < 0.5 { 2.0 * a * b } else { screen(a, 2.0 * b - 1.0) }
}

#[inline(always)]
fn soft_light(a: f32, b: f32) -> f32 {
    let low = ((16.0 * a - 12.0) * a + 4.0) * a;
    let d = if a <= 0.25 { low } else { a.sqrt() };
    if b <= 0.5 { a - (1.0 - 2.0 * b) * a * (1.0 - a) } else { a + (2.0 * b - 1.0) * (d - a) }
}

#[inline(always)]
fn color_dodge(a: f32, b: f32) -> f32 {
    let ratio = min(a / max(1.0 - b, 1e-12), 1.0);
    if a <= 0.0 { 0.0 } else { ratio }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [BlendMode; 20] = [
        BlendMode::Normal,
        BlendMode::Add,
        BlendMode::Subtract,
        BlendMode::Multiply,
        BlendMode::Divide,
        BlendMode::Screen,
        BlendMode::Overlay,
        BlendMode::HardLight,
        BlendMode::SoftLight,
        BlendMode::LinearLight,
        BlendMode::PinLight,
        BlendMode::Lighten,
        BlendMode::Darken,
        BlendMode::Difference,
        BlendMode::Exclusion,
        BlendMode::ColorDodge,
        BlendMode::ColorBurn,
        BlendMode::LinearBurn,
        BlendMode::Average,
        BlendMode::AddSub,
    ];

    #[test]
    fn every_mode_is_finite_and_respects_its_mask() {
        let values = [0.0, 0.25, 0.5, 1.0, -2.0, 3.0];
        for mode in ALL {
            for a in values {
                for b in values {
                    let mut out = [0.0; 3];
                    blend(mode, &[a; 3], &[b; 3], Some(&[0.0, 0.5, 1.0]), 1.0, &mut out);
                    assert!(out.iter().all(|v| v.is_finite()), "{mode:?} {a} {b} {out:?}");
                    assert_eq!(out[0], a);
                    assert!((out[1] - 0.5 * (a + out[2])).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn known_values() {
        let one = |mode, a, b| {
            let mut out = [0.0];
            blend(mode, &[a], &[b], None, 1.0, &mut out);
            out[0]
        };
        assert_eq!(one(BlendMode::Screen, 0.5, 0.5), 0.75);
        assert_eq!(one(BlendMode::Overlay, 0.25, 0.5), 0.25);
        assert_eq!(one(BlendMode::SoftLight, 0.4, 0.5), 0.4);
        assert_eq!(one(BlendMode::ColorDodge, 0.25, 0.5), 0.5);
        assert_eq!(one(BlendMode::ColorBurn, 0.75, 0.5), 0.5);
    }
}
