//! Point-wise operations: arithmetic, blending, tones, and ramps, which depend on the position alone.

pub mod blend;
pub mod expression;
pub mod gradient;
pub mod math_ops;
pub mod tone;
