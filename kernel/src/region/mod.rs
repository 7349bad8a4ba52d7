//! Pieces of pictures: connected parts of masks, and what is measured of numbered pieces.

pub mod axes;
pub mod flood;
pub mod pieces;
