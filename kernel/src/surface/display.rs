//! Tone curves from scene-linear light to 0..1 for a screen.
//!
//! `Filmic` is K. Narkowicz's fit of ACES, channel by channel: pale yellows turn green, dark colours become lighter.
//! `Neutral` is the curve "PBR Neutral" of Khronos (2024): it keeps the base colour of a perfectly lit surface exactly,
//! without the four percent that every dielectric mirrors. Only highlights are compressed, all channels by one factor,
//! towards white.
use crate::ground::math::{max, min};

/// Conversion of light to a colour on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// Like film.
    #[default]
    Filmic,
    /// Hues and base colours are kept; only highlights are compressed.
    Neutral,
    /// Unchanged; values above 1 are clipped.
    Linear,
}

/// Converts a pixel's light, 0..∞, to a colour of 0..1.
#[inline(always)]
pub fn shown(curve: Curve, color: [f32; 3]) -> [f32; 3] {
    match curve {
        Curve::Filmic => color.map(filmic),
        Curve::Neutral => neutral(color),
        Curve::Linear => color.map(|x| min(max(x, 0.0), 1.0)),
    }
}

/// Narkowicz's fit of the ACES curve.
#[inline(always)]
fn filmic(x: f32) -> f32 {
    let x = max(x, 0.0) * 0.8;
    min((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 1.0)
}

/// Light above this is compressed.
const SHOULDER: f32 = 0.8 - 0.04;
/// Rate at which highlights lose their hue.
const FADE: f32 = 0.15;

#[inline(always)]
fn neutral(color: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = color.map(|x| max(x, 0.0));
    let least = min(r, min(g, b));
    let mirrored = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let [r, g, b] = [r - mirrored, g - mirrored, b - mirrored];
    let peak = max(r, max(g, b));
    if peak < SHOULDER {
        return [r, g, b];
    }
    let room = 1.0 - SHOULDER;
    let top = 1.0 - room * room / (peak + room - SHOULDER);
    let scale = top / peak;
    let white = 1.0 - 1.0 / (FADE * (peak - top) + 1.0);
    [r, g, b].map(|x| min(x * scale + (top - x * scale) * white, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neutral_keeps_colours_and_their_hue() {
        // The mirrored light of a dielectric is subtracted again: the base colour stays.
        let wood = [0.7, 0.45, 0.2];
        let kept = neutral(wood.map(|c| c + 0.04));
        assert!(kept.iter().zip(wood).all(|(a, b)| (a - b).abs() < 1e-6), "{kept:?}");
        // A bright colour keeps the order and proportion of its channels unless it is white.
        let bright = neutral(wood.map(|c| 1.6 * c + 0.04));
        assert!(bright.iter().all(|v| *v < 1.0) && bright[0] > bright[1] && bright[1] > bright[2], "{bright:?}");
        assert!((bright[1] / bright[0] - wood[1] / wood[0]).abs() < 0.06, "{bright:?}");
        // The filmic curve shifts the hue.
        let film = wood.map(filmic);
        assert!((film[1] / film[0] - wood[1] / wood[0]).abs() > 0.1, "{film:?}");
    }

    #[test]
    fn curves_rise_within_bounds_and_have_no_jumps() {
        for curve in [Curve::Filmic, Curve::Neutral, Curve::Linear] {
            let mut before = [0.0; 3];
            for i in 0..4000_u16 {
                let x = 0.002 * f32::from(i);
                let now = shown(curve, [x, 0.5 * x, 0.2 * x]);
                assert!(now.iter().all(|v| (0.0..=1.0).contains(v)), "{curve:?} {x}: {now:?}");
                assert!(now.iter().zip(before).all(|(a, b)| *a >= b - 1e-6 && *a - b < 0.01), "{curve:?} {x}: {now:?}");
                before = now;
            }
        }
        assert_eq!(shown(Curve::Neutral, [f32::NAN; 3]).map(f32::is_finite), [true; 3]);
    }
}
