//! [`SubdivideMesh`]: shortens edges and keeps the shape.
//!
//! Edges that are too long are split at their middles, repeatedly, see
//! [`kernel::subdivide`](shibo_kernel::mesh::subdivide). Cost: O(triangles of the result).
use super::read::MOST_TRIANGLES;
use shibo_kernel::mesh::subdivide::subdivide;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Mesh, Stop, Type};

/// Splits the edges of a mesh until none is longer than `edge`; shape, UVs and parts stay the same.
///
/// Use it for directions, curvature and springs, which are computed at vertices: large flat triangles have too few
/// vertices.
///
/// ```ron
/// "box": MeshShape(shape: Cube, size: (60, 60, 20)),
/// "fine": SubdivideMesh(mesh: "box", edge: 3),
/// "atlas": MeshAtlas(mesh: "fine"),
/// "example": BakeCurvature(atlas: "atlas", radius: 3),
/// ```
///
/// Elsewhere: Blender *Subdivide*; Houdini *Remesh*, *Divide*.
#[node]
pub struct SubdivideMesh {
    /// The mesh.
    pub mesh: In<Mesh>,
    /// The longest edge. The result may have 2 million triangles at most.
    #[schemars(range(min = 1e-3, max = 1e6), extend("unit" = "mm"))]
    #[default(2.0)]
    pub edge: f64,
}

impl Node for SubdivideMesh {
    const OUTPUTS: &'static [Output] = &[Output::new("mesh", Type::Mesh, "The mesh with shorter edges.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mesh = cx.get(&self.mesh)?;
        let fine = subdivide(&mesh, self.edge, MOST_TRIANGLES).map_err(|error| {
            let message = format!("edge is `{}` mm; {error}, and there may be {MOST_TRIANGLES}", self.edge);
            Problem::new(Code::TooLarge, message).at("edge").help("raise `edge`")
        })?;
        Ok(Outputs::one(fine))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshShape;
    use crate::testing::{canvas, outputs, port};

    #[test]
    fn too_short_edges_are_refused() {
        let mesh = outputs(&MeshShape::default(), &[], &canvas()).unwrap().take("mesh", true).cloned().unwrap();
        let of = |edge| outputs(&SubdivideMesh { mesh: port(0), edge }, std::slice::from_ref(&mesh), &canvas());
        assert!(of(1.0).is_ok());
        let Err(Stop::Failed(problem)) = of(1e-3) else { panic!("no error") };
        assert_eq!((problem.code, problem.field.as_deref()), (Code::TooLarge, Some("edge")));
    }
}
