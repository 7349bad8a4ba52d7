//! Procedural noise: functions of a position and a seed alone.

pub mod cells;
pub mod fractal;
pub mod noise3;
pub mod worley;
