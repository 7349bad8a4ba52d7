//! [`BakePosition`]: the position of each texel on the surface.
//!
//! `X = P0 + J_f·(x - U0)` of the texel's triangle, see [`kernel::bake`](shibo_kernel::mesh::bake). Cost: about 15 ns a
//! texel, finding its triangle included.
use glam::{DMat3, DVec3};
use shibo_kernel::mesh::motion::RigidMotion;
use shibo_kernel::mesh::{bake, fields};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::{Atlas, Stop, Tiling, Type};

/// Reference of the positions.
#[choice]
pub enum Relative {
    /// The origin, in mm.
    #[default]
    None,
    /// The box around the mesh: 0 to 1 from one side to the other, along each axis separately.
    Bounds,
}

/// The position of each texel in space: x, y and z in the channels of a colour.
///
/// Positions continue for two texels beyond the border of each chart, as if its triangles did; farther out the value is
/// 0.
///
/// ```ron
/// "ball": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "example": BakePosition(atlas: "atlas", relative: Bounds),
/// ```
///
/// Elsewhere: Substance Painter *Position* map; Blender *Position* of the *Geometry* node, baked; Houdini *Maps Baker*.
#[node]
pub struct BakePosition {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Reference of the positions.
    pub relative: Relative,
}

impl Node for BakePosition {
    const OUTPUTS: &'static [Output] = &[Output::new("position", Type::Rgb, "The places.").in_unit("mm")];
    const FACTS: &'static [Fact] = &[];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn unit(&self, output: &Output) -> Option<&'static str> {
        output.unit.filter(|_| self.relative == Relative::None)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let atlas = cx.get(&self.atlas)?;
        if self.relative == Relative::None {
            return Ok(Outputs::one(fields::places(&atlas)));
        }
        let [low, high] = atlas.mesh.bounds();
        // Along an axis without extent, all positions of the mesh are 0.
        let scale = (high - low).to_array().map(|length| if length > 0.0 { 1.0 / length } else { 0.0 });
        let turn = DMat3::from_diagonal(DVec3::from_array(scale));
        let motion = RigidMotion { turn, shift: -(turn * low) };
        Ok(Outputs::one(fields::baked(Type::Rgb, &atlas, move |texels, planes| {
            if let Ok(planes) = <[&mut [f32]; 3]>::try_from(planes) {
                bake::places(texels, |_| motion, planes);
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
        for relative in [Relative::None, Relative::Bounds] {
            check_field(&field(&BakePosition { atlas: port(0), relative }, &inputs));
        }
    }

    /// The positions of a flat sheet are those of the canvas.
    #[test]
    fn relative_places_go_from_0_to_1() {
        let plane = MeshShape { shape: MeshForm::Plane, size: (30.0, 30.0, 1.0), ..MeshShape::default() };
        let node = BakePosition { atlas: port(0), relative: Relative::Bounds };
        let tile = crate::testing::render(&node, &[atlas_of(&plane)]);
        let side = tile.width();
        for k in 0..tile.window.len() {
            let want = [(k % side) as f32 + 0.5, (side - k / side) as f32 - 0.5].map(|x| x / side as f32);
            assert!((tile.plane(0)[k] - want[0]).abs() < 1e-5 && (tile.plane(1)[k] - want[1]).abs() < 1e-5);
            assert_eq!(tile.plane(2)[k], 0.0);
        }
    }
}
