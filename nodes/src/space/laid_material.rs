//! [`LaidMaterial`]: moves all channels of a material together; `Use` lays out the materials of a sub-graph with it.
//!
//! Each channel is moved as by [`Transform`]; normals and the angles of the anisotropy are rotated too. Heights stay
//! the same in mm. Graph files cannot name this node: `Use(canvas: …)` makes it. Cost: that of its channels.
use super::Transform;
use crate::values::each;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, node};
use shibo_value::{Channel, Field, Material, Stop, Tiling, Type, Value};
use std::sync::Arc;

/// Moves, rotates and scales a material.
#[node]
pub struct LaidMaterial {
    /// Material to move.
    pub input: In<Material>,
    /// Shift of the features, to the right and down.
    pub offset: Xy,
    /// Rotation of the features, from +x towards +y.
    pub angle: f64,
    /// Factor on the size of the features.
    #[default(Xy::new(1.0, 1.0))]
    pub scale: Xy,
    /// The point about which features are rotated and scaled; the canvas' centre by default.
    pub pivot: Option<Xy>,
}

impl LaidMaterial {
    fn transform(&self) -> Transform {
        let Self { offset, angle, scale, pivot, .. } = *self;
        Transform { input: In::default(), offset, angle, scale, pivot }
    }
}

/// Angles in degrees, each increased by `angle`.
#[expect(clippy::cast_possible_truncation, reason = "fields hold f32")]
fn turned(angles: Field, angle: f64) -> Field {
    let angle = (angle % 360.0) as f32;
    if angle == 0.0 {
        return angles;
    }
    each(&angles, move |a| a + angle)
}

impl Node for LaidMaterial {
    const OUTPUTS: &'static [Output] = &[Output::new("result", Type::Material, "The material, moved.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.transform().keeps(canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        self.transform().no_op()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let material = cx.get(&self.input)?;
        let (transform, size) = (self.transform(), cx.size_mm());
        let channels = material.channels().iter().map(|(channel, field)| {
            let moved = transform.apply(field, size);
            (*channel, if *channel == Channel::AnisotropyAngle { turned(moved, self.angle) } else { moved })
        });
        Ok(Outputs::one(Value::Material(Arc::new(Material::new(channels)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, port};
    use crate::testing::{canvas, lumps, raster};
    use shibo_node::{Call, DynNode};

    #[test]
    fn channels_move_together_and_directions_turn() {
        let given = Material::new([
            (Channel::Height, lumps()),
            (Channel::Normal, Field::constant(Type::Normal, &[1.0, 0.5, 0.5])),
            (Channel::AnisotropyAngle, Field::constant(Type::Gray, &[10.0])),
        ]);
        let node = LaidMaterial { input: port(0), angle: 90.0, ..LaidMaterial::default() };
        let inputs = [Value::Material(Arc::new(given))];
        let call = Call { kind: "Laid", canvas: &canvas(), inputs: &inputs, files: &[], evaluator: &Plain };
        let outputs = DynNode::evaluate(&node, &call).unwrap();
        let Some(Value::Material(made)) = outputs.take("result", true) else { panic!("no material") };
        let pixel = |channel: Channel, x: usize, y: usize| {
            let tile = raster(made.get(channel).unwrap(), &canvas());
            (0..tile.channels()).map(|c| tile.row(c, y)[x]).collect::<Vec<_>>()
        };
        let before = raster(&lumps(), &canvas());
        // A rotation of +x towards +y, about the middle of 64² pixels.
        for (x, y) in [(0, 0), (5, 11), (40, 63)] {
            assert!((before.row(0, y)[x] - pixel(Channel::Height, 63 - y, x)[0]).abs() < 1e-5, "{x} {y}");
        }
        // A slope to the right becomes a slope downwards; normals have y up.
        assert_eq!(pixel(Channel::Normal, 3, 3), [0.5, 0.0, 0.5]);
        assert_eq!(pixel(Channel::AnisotropyAngle, 3, 3), [100.0]);
    }
}
