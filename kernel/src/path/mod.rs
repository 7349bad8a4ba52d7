//! Paths: how they are drawn and joined, where places lie beside them, and seams along them.

pub mod chain;
mod index;
pub mod nearest;
pub mod pen;
pub mod seam;
pub mod thread;
#[cfg(test)]
mod thread_tests;
