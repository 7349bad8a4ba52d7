//! Shapes: signed distances in mm and masks.
mod masked;
mod shape;
mod shape_math;

pub use shape::{Form, Shape};
pub use shape_math::ShapeMath;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Shapes",
        doc: "Shapes as signed distances in mm, negative inside, and as masks that are sharp at any resolution.",
        kinds: vec![Kind::of::<Shape>(), Kind::of::<ShapeMath>()],
    }
}
