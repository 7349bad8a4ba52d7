//! Paths: drawing and joining them, level lines of samples, parallel and mirrored curves, lines that fill them, positions
//! relative to them, seams along them, direction fields that follow them, and lines that follow direction fields.

pub mod chain;
pub mod contour;
pub mod ease;
pub mod flow;
pub mod hatch;
pub(crate) mod index;
pub mod mirror;
pub mod nearest;
pub mod offset;
pub mod pen;
pub mod seam;
pub mod stream;
pub mod thread;
#[cfg(test)]
mod thread_tests;
