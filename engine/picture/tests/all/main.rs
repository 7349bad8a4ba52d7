//! Tests of picture files through the public interface of the crate.
#![allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
mod part_bad_input;
mod picture_check;
mod picture_read;
mod picture_write;
mod pictures;
mod tiff_read;
