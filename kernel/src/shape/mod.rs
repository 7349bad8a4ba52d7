//! Shapes as signed distances in mm, negative inside: figures, combinations, and masks.

pub mod combine;
pub mod figure;
pub mod mask;
pub mod outline;
