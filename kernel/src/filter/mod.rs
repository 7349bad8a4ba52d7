//! Filters that read a neighbourhood of pixels: blur, median, morphology, slopes, distance, halving, resampling, warps.

pub mod along;
pub mod blur;
pub mod disk;
pub mod distance;
pub mod fields;
pub mod median;
pub mod morphology;
pub mod paths;
pub mod placed;
pub mod pyramid;
pub mod resample;
pub mod sample;
pub mod slopes;
pub mod tensor;
pub mod warp;
