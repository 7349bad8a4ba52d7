//! [`Emboss`]: a grey picture as relief.
//!
//! Source: JP4905282B2 §7, "a grey picture whose values are depths for embossing" (row A56). Cost: O(pixels).
use crate::values::each;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_node::{Context, Gray, In, Node, Output, Outputs, node};
use shibo_value::{Stop, Type};

/// Mapping of values to depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum EmbossCurve {
    /// Proportional.
    #[default]
    Linear,
    /// Flat at both ends, as if pressed by a rounded tool: `v² (3 - 2v)`.
    Smooth,
    /// `v` to this power: above 1 only the brightest parts become deep, below 1 all but the darkest.
    Power(f64),
}

/// Presses a grey picture into the surface: 0 is the surface, 1 the full depth.
///
/// Values are clamped to 0..1.
///
/// ```ron
/// "shape": Worley(size: 6),
/// "height": Emboss(input: "shape.f1", depth: 1.5, curve: Smooth),
/// "example": Relief(height: "height"),
/// ```
#[node]
pub struct Emboss {
    /// The picture, 0..1.
    pub input: In<Gray>,
    /// Depth where the picture is 1; negative raises it.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(0.2)]
    pub depth: f64,
    /// Mapping of values to depth.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 100.0))]
    #[default(EmbossCurve::Linear)]
    pub curve: EmbossCurve,
}

impl Node for Emboss {
    const OUTPUTS: &'static [Output] =
        &[Output::new("height", Type::Gray, "Height: 0 where the picture is 0.").in_unit("mm")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let (depth, curve) = (narrow(self.depth), self.curve);
        let press = move |v: f32| {
            let v = v.clamp(0.0, 1.0);
            -depth
                * match curve {
                    EmbossCurve::Linear => v,
                    EmbossCurve::Smooth => v * v * (3.0 - 2.0 * v),
                    EmbossCurve::Power(power) => math::pow(v, narrow(power)),
                }
        };
        Ok(Outputs::one(each(&input, press)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, gray};
    use crate::testing::{port, render};
    use shibo_value::{Field, Value};

    #[test]
    fn values_become_depth() {
        for (curve, at) in
            [(EmbossCurve::Linear, 0.25), (EmbossCurve::Smooth, 0.15625), (EmbossCurve::Power(2.0), 0.0625)]
        {
            let node = Emboss { input: port(0), depth: 2.0, curve };
            let half = render(&node, &[Value::Field(Field::constant(Type::Gray, &[0.25]))]);
            assert!((half.data()[0] + 2.0 * at).abs() < 1e-5, "{curve:?} {}", half.data()[0]);
            let beyond = render(&node, &[Value::Field(Field::constant(Type::Gray, &[7.0]))]);
            assert!((beyond.data()[0] + 2.0).abs() < 1e-5);
            conforms(&node, &[Value::Field(gray())]);
        }
    }
}
