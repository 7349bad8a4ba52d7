//! Scattering: stamps, scratches, fibres.
mod fibers;
mod plan;
mod scatter_material;
mod scratches;
mod sown;
mod stamps;
mod strands;
mod tile_sampler;
mod varied;

pub use fibers::Fibers;
pub use plan::Order;
pub use scatter_material::{OtherMaterial, ScatterHeights, ScatterMaterial};
pub use scratches::Scratches;
pub use sown::OtherStamp;
pub use stamps::Scatter;
pub use tile_sampler::TileSampler;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Scatter",
        doc: "Many copies of one thing: stamps of a field or a material on a grid or on points, scratches, fibres. A tile costs what lies on it.",
        kinds: vec![
            Kind::of::<TileSampler>(),
            Kind::of::<Scatter>(),
            Kind::of::<ScatterMaterial>(),
            Kind::of::<Scratches>(),
            Kind::of::<Fibers>(),
        ],
    }
}
