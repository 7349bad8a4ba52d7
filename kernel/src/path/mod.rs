//! Paths: how they are drawn and joined, where places lie beside them, and seams along them; directions that follow
//! them, and lines that follow directions.

pub mod chain;
pub mod flow;
mod index;
pub mod nearest;
pub mod pen;
pub mod seam;
pub mod stream;
pub mod thread;
#[cfg(test)]
mod thread_tests;
