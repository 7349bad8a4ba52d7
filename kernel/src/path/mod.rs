//! Paths: drawing and joining them, positions relative to them, seams along them, direction fields that follow them,
//! and lines that follow direction fields.

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
