//! Leather: the wrinkle method of JP4905282B2, each stage a node.
mod band_pattern;
#[cfg(test)]
mod chain_tests;
mod connect_neighbors;
mod define_mass;
mod define_springs;
mod dots;
mod draw_wrinkles;
mod drawing;
mod grid_points;
mod hex_points;
mod net;
mod place_wrinkles;
mod point_list;
mod poisson_points;
mod random_points;
mod reading;
mod simulate_springs;
mod strain;
#[cfg(test)]
mod vector_tests;
mod work_area;

pub use band_pattern::BandPattern;
pub use connect_neighbors::{ConnectNeighbors, Neighbors};
pub use define_mass::DefineMass;
pub use define_springs::DefineSprings;
pub use dots::Dots;
pub use draw_wrinkles::DrawWrinkles;
pub use grid_points::GridPoints;
pub use hex_points::HexPoints;
pub use place_wrinkles::PlaceWrinkles;
pub use point_list::PointList;
pub use poisson_points::PoissonPoints;
pub use random_points::RandomPoints;
pub use simulate_springs::SimulateSprings;
pub use work_area::WorkArea;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Leather",
        doc: "Wrinkles from virtual springs: points, links, springs, motion, segments, grooves.",
        kinds: vec![
            Kind::of::<GridPoints>(),
            Kind::of::<HexPoints>(),
            Kind::of::<RandomPoints>(),
            Kind::of::<PoissonPoints>(),
            Kind::of::<PointList>(),
            Kind::of::<WorkArea>(),
            Kind::of::<ConnectNeighbors>(),
            Kind::of::<BandPattern>(),
            Kind::of::<DefineSprings>(),
            Kind::of::<DefineMass>(),
            Kind::of::<SimulateSprings>(),
            Kind::of::<PlaceWrinkles>(),
            Kind::of::<DrawWrinkles>(),
            Kind::of::<Dots>(),
        ],
    }
}
