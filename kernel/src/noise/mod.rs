//! Procedural noise: functions of only a position and a seed.

pub mod cells;
pub mod curl;
pub mod fractal;
pub mod fractal_along;
pub mod gabor;
pub mod noise3;
mod simplex;
pub mod worley;
pub mod worley_along;
