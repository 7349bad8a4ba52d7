//! Deposits: times that belong to no tree, as solids that feed the same nodes as the growth time of wood, and growth on
//! surfaces.
mod deform_solid;
mod distance_time;
mod grow;
mod layer_time;
mod parts;

pub use deform_solid::{DeformSolid, Deformation, WorkStep};
pub use distance_time::DistanceTime;
pub use grow::Grow;
pub use layer_time::{DuneSpec, FaultSpec, FoldSpec, LayerTime};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Deposits",
        doc: "Time without a tree: layers, fronts that start at walls or seeds, deformation of solids, and growth on \
              surfaces.",
        kinds: vec![Kind::of::<LayerTime>(), Kind::of::<DistanceTime>(), Kind::of::<DeformSolid>(), Kind::of::<Grow>()],
    }
}
