//! Stamps scattered on the canvas, and strands that follow a field.
//!
//! A picture is stamped many times, each stamp with a place, a size, a turn and a value of its own. [`set::StampSet`] finds those
//! near a window, [`paint`] draws them. A window costs what overlaps it, and has the same bits as the crop of a larger one.

pub mod atlas;
mod blocks;
pub mod paint;
#[cfg(test)]
mod paint_tests;
pub mod set;
mod span;
pub mod strand;
