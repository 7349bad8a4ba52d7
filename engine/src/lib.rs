//! Graph files, typed wires, lazy evaluation and caches: the engine of Shibo.
//!
//! The engine knows no method and no node. Each module uses those after it: [`session`] → [`eval`] → [`graph`] →
//! [`registry`] → [`node`] → [`value`]; [`diagnostics`], [`export`] and [`picture`] are on the same level as [`value`].
//!
//! Rules that hold everywhere, stated once:
//! - Lengths are millimetres, on the canvas and in heights. Angles are degrees in graph files, radians inside. `y` points
//!   down.
//! - No input of a user causes a panic; errors are [`diagnostics::Problem`]s that the graph turns into located
//!   diagnostics.
//! - Results depend on the graph alone: never on threads, tile order, machine or the state of a cache.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]
pub mod diagnostics;
pub mod eval;
pub mod export;
pub mod expression;
pub mod graph;
pub mod node;
pub mod picture;
pub mod registry;
pub mod session;
pub mod syntax;
pub mod value;
