//! [`Constant`]: one number or one colour.
//!
//! Field ports take numbers and colours directly, so this node is for a value that several ports share or that needs a
//! name. Cost: none; nodes that handle constants do not read them pixel by pixel.
use shibo_kernel::ground::number::narrow;
use shibo_node::{Color, Context, Fact, Node, Output, Outputs, node};
use shibo_value::{Field, Stop, Type};

/// The same number and the same colour everywhere.
///
/// ```ron
/// "leather": Constant(color: "#9a5a34"),
/// "grain": Fractal(size: 12, kind: Billow),
/// "example": Blend(base: "leather.color", top: "grain", mode: Overlay),
/// ```
///
/// Elsewhere: Substance Designer *Uniform Color*; Blender *Value*, *RGB*; Material Maker *Uniform*; Houdini
/// *Constant*.
#[node]
#[derive(PartialEq)]
pub struct Constant {
    /// The number, in the unit of the ports that read it.
    #[schemars(range(min = -1e9, max = 1e9))]
    #[default(0.5)]
    pub value: f64,
    /// The colour; if not given, the grey of `value`.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    pub color: Option<Color>,
}

impl Node for Constant {
    const OUTPUTS: &'static [Output] = &[
        Output::new("value", Type::Gray, "The number."),
        Output::new("color", Type::Rgb, "The colour, scene-linear."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        let value = narrow(self.value);
        let color = self.color.map_or([value; 3], |color| color.0);
        Ok(Outputs::one(Field::constant(Type::Gray, &[value])).with("color", Field::constant(Type::Rgb, &color)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field};

    #[test]
    fn is_a_constant_field() {
        conforms(&Constant::default(), &[]);
        let gray = Constant { value: 0.25, color: None };
        assert_eq!(field(&gray, &[], "value").as_constant(), Some(&[0.25][..]));
        assert_eq!(field(&gray, &[], "color").as_constant(), Some(&[0.25; 3][..]));
        let colored = Constant { color: Some(Color([0.1, 0.2, 0.3])), ..gray };
        assert_eq!(field(&colored, &[], "color").as_constant(), Some(&[0.1, 0.2, 0.3][..]));
    }
}
