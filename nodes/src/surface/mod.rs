//! Surface detail: fields computed from a height in mm.
mod ambient_occlusion;
mod bevel;
mod blend_normals;
mod cavity;
mod curvature_map;
mod draft;
mod emboss;
mod height_to_normal;
mod inflate;
mod lowered;
mod normal_to_height;
mod pillow;
mod raised_edge;
mod relief;
mod slope_map;
mod surroundings;
mod tool_reach;
mod view;

pub use ambient_occlusion::AmbientOcclusion;
pub use bevel::{Bevel, BevelSide};
pub use blend_normals::BlendNormals;
pub use cavity::Cavity;
pub use curvature_map::CurvatureMap;
pub use draft::{Draft, Keep, Pull};
pub use emboss::{Emboss, EmbossCurve};
pub use height_to_normal::HeightToNormal;
pub use inflate::{DomeProfile, Inflate};
pub use normal_to_height::NormalToHeight;
pub use pillow::Pillow;
pub use raised_edge::RaisedEdge;
pub use relief::Relief;
pub use slope_map::SlopeMap;
pub use surroundings::Surroundings;
pub use tool_reach::{Tip, ToolReach};
pub use view::{View, ViewShape};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Surface detail",
        doc: "Shapes of a surface and what follows from its height in mm: domes, edges, normals, curvature, occlusion, a lit picture.",
        kinds: vec![
            Kind::of::<Emboss>(),
            Kind::of::<Pillow>(),
            Kind::of::<Inflate>(),
            Kind::of::<Bevel>(),
            Kind::of::<RaisedEdge>(),
            Kind::of::<HeightToNormal>(),
            Kind::of::<NormalToHeight>(),
            Kind::of::<BlendNormals>(),
            Kind::of::<CurvatureMap>(),
            Kind::of::<SlopeMap>(),
            Kind::of::<Cavity>(),
            Kind::of::<AmbientOcclusion>(),
            Kind::of::<Draft>(),
            Kind::of::<ToolReach>(),
            Kind::of::<Relief>(),
            Kind::of::<View>(),
        ],
    }
}
