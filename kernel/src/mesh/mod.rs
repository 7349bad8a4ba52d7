//! Meshes: topology, layout on the canvas, and everything computed from both.
//!
//! A point of a surface is a triangle and a point of the atlas, which is the unit square, v down. Topology and paths
//! are computed in double precision, and nothing depends on the order of a hash map.

pub mod across;
pub mod atlas;
pub mod bake;
pub mod charts;
pub mod coarse;
pub mod comb;
pub mod connection;
pub mod cubes;
pub mod curvature;
pub mod dilate;
pub mod field;
pub mod fields;
pub mod frame;
pub mod grooves;
pub mod layout;
pub mod levels;
pub mod links;
pub mod means;
pub mod motion;
pub mod near;
pub mod net;
pub mod raster;
pub mod rays;
pub mod seams;
pub mod shapes;
pub mod sites;
pub mod slide;
pub mod solver;
pub mod sow;
pub mod sparse;
pub mod strokes;
pub mod subdivide;
pub mod texels;
pub mod topology;
pub mod udim;
pub mod unwrap;
pub mod walk;

#[cfg(test)]
pub(crate) mod fixture;
#[cfg(test)]
pub(crate) mod samples;
