//! [`BakeNormal`]: the normal of the surface at each texel.
//!
//! The file's normals; without them vertex normals, the mean over the triangles around a vertex, weighted by their
//! angles there. Cost: about 40 ns a texel.
use shibo_kernel::mesh::{bake, fields};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Atlas, Stop, Tiling, Type};

/// The normal of the surface in object space, stored as ½ + ½n; beyond charts and their gutters it points up.
///
/// This is not the normal map of a material, which is in tangent space. Use it to tell top from sides, for dust, moss
/// or wear.
///
/// ```ron
/// "cup": MeshShape(shape: Cylinder, size: (50, 50, 30)),
/// "atlas": MeshAtlas(mesh: "cup"),
/// "example": BakeNormal(atlas: "atlas"),
/// ```
///
/// Elsewhere: Substance Painter *World Space Normal* map; Blender *Normal* bake in object space; Houdini *Maps Baker*.
#[node]
pub struct BakeNormal {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// True to interpolate normals between the corners of triangles; false for one normal per triangle.
    #[default(true)]
    pub smooth: bool,
}

impl Node for BakeNormal {
    const OUTPUTS: &'static [Output] = &[Output::new("normal", Type::Normal, "The normals in space, ½ + ½n.")];
    const FACTS: &'static [Fact] = &[];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (atlas, smooth) = (cx.get(&self.atlas)?, self.smooth);
        Ok(Outputs::one(fields::baked(Type::Normal, &atlas, move |texels, planes| {
            if let Ok(planes) = <[&mut [f32]; 3]>::try_from(planes) {
                bake::normals(texels, smooth, planes);
            }
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::atlas_of;
    use crate::mesh::{MeshForm, MeshShape};
    use crate::testing::{check_field, field, port};

    #[test]
    fn holds_in_any_window() {
        let inputs = [atlas_of(&MeshShape { shape: MeshForm::Torus, ..MeshShape::default() })];
        for smooth in [false, true] {
            check_field(&field(&BakeNormal { atlas: port(0), smooth }, &inputs));
        }
    }
}
