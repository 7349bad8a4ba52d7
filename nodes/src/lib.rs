//! The nodes of Shibo, a folder per family, and the numeric kernels they stand on.
pub mod kernel;
