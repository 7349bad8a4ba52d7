//! Leather: the wrinkle method of JP4905282B2, a stage a node.
mod band_pattern;
mod connect_neighbors;
mod define_springs;
mod draw_wrinkles;
mod grid_points;
mod place_wrinkles;
mod point_list;
mod poisson_points;
mod simulate_springs;

pub use band_pattern::BandPattern;
pub use connect_neighbors::ConnectNeighbors;
pub use define_springs::DefineSprings;
pub use draw_wrinkles::DrawWrinkles;
pub use grid_points::GridPoints;
pub use place_wrinkles::PlaceWrinkles;
pub use point_list::PointList;
pub use poisson_points::PoissonPoints;
pub use simulate_springs::SimulateSprings;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Leather",
        doc: "Wrinkles from virtual springs: points, links, springs, motion, segments, grooves.",
        kinds: vec![
            Kind::of::<GridPoints>(),
            Kind::of::<PoissonPoints>(),
            Kind::of::<PointList>(),
            Kind::of::<ConnectNeighbors>(),
            Kind::of::<BandPattern>(),
            Kind::of::<DefineSprings>(),
            Kind::of::<SimulateSprings>(),
            Kind::of::<PlaceWrinkles>(),
            Kind::of::<DrawWrinkles>(),
        ],
    }
}
