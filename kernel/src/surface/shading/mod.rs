//! Light that surfaces reflect: shared by the [lit picture](super::relief) and the [view of a shape](super::view).
mod around;
mod block;
mod fibers;
mod lamp;
mod light;

pub(super) use around::Around;
pub(super) use block::{BLOCK, Block, unpack};
pub(super) use light::Light;

/// Default roughness of a coat.
pub const COAT: f32 = 0.25;

/// Light that fibres reflect in an environment: all of it, as if it came from the key light.
pub(super) const FIBER_KEY: [f32; 3] = [1.15; 3];
