//! What all rooms stand on: numbers, random numbers, functions with the same bits on every machine, windows on grids and
//! the engine's tiles as kernels see them, wide instructions, and stopping early.

pub mod cubic;
pub mod hash;
pub mod math;
pub mod number;
pub mod real;
pub mod simd;
pub mod stop;
pub mod tile;
pub mod window;
