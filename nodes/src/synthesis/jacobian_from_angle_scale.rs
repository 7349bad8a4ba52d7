//! [`JacobianFromAngleScale`]: the rotation, scale and stretch of features.
//!
//! Source: JP5149288B2 III, figures 6 and 7 (rows C3, C14, C15). Users give the orientation and size of features, and
//! the node inverts the matrix: `J = (R(angle) · scale · diag(stretch, 1))⁻¹`. Cost: O(pixels).
use shibo_kernel::synthesis::jacobian::from_angle_scale;
use shibo_node::{Context, Direction, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Rotates, scales and stretches the features of a synthesised texture, the same everywhere or by fields.
///
/// ```ron
/// "input": Gradient(shape: Linear, angle: 90),
/// "exemplar": Exemplar(input: "stripes", size: (64, 64), periodic: Yes),
/// "stripes": Worley(size: 4),
/// "jacobian": JacobianFromAngleScale(angle: "angle", scale: 1.4, stretch: 1.8),
/// "angle": "= 90 * input",
/// "coords": Synthesize(exemplar: "exemplar", jacobian: "jacobian", size: (200, 200)),
/// "example": SampleExemplar(coords: "coords", input: "stripes", jacobian: "jacobian"),
/// ```
#[node]
pub struct JacobianFromAngleScale {
    /// Rotation of features in degrees, from +x towards +y; or vectors that their x axis follows.
    #[default(In::constant(0.0))]
    pub angle: In<Direction>,
    /// Factor on the size of features.
    #[default(In::constant(1.0))]
    pub scale: In<Gray>,
    /// Factor on the length of features along their own x axis.
    #[default(In::constant(1.0))]
    pub stretch: In<Gray>,
}

impl Node for JacobianFromAngleScale {
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] =
        &[Output::new("jacobian", Type::Jacobian, "From output to exemplar: J00 J01 J10 J11.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let inputs = [cx.get(&self.angle)?, cx.get(&self.scale)?, cx.get(&self.stretch)?];
        let of = |angle: f32, scale: f32, stretch: f32| from_angle_scale(angle.to_radians(), scale, stretch);
        let constants = inputs.each_ref().map(|field| field.as_constant().map(|c| c[0]));
        if let [Some(angle), Some(scale), Some(stretch)] = constants {
            return Ok(Outputs::one(Field::constant(Type::Jacobian, &of(angle, scale, stretch))));
        }
        let fill = move |out: &mut Tile, [angle, scale, stretch]: [&Tile; 3]| {
            let n = out.window.len();
            for p in 0..n {
                let j = of(angle.data()[p], scale.data()[p], stretch.data()[p]);
                (0..4).for_each(|c| out.data_mut()[c * n + p] = j[c]);
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Jacobian, inputs, Halo::NONE, fill)))
    }
}
