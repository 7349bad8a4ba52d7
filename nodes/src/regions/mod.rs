//! Regions: numbered pieces of the canvas, and measurements of them.
mod flood_fill;
mod per_piece;
mod region_average;
mod region_coordinates;
mod region_gradient;
mod region_random;
#[cfg(test)]
mod stand_in;
mod whole;

pub use flood_fill::FloodFill;
pub use region_average::RegionAverage;
pub use region_coordinates::RegionCoordinates;
pub use region_gradient::RegionGradient;
pub use region_random::RegionRandom;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Regions",
        doc: "Numbered pieces (`Ids`): found in a mask, measured, and told apart by numbers, gradients and means. They \
              take the `ids` of `FloodFill`, `Brick`, `Hex`, `Worley`, `TileSampler` and others.",
        kinds: vec![
            Kind::of::<FloodFill>(),
            Kind::of::<RegionRandom>(),
            Kind::of::<RegionGradient>(),
            Kind::of::<RegionCoordinates>(),
            Kind::of::<RegionAverage>(),
        ],
    }
}
