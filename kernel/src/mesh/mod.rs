//! Meshes: what lies beside what on a surface, how it lies on the canvas, and what is read from both.
//!
//! Places are a triangle and a point of the atlas, which is the unit square, v down. Topology and walks are computed in
//! double precision, and nothing depends on the order of a hash map.

pub mod atlas;
pub mod charts;
pub mod comb;
pub mod connection;
pub mod field;
pub mod frame;
pub mod levels;
pub mod raster;
pub mod sites;
pub mod solver;
pub mod strokes;
pub mod texels;
pub mod topology;
pub mod walk;

#[cfg(test)]
pub(crate) mod fixture;
#[cfg(test)]
pub(crate) mod samples;
