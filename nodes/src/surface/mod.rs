//! Surface detail: what follows from a height in mm.
mod ambient_occlusion;
mod emboss;
mod height_to_normal;
mod pillow;
mod relief;

pub use ambient_occlusion::AmbientOcclusion;
pub use emboss::{Emboss, EmbossCurve};
pub use height_to_normal::HeightToNormal;
pub use pillow::Pillow;
pub use relief::Relief;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Surface detail",
        doc: "Shapes of a surface and what follows from its height in mm: domes, normals, occlusion, a lit picture.",
        kinds: vec![
            Kind::of::<Emboss>(),
            Kind::of::<Pillow>(),
            Kind::of::<HeightToNormal>(),
            Kind::of::<AmbientOcclusion>(),
            Kind::of::<Relief>(),
        ],
    }
}
