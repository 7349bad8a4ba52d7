//! [`BakeParts`]: numbers of the parts of a mesh at each texel.
use shibo_kernel::mesh::{bake, fields};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::{Atlas, Field, Stop, Tiling, Type};
use std::sync::Arc;

/// The parts to number.
#[choice]
pub enum Parts {
    /// The parts that the file names: objects and their materials.
    #[default]
    Part,
    /// Connected pieces in space.
    Piece,
    /// Connected pieces on the canvas.
    Chart,
}

impl Parts {
    /// The numbers of all triangles, starting at 1.
    pub(super) fn numbers(self, atlas: &Atlas) -> Vec<f32> {
        #[expect(clippy::cast_precision_loss, reason = "there are fewer than 2²⁴ triangles")]
        match self {
            Self::Part => atlas.mesh.parts.iter().map(|n| f32::from(*n) + 1.0).collect(),
            Self::Piece => atlas.mesh.pieces().0.iter().map(|n| *n as f32 + 1.0).collect(),
            Self::Chart => atlas.charts.iter().map(|n| f32::from(*n) + 1.0).collect(),
        }
    }

    /// The numbers as a field.
    pub(super) fn field(self, atlas: &Arc<Atlas>) -> Field {
        let numbers = self.numbers(atlas);
        fields::baked(Type::Ids, atlas, move |texels, mut planes| {
            if let [out] = &mut planes[..] {
                bake::of_triangles(texels, &numbers, out);
            }
        })
    }
}

/// The number of the part to which each texel belongs, starting at 1; 0 beyond charts and their gutters.
///
/// ```ron
/// "cup": MeshShape(shape: Cylinder),
/// "atlas": MeshAtlas(mesh: "cup"),
/// "example": BakeParts(atlas: "atlas", by: Chart),
/// ```
///
/// Elsewhere: Substance Painter *ID* map; Blender *Object Index*, *Material Index*; Houdini *Maps Baker*.
#[node]
pub struct BakeParts {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// The parts to number.
    pub by: Parts,
}

impl Node for BakeParts {
    const OUTPUTS: &'static [Output] = &[Output::new("ids", Type::Ids, "The numbers.")];
    const FACTS: &'static [Fact] = &[];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(self.by.field(&cx.get(&self.atlas)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::atlas_of;
    use crate::mesh::{MeshForm, MeshShape};
    use crate::testing::{check_field, field, port, render};

    #[test]
    fn sides_of_a_cube_are_numbered() {
        let inputs = [atlas_of(&MeshShape { shape: MeshForm::Cube, ..MeshShape::default() })];
        for (by, most, count) in [(Parts::Part, 1.0, 2), (Parts::Piece, 1.0, 2), (Parts::Chart, 6.0, 7)] {
            let node = BakeParts { atlas: port(0), by };
            let tile = render(&node, &inputs);
            let mut seen = tile.data().to_vec();
            seen.sort_by(f32::total_cmp);
            seen.dedup();
            assert_eq!((seen[0], seen[seen.len() - 1], seen.len()), (0.0, most, count));
            check_field(&field(&node, &inputs));
        }
    }
}
