//! Pieces of pictures: connected components of masks, and measurements of numbered pieces.

pub mod axes;
pub mod flood;
pub mod pieces;
