//! Filters, whose pixels depend on a neighbourhood: blur, distance, halving, resampling, warps.

pub mod blur;
pub mod distance;
pub mod fields;
pub mod placed;
pub mod pyramid;
pub mod resample;
pub mod sample;
pub mod warp;
