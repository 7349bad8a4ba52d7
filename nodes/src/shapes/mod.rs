//! Shapes, filled paths and lettering: signed distances in mm and masks; vector pictures.
mod fill_path;
mod glyphs;
mod masked;
mod shape;
mod shape_math;
mod svg;
mod text;
mod vector;

pub use fill_path::{FillPath, Inside};
pub use shape::{Form, Shape};
pub use shape_math::ShapeMath;
pub use svg::{Fit, Svg};
pub use text::{Align, Text};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Shapes",
        doc: "Shapes as signed distances in mm, negative inside, and as masks that are sharp at any resolution.",
        kinds: vec![
            Kind::of::<Shape>(),
            Kind::of::<ShapeMath>(),
            Kind::of::<FillPath>(),
            Kind::of::<Text>(),
            Kind::of::<Svg>(),
        ],
    }
}
