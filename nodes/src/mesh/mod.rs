//! Meshes: files and simple shapes, their atlases, and baked maps.
mod at_points;
mod bake_curvature;
mod bake_normal;
mod bake_occlusion;
mod bake_parts;
mod bake_position;
mod bake_solid;
mod bake_thickness;
mod cast;
mod connect_mesh_points;
mod dilate_gutter;
mod displace_mesh;
mod draw_mesh_wrinkles;
mod load_mesh;
mod mesh_atlas;
mod mesh_points;
mod mesh_shape;
mod read;
mod simulate_mesh_springs;
mod subdivide_mesh;
mod tangent_field;

pub use bake_curvature::BakeCurvature;
pub use bake_normal::BakeNormal;
pub use bake_occlusion::BakeOcclusion;
pub use bake_parts::{BakeParts, Parts};
pub use bake_position::{BakePosition, Relative};
pub use bake_solid::{AlignParts, BakeSolid, CutBy, Footprint};
pub use bake_thickness::BakeThickness;
pub use connect_mesh_points::{ConnectMeshPoints, MeshNeighbors};
pub use dilate_gutter::{DilateGutter, DilateMode, Rest, filled};
pub use displace_mesh::{DisplaceMesh, OverBudget, ReliefNormals};
pub use draw_mesh_wrinkles::{DrawMeshWrinkles, MeshLinks, MeshVaryBy};
pub use load_mesh::{Center, LengthUnit, LoadMesh, UpAxis};
pub use mesh_atlas::{ChartSource, Gutter, MeshAtlas, Overlap, Pack, Udim};
pub use mesh_points::MeshPoints;
pub use mesh_shape::{MeshForm, MeshShape};
pub use simulate_mesh_springs::{MeshBoundary, SimulateMeshSprings};
pub use subdivide_mesh::SubdivideMesh;
pub use tangent_field::{FieldFrom, TangentField};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Meshes",
        doc: "Surfaces in space, from files or simple shapes, in mm, z up; their atlases, which lay them out on the canvas; \
              and fields that are known of the surface at each texel.",
        kinds: vec![
            Kind::of::<LoadMesh>(),
            Kind::of::<MeshShape>(),
            Kind::of::<SubdivideMesh>(),
            Kind::of::<MeshAtlas>(),
            Kind::of::<BakePosition>(),
            Kind::of::<BakeNormal>(),
            Kind::of::<BakeParts>(),
            Kind::of::<BakeCurvature>(),
            Kind::of::<BakeOcclusion>(),
            Kind::of::<BakeThickness>(),
            Kind::of::<BakeSolid>(),
            Kind::of::<DilateGutter>(),
            Kind::of::<TangentField>(),
            Kind::of::<MeshPoints>(),
            Kind::of::<ConnectMeshPoints>(),
            Kind::of::<SimulateMeshSprings>(),
            Kind::of::<DrawMeshWrinkles>(),
            Kind::of::<DisplaceMesh>(),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, outputs, port};
    use shibo_value::{Type, Value};

    /// The atlas of a shape on the canvas of unit tests.
    pub(super) fn atlas_of(shape: &MeshShape) -> Value {
        let mesh = outputs(shape, &[], &canvas()).unwrap().take("mesh", true).cloned().unwrap();
        let node = MeshAtlas { mesh: port(0), ..MeshAtlas::default() };
        let atlas = outputs(&node, &[mesh], &canvas()).unwrap().take("atlas", true).cloned().unwrap();
        assert_eq!(atlas.ty(), Type::Atlas);
        atlas
    }
}
