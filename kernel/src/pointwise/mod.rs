//! Pictures made pixel by pixel: arithmetic, blending, tones, and ramps that know only their place.

pub mod blend;
pub mod gradient;
pub mod math_ops;
pub mod tone;
