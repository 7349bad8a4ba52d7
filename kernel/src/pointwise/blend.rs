//! Blending of planes: result = base + (mode(base, top) - base)·opacity·mask, per channel.

use crate::ground::math::{max, min, saturate};
use crate::ground::simd;

/// What is done with the base `a` and the top layer `b`. Modes meant for 0..1 also accept other values; divisions by
/// nothing give 0 for 0/0 and a limit of 1 where the mode has one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Mode {
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
    /// 1 - (1-a)(1-b)
    Screen,
    /// Multiply in the dark, screen in the light of a.
    Overlay,
    /// Multiply in the dark, screen in the light of b.
    HardLight,
    /// a bent gently by b (W3C compositing).
    SoftLight,
    /// Linear burn below, linear dodge above ½ of b: a + 2b - 1
    LinearLight,
    /// Darken below, lighten above ½ of b.
    PinLight,
    /// max(a, b)
    Lighten,
    /// min(a, b)
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
    /// a + b - ½: adds a height or detail around ½
    AddSub,
}

/// Blends one plane. `mask` limits where (taken as 0 or 1 outside 0..1), `opacity` how much; for colours call it per
/// channel.
///
/// # Panics
/// If the slices differ in length.
pub fn blend(mode: Mode, base: &[f32], top: &[f32], mask: Option<&[f32]>, opacity: f32, out: &mut [f32]) {
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
                *out = a + (f(*a, *b) - a) * (saturate(*m) * self.opacity);
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
    fn mode(&self, mode: Mode, out: &mut [f32]) {
        match mode {
            Mode::Normal => self.apply(out, |_, b| b),
            Mode::Add => self.apply(out, |a, b| a + b),
            Mode::Subtract => self.apply(out, |a, b| a - b),
            Mode::Multiply => self.apply(out, |a, b| a * b),
            Mode::Divide => self.apply(out, |a, b| if b == 0.0 { 0.0 } else { a / b }),
            Mode::Screen => self.apply(out, screen),
            Mode::Overlay => self.apply(out, |a, b| hard_light(b, a)),
            Mode::HardLight => self.apply(out, hard_light),
            Mode::SoftLight => self.apply(out, soft_light),
            Mode::LinearLight => self.apply(out, |a, b| a + 2.0 * b - 1.0),
            Mode::PinLight => {
                self.apply(out, |a, b| if b < 0.5 { min(a, 2.0 * b) } else { max(a, 2.0 * b - 1.0) });
            }
            Mode::Lighten => self.apply(out, max),
            Mode::Darken => self.apply(out, min),
            Mode::Difference => self.apply(out, |a, b| (a - b).abs()),
            Mode::Exclusion => self.apply(out, |a, b| a + b - 2.0 * a * b),
            Mode::ColorDodge => self.apply(out, color_dodge),
            Mode::ColorBurn => self.apply(out, |a, b| 1.0 - color_dodge(1.0 - a, 1.0 - b)),
            Mode::LinearBurn => self.apply(out, |a, b| a + b - 1.0),
            Mode::Average => self.apply(out, |a, b| 0.5 * (a + b)),
            Mode::AddSub => self.apply(out, |a, b| a + b - 0.5),
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

    const ALL: [Mode; 20] = [
        Mode::Normal,
        Mode::Add,
        Mode::Subtract,
        Mode::Multiply,
        Mode::Divide,
        Mode::Screen,
        Mode::Overlay,
        Mode::HardLight,
        Mode::SoftLight,
        Mode::LinearLight,
        Mode::PinLight,
        Mode::Lighten,
        Mode::Darken,
        Mode::Difference,
        Mode::Exclusion,
        Mode::ColorDodge,
        Mode::ColorBurn,
        Mode::LinearBurn,
        Mode::Average,
        Mode::AddSub,
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
        assert_eq!(one(Mode::Screen, 0.5, 0.5), 0.75);
        assert_eq!(one(Mode::Overlay, 0.25, 0.5), 0.25);
        assert_eq!(one(Mode::SoftLight, 0.4, 0.5), 0.4);
        assert_eq!(one(Mode::ColorDodge, 0.25, 0.5), 0.5);
        assert_eq!(one(Mode::ColorBurn, 0.75, 0.5), 0.5);
    }
}
