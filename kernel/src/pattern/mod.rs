//! Patterns that repeat: pieces that partition the plane (bricks, tiles, hexagons), threads of a weave, Truchet tiles.
//!
//! A pattern is defined in *units* of its own (pitches of pieces or threads), in which it repeats with a lattice;
//! [`fit::Fit`] lays the units on the canvas so that both repeat together, and numbers what lies there.

pub mod finish;
pub mod fit;
pub mod layout;
pub mod truchet;
pub mod weave;
