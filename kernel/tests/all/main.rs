//! Tests of the methods: vectors, properties and statistics.
#![allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]
mod leather_properties;
mod leather_statistics;
mod leather_vectors;
mod noise_axes;
mod synthesis;
mod synthesis_joints;
mod synthesis_mended;
mod synthesis_one_axis;
mod synthesis_properties;
mod synthesis_vectors;
mod wood_vectors;
