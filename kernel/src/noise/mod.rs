//! Patterns made from nothing but a place and a seed.

pub mod cells;
pub mod fractal;
pub mod noise3;
pub mod worley;
