//! Wood: growth time in a tree with a curved skeleton (Momoi & Takatera 2014), each stage a node, and cuts through it.
mod blend_times;
mod board;
mod branch_time;
mod branches;
mod bud_eyes;
mod color_pattern;
mod cut_pieces;
mod cut_plane;
mod cut_surface;
mod equalize_height;
mod fiber_shading;
mod fiber_space;
mod fiber_streaks;
mod fit_skeleton;
mod frames;
mod place_in_tree;
mod ring_color;
mod solid_noise;
mod straight_time;
mod tree;
mod trees;
mod trunk_nodes;
mod trunk_time;
mod vary_growth;
mod warp_solid;
mod wood_pores;
mod wood_rays;

pub use blend_times::{BlendTimes, Origin};
pub use board::Board;
pub use branch_time::BranchTime;
pub use branches::{BranchSpec, Branches};
pub use bud_eyes::BudEyes;
pub use color_pattern::{ColorPattern, Years};
pub use cut_plane::{CutPlane, Sawing};
pub use cut_surface::{CutSurface, SurfaceShape};
pub use equalize_height::EqualizeHeight;
pub use fiber_shading::FiberShading;
pub use fiber_space::FiberSpace;
pub use fiber_streaks::FiberStreaks;
pub use fit_skeleton::{FitSkeleton, Scheme};
pub use place_in_tree::PlaceInTree;
pub use ring_color::{RingColor, RingFilter};
pub use solid_noise::SolidNoise;
pub use straight_time::StraightTime;
pub use tree::Tree;
pub use trunk_nodes::TrunkNodes;
pub use trunk_time::TrunkTime;
pub use vary_growth::{Series, VaryGrowth};
pub use warp_solid::WarpSolid;
pub use wood_pores::WoodPores;
pub use wood_rays::WoodRays;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Wood",
        doc: "Solid wood: the pith of a tree, the time at which it grew to each point, the colours of years, and cuts.",
        kinds: vec![
            Kind::of::<TrunkNodes>(),
            Kind::of::<FitSkeleton>(),
            Kind::of::<EqualizeHeight>(),
            Kind::of::<Branches>(),
            Kind::of::<Tree>(),
            Kind::of::<TrunkTime>(),
            Kind::of::<BranchTime>(),
            Kind::of::<BlendTimes>(),
            Kind::of::<StraightTime>(),
            Kind::of::<VaryGrowth>(),
            Kind::of::<ColorPattern>(),
            Kind::of::<RingColor>(),
            Kind::of::<FiberSpace>(),
            Kind::of::<FiberStreaks>(),
            Kind::of::<WoodPores>(),
            Kind::of::<WoodRays>(),
            Kind::of::<FiberShading>(),
            Kind::of::<CutPlane>(),
            Kind::of::<Board>(),
            Kind::of::<CutSurface>(),
            Kind::of::<PlaceInTree>(),
            Kind::of::<WarpSolid>(),
            Kind::of::<BudEyes>(),
            Kind::of::<SolidNoise>(),
        ],
    }
}
