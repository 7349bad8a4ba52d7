//! Generators: fields made from nothing but parameters.
mod constant;
mod fractal;
mod gradient;
mod noise_field;
mod perlin;
mod worley;

pub use constant::Constant;
pub use fractal::Fractal;
pub use gradient::Gradient;
pub use perlin::Perlin;
pub use worley::Worley;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Generators",
        doc: "Fields made from nothing but parameters; periodic on a canvas that tiles, with lengths in mm.",
        kinds: vec![
            Kind::of::<Constant>(),
            Kind::of::<Gradient>(),
            Kind::of::<Perlin>(),
            Kind::of::<Fractal>(),
            Kind::of::<Worley>(),
        ],
    }
}
