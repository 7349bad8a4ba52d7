//! Generators: fields made from parameters alone.
mod coordinates;
mod curl;
mod fractal;
mod gabor;
mod gradient;
pub mod kept;
mod noise_field;
mod perlin;
mod random;
mod simplex;
mod value_noise;
mod white_noise;
mod worley;

pub use coordinates::Coordinates;
pub use curl::Curl;
pub use fractal::Fractal;
pub use gabor::Gabor;
pub use gradient::Gradient;
pub use perlin::Perlin;
pub use random::Random;
pub use simplex::Simplex;
pub use value_noise::ValueNoise;
pub use white_noise::WhiteNoise;
pub use worley::Worley;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Generators",
        doc: "Fields made from nothing but parameters; periodic on a canvas that tiles, with lengths in mm.",
        kinds: vec![
            Kind::of::<Gradient>(),
            Kind::of::<Perlin>(),
            Kind::of::<Simplex>(),
            Kind::of::<ValueNoise>(),
            Kind::of::<WhiteNoise>(),
            Kind::of::<Fractal>(),
            Kind::of::<Worley>(),
            Kind::of::<Gabor>(),
            Kind::of::<Curl>(),
            Kind::of::<Coordinates>(),
            Kind::of::<Random>(),
        ],
    }
}
