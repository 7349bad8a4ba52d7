//! Strokes, and the settings shared by all strokes of a set.

use glam::Vec2;
use shibo_macros::choice;

/// A straight stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its two ends in mm.
    pub ends: [Vec2; 2],
    /// Half its width W in mm, ≥ 0.
    pub half_width: f32,
    /// Its depth, ≥ 0.
    pub depth: f32,
}

/// The cross-section, as a function of the distance t from the middle line in half widths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// 1 inside, with a soft edge a pixel wide.
    Flat,
    /// `1 - t`.
    Linear,
    /// `(1 - t²)²`: level in the middle and at the edge.
    Smooth,
    /// Gaussian, across the stroke only; its ends are those of the style.
    Gaussian {
        /// σ over W; the source's is 1/6; 1/4 shows better as a wrinkle.
        sigma: f32,
        /// Distance over W beyond which it is 0; the source's is ½, 0.8 goes with σ = W/4.
        cutoff: f32,
    },
    /// Flat, in the shape of an ellipse with the stroke as its long axis.
    Brush,
}

impl Default for Profile {
    fn default() -> Self {
        Self::Gaussian { sigma: 0.25, cutoff: 0.8 }
    }
}

/// The cross-section of a groove.
#[choice]
pub enum CrossSection {
    /// Level inside, with a sharp edge.
    Flat,
    /// A V.
    Linear,
    /// Level in the middle and at the edge.
    Smooth,
    /// A bell; see `sigma`.
    #[default]
    Gaussian,
    /// Flat, in the shape of a brush stroke.
    Brush,
}

impl CrossSection {
    /// The profile, `sigma` being the standard deviation of the bell as a share of the width.
    pub fn with_sigma(self, sigma: f32) -> Profile {
        match self {
            Self::Flat => Profile::Flat,
            Self::Linear => Profile::Linear,
            Self::Smooth => Profile::Smooth,
            // Beyond 3.2 deviations the bell is below half a percent.
            Self::Gaussian => Profile::Gaussian { sigma, cutoff: (3.2 * sigma).max(0.5) },
            Self::Brush => Profile::Brush,
        }
    }
}

/// Combination of overlapping grooves.
#[choice]
pub enum Combine {
    /// The deepest.
    #[default]
    Max,
    /// The sum.
    Add,
    /// The sum, but never deeper than the greatest depth.
    Screen,
}

/// Settings shared by all strokes of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeStyle {
    /// Cross-section.
    pub profile: Profile,
    /// Half widths are multiplied by `√(1 - taper e²)`, e from -1 to 1 along the stroke; 0..1.
    pub taper: f32,
    /// Depths are multiplied by `1 - tip e⁴`; 0..1.
    pub tip: f32,
    /// Ends are rounded by the cross-section; otherwise they are cut square (the source's).
    pub round_caps: bool,
    /// Thinner strokes are drawn this wide, in output pixels, and fade instead; 0 draws them as they are.
    pub min_width: f32,
    /// True if strokes below the minimum width fade; otherwise they keep their depth.
    pub fade: bool,
    /// Edges of `Flat` and `Brush` and square ends are a pixel wide; otherwise a pixel is in or out by its centre.
    pub antialias: bool,
    /// Combination of overlapping strokes.
    pub combine: Combine,
}

impl Default for StrokeStyle {
    fn default() -> Self {
        Self {
            profile: Profile::default(),
            taper: 0.0,
            tip: 0.0,
            round_caps: false,
            min_width: 1.0,
            fade: true,
            antialias: true,
            combine: Combine::Max,
        }
    }
}

/// Values to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Draw {
    /// Profile times depth.
    Depth,
    /// The profile alone, 0..1: a mask.
    Mask,
}

/// Marks pixels without a stroke in the ids of [`StrokeSet::fill_with_ids`](crate::strokes::StrokeSet::fill_with_ids).
pub const NO_STROKE: u32 = u32::MAX;

/// The end of a cross-section, in half widths.
pub(super) fn cut(profile: Profile) -> f32 {
    if let Profile::Gaussian { cutoff, .. } = profile { 2.0 * cutoff } else { 1.0 }
}
