//! Tests of graph files through the public interface of the crate.
#![allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
#[path = "../../../../tests/support/bless.rs"]
mod bless;
mod graph_canvas;
mod graph_errors;
mod graph_limits;
mod graph_load;
mod graph_nodes;
mod graph_syntax;
mod pins;
