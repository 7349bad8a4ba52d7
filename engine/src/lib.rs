//! The engine of Shibo: lazy evaluation, caches and sessions. It contains no methods and no nodes.
//!
//! This crate is the top of the engine, and names the crates below by their topics: [`graph`] and [`syntax`] (`shibo-graph`),
//! [`node`] and [`registry`] (`shibo-node`), [`picture`] and [`export`] (`shibo-picture`), [`value`], [`diagnostics`] and
//! [`expression`] (`shibo-value`). A program that embeds the engine needs only this crate. [`session`] uses [`eval`].
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]
pub mod eval;
pub mod session;

pub use shibo_graph::{self as graph, syntax};
pub use shibo_node::{self as node, registry};
pub use shibo_picture::{self as picture, export};
pub use shibo_value::{self as value, diagnostics, expression};

/// The fingerprint of this crate's code and of the libraries that it uses.
pub const CODE: &str = env!("CODE_FINGERPRINT");
