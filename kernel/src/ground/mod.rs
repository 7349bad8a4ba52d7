//! The base of all rooms: numbers, random numbers, mathematical functions with the same bits on every machine, windows
//! on grids and the engine's tiles as kernels see them, vector instructions, and stopping early.

pub(crate) mod bins;
pub mod cubic;
pub mod hash;
pub mod math;
pub mod number;
pub mod real;
pub mod simd;
pub mod stop;
pub mod tile;
pub mod window;
