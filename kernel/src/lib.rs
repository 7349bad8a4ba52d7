//! The numeric kernels of Shibo: functions on slices and `glam` types; no node, no graph, no files. Choices in a graph
//! are enums here, which nodes use directly as parameters: their doc comments are the manual.
//!
//! Rules for all kernels: results never depend on the number of threads or on the division of a picture into tiles;
//! random numbers are hashed from a seed and an index; reductions have a fixed order; transcendental functions come
//! from [`ground::math`], never from the system. Pictures are planar `f32`, rows from y = 0.
//!
//! Each folder is a module that uses only modules listed before it: [`ground`], [`noise`], [`filter`], [`pointwise`],
//! [`strokes`], [`shape`], [`path`], [`pattern`], [`scatter`], [`mesh`], [`surface`], [`leather`], [`springs`],
//! [`wood`], [`deposits`], [`fracture`], [`reaction`], [`yarn`],
//! [`synthesis`], [`body`]. From the engine they use `shibo_value` alone.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]

pub mod body;
pub mod deposits;
pub mod filter;
pub mod fracture;
pub mod ground;
pub mod leather;
pub mod mesh;
pub mod noise;
pub mod path;
pub mod pattern;
pub mod pointwise;
pub mod reaction;
pub mod region;
pub mod scatter;
pub mod shape;
pub mod springs;
pub mod strokes;
pub mod surface;
pub mod synthesis;
pub mod wood;
pub mod yarn;

/// Fingerprint of this crate's code and of its libraries.
pub const CODE: &str = env!("CODE_FINGERPRINT");
