//! Tests of the engine through its public interface.
#![allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
mod changing_files;
mod evaluating;
mod evaluation;
mod graph_expressions;
#[path = "../../graph/tests/all/graph_nodes/mod.rs"]
mod graph_nodes;
mod panics;
mod parts;
mod points;
mod store;
mod warnings;
