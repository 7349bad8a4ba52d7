//! Point-wise operations: formulas, blending, tones, colours, histograms, and ramps, which depend only on the
//! position.

pub mod blend;
pub mod color;
pub mod curve;
pub mod expression;
pub mod gradient;
pub mod histogram;
pub mod normal_scores;
mod scalar;
pub mod steps;
pub mod tone;
