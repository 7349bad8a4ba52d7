//! Repeating patterns: pieces that partition the plane (bricks, tiles, hexagons), woven threads, Truchet tiles.
//!
//! A pattern is defined in its own *units* (pitches of pieces or threads), in which it repeats with a lattice.
//! [`fit::Fit`] lays the units on the canvas so that both repeat together, and numbers the pieces.

pub mod finish;
pub mod fit;
pub mod layout;
pub mod truchet;
pub mod weave;
