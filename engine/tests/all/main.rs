//! Tests of the engine through its public interface.
#![allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
#[path = "../../../tests/support/bless.rs"]
mod bless;
mod changing_files;
mod evaluating;
mod evaluation;
mod graph_canvas;
mod graph_errors;
mod graph_expressions;
mod graph_limits;
mod graph_load;
mod graph_nodes;
mod graph_syntax;
mod panics;
mod part_bad_input;
mod parts;
mod picture_check;
mod picture_read;
mod picture_write;
mod pictures;
mod points;
mod store;
mod tiff_read;
