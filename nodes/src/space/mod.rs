//! Space: fields moved, rotated, scaled and bent.
mod directional_warp;
mod laid_material;
mod mirror;
mod transform;
mod warp;

pub use directional_warp::DirectionalWarp;
pub use laid_material::LaidMaterial;
pub use mirror::{Mirror, MirrorAxis};
pub use transform::Transform;
pub use warp::Warp;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Space",
        doc: "Fields moved, turned, scaled and bent; lengths in mm.",
        kinds: vec![Kind::of::<Transform>(), Kind::of::<Mirror>(), Kind::of::<Warp>(), Kind::of::<DirectionalWarp>()],
    }
}
