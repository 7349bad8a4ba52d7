//! The numeric kernels of Shibo: functions on slices and `glam` types; no node, no graph, no files. What a graph can choose
//! between is an enum here, which the nodes take as a parameter as it is: its doc comments are the manual's.
//!
//! Rules for all of them: results never depend on the number of threads or on how a picture is cut into tiles;
//! random numbers are hashed from a seed and an index; reductions have a fixed order; transcendental functions come
//! from [`ground::math`], never from the system. Pictures are planar `f32`, rows from y = 0.
//!
//! Each folder is a room and uses only rooms that are named before it:
//! [`ground`], [`noise`], [`filter`], [`pointwise`], [`surface`], [`strokes`], [`shape`], [`path`], [`pattern`], [`scatter`],
//! [`mesh`], [`leather`], [`springs`], [`wood`], [`synthesis`]. Of the engine they know `shibo_engine::value` alone.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]

pub mod filter;
pub mod ground;
pub mod leather;
pub mod mesh;
pub mod noise;
pub mod path;
pub mod pattern;
pub mod pointwise;
pub mod region;
pub mod scatter;
pub mod shape;
pub mod springs;
pub mod strokes;
pub mod surface;
pub mod synthesis;
pub mod wood;

/// The fingerprint of this crate's code and of the libraries that it stands on.
pub const CODE: &str = env!("CODE_FINGERPRINT");
