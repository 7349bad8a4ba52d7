//! The engine of Shibo: graph files, typed wires, lazy evaluation and caches.
//!
//! The engine contains no methods and no nodes. Each module uses only the modules after it: [`session`] → [`eval`] →
//! [`graph`] → [`registry`] → [`node`] → [`value`]; [`diagnostics`], [`export`] and [`picture`] are on the same level
//! as [`value`].
//!
//! Rules for the whole engine:
//! - Lengths are millimetres, on the canvas and in heights. Angles are degrees in graph files, radians inside. `y`
//!   points down.
//! - User input never causes a panic; errors are [`diagnostics::Problem`]s that the graph turns into located
//!   diagnostics.
//! - Results depend only on the graph: never on threads, tile order, machine or the state of a cache.
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
