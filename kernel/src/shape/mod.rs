//! Shapes as signed distances in mm, negative inside: what they are, how they are combined, and masks of them.

pub mod combine;
pub mod figure;
pub mod mask;
pub mod outline;
