//! Materials: named channels of a surface.
#[expect(clippy::module_inception, reason = "a file is named after its node")]
mod material;
mod material_channel;

pub use material::Material;
pub use material_channel::MaterialChannel;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Material",
        doc: "Named channels of a surface, put together and taken apart.",
        kinds: vec![Kind::of::<Material>(), Kind::of::<MaterialChannel>()],
    }
}
