//! [`BakeCurvature`]: tells convex from concave places of a surface.
//!
//! The mean curvature at vertices, see [`kernel::curvature`](shibo_kernel::mesh::curvature), interpolated linearly
//! between them. Cost: O(triangles · 100).
use crate::values::each;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::curvature::mean_curvature;
use shibo_kernel::mesh::{bake, fields};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Atlas, Stop, Tiling, Type};

/// The curvature of the surface at each texel: above ½ where it is convex, below ½ where it is concave, ½ where it is
/// flat.
///
/// The curvature of a ball of `radius` gives white, or black if concave. Use it for wear on edges and dirt in hollows.
/// Beyond charts and their gutters the value is ½.
///
/// ```ron
/// "cup": MeshShape(shape: Lathe),
/// "atlas": MeshAtlas(mesh: "cup"),
/// "example": BakeCurvature(atlas: "atlas", radius: 4),
/// ```
///
/// Elsewhere: Substance Painter *Curvature* map; Blender *Pointiness*; Houdini *Measure Curvature*.
#[node]
pub struct BakeCurvature {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Radius over which curvature is averaged; also the radius of a ball that gives white.
    #[schemars(range(min = 1e-3, max = 1e5), extend("unit" = "mm"))]
    #[default(2.0)]
    pub radius: f64,
}

impl Node for BakeCurvature {
    const OUTPUTS: &'static [Output] = &[
        Output::new("curvature", Type::Gray, "½ + ½·mean·radius, limited to 0..1."),
        Output::new("mean", Type::Gray, "The mean curvature: 1/r on a ball of radius r.").in_unit("1/mm"),
    ];
    const FACTS: &'static [Fact] = &[];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let atlas = cx.get(&self.atlas)?;
        let values = mean_curvature(&atlas.mesh, &atlas.smooth, self.radius);
        cx.check()?;
        let mean = fields::baked(Type::Gray, &atlas, move |texels, mut planes| {
            if let [out] = &mut planes[..] {
                bake::of_vertices(texels, &values, out);
            }
        });
        let (mean, half) = (cx.shared_field("mean curvature", mean), narrow(0.5 * self.radius));
        let curvature = each(&mean, move |h| (0.5 + half * h).clamp(0.0, 1.0));
        Ok(Outputs::one(curvature).with("mean", mean))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::atlas_of;
    use crate::mesh::{MeshForm, MeshShape};
    use crate::testing::{check_field, field, outputs, port, render};

    #[test]
    fn ball_has_constant_curvature() {
        let inputs = [atlas_of(&MeshShape { shape: MeshForm::Sphere, ..MeshShape::default() })];
        let node = BakeCurvature { atlas: port(0), radius: 15.0 };
        check_field(&field(&node, &inputs));
        let tile = render(&node, &inputs);
        // Half the curvature of a ball of `radius`.
        assert!(tile.data().iter().all(|v| (*v - 0.75).abs() < 0.01 || *v == 0.5));
        let outputs = outputs(&node, &inputs, &crate::testing::canvas()).unwrap();
        assert!(outputs.take("mean", false).is_some());
    }
}
