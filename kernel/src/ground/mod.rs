//! The foundation of all kernels: numbers, random numbers, mathematical functions with the same bits on every machine,
//! windows on grids, access to the engine's tiles, vector instructions, and cancellation.

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
