//! Scattering: stamps, scratches, fibres.
mod fibers;
mod plan;
mod scratches;
mod sown;
mod stamps;
mod strands;
mod tile_sampler;

pub use fibers::Fibers;
pub use plan::Order;
pub use scratches::Scratches;
pub use stamps::Scatter;
pub use tile_sampler::TileSampler;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Scatter",
        doc: "Many copies of one thing: stamps of a field on a grid or on points, scratches, fibres. A tile costs what lies on it.",
        kinds: vec![Kind::of::<TileSampler>(), Kind::of::<Scatter>(), Kind::of::<Scratches>(), Kind::of::<Fibers>()],
    }
}
