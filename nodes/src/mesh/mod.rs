//! Meshes: files and simple shapes, their atlases, and what is baked on these.
mod tangent_field;

pub use tangent_field::{FieldFrom, TangentField};

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Meshes",
        doc: "Surfaces in space, from files or simple shapes, in mm, z up; their atlases, which lay them out on the canvas; \
              and fields that are known of the surface at each texel.",
        kinds: vec![Kind::of::<TangentField>()],
    }
}
