//! Stamps scattered on the canvas, and strands that follow a field.
//!
//! A picture is stamped many times; each stamp has its own position, size, rotation and value. [`set::StampSet`] finds
//! the stamps near a window, [`paint`] draws them. The cost of a window depends on the stamps that overlap it, and its
//! bits are those of the crop of a larger window.

pub mod atlas;
mod blocks;
pub mod paint;
#[cfg(test)]
mod paint_tests;
pub mod set;
mod span;
pub mod strand;
