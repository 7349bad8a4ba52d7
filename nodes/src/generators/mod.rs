//! Generators: fields made from nothing but parameters.
mod perlin;

pub use perlin::Perlin;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Generators",
        doc: "Fields made from nothing but parameters; periodic on a canvas that tiles, with lengths in mm.",
        kinds: vec![Kind::of::<Perlin>()],
    }
}
