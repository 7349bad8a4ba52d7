//! Tone: point-wise changes of one field.
mod gradient_map;
mod invert;
mod levels;
mod remap;
mod threshold;

pub use gradient_map::{GradientMap, MixSpace};
pub use invert::Invert;
pub use levels::Levels;
pub use remap::Remap;
pub use threshold::Threshold;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Tone",
        doc: "Point-wise changes of one field; colours are changed channel by channel, scene-linear.",
        kinds: vec![
            Kind::of::<Levels>(),
            Kind::of::<Remap>(),
            Kind::of::<Invert>(),
            Kind::of::<GradientMap>(),
            Kind::of::<Threshold>(),
        ],
    }
}
