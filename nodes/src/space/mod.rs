//! Space: fields moved, rotated, scaled and bent.
mod laid_material;
mod moved;
mod transform;
mod warp;
mod warped;

pub use laid_material::LaidMaterial;
pub use transform::Transform;
pub use warp::Warp;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Space",
        doc: "Fields moved, turned, scaled and bent; lengths in mm.",
        kinds: vec![Kind::of::<Transform>(), Kind::of::<Warp>()],
    }
}
