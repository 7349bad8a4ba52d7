//! Space: moves, rotates, scales and warps fields, and makes fields of directions.
mod crop;
mod directional_warp;
mod laid_material;
mod mirror;
mod orientation_field;
mod place;
mod polar;
mod transform;
mod vector_field;
mod warp;
mod wrap;

pub use crop::Crop;
pub use directional_warp::DirectionalWarp;
pub use laid_material::LaidMaterial;
pub use mirror::{Mirror, MirrorAxis};
pub use orientation_field::OrientationField;
pub use place::Place;
pub use polar::{Polar, PolarMode};
pub use transform::Transform;
pub use vector_field::{VectorField, VectorKind};
pub use warp::Warp;
pub use wrap::Wrap;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Space",
        doc: "Fields moved, turned, scaled and bent, and fields of directions; lengths in mm.",
        kinds: vec![
            Kind::of::<Transform>(),
            Kind::of::<Mirror>(),
            Kind::of::<Crop>(),
            Kind::of::<Place>(),
            Kind::of::<Wrap>(),
            Kind::of::<Polar>(),
            Kind::of::<Warp>(),
            Kind::of::<DirectionalWarp>(),
            Kind::of::<VectorField>(),
            Kind::of::<OrientationField>(),
        ],
    }
}
