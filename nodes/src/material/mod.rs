//! Materials: named channels of a surface.
mod adjust_material;
mod blend_materials;
mod channel_of;
mod channels;
mod dirt;
mod edge_wear;
mod layer_materials;
mod layers;
#[expect(clippy::module_inception, reason = "a file is named after its node")]
mod material;
mod transform_material;
mod warp_material;
mod worn;

pub use adjust_material::AdjustMaterial;
pub use blend_materials::BlendMaterials;
pub use channel_of::ChannelOf;
pub use dirt::Dirt;
pub use edge_wear::EdgeWear;
pub use layer_materials::{Layer, LayerMaterials};
pub use layers::{BlendBy, BlendNormals};
pub use material::Material;
pub use transform_material::TransformMaterial;
pub use warp_material::WarpMaterial;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Material",
        doc: "Named channels of a surface, put together and taken apart.",
        kinds: vec![
            Kind::of::<Material>(),
            Kind::of::<AdjustMaterial>(),
            Kind::of::<BlendMaterials>(),
            Kind::of::<LayerMaterials>(),
            Kind::of::<TransformMaterial>(),
            Kind::of::<WarpMaterial>(),
            Kind::of::<EdgeWear>(),
            Kind::of::<Dirt>(),
        ],
    }
}
