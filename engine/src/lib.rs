//! Shibo engine.

pub mod picture;
