//! [`Hsv`]: hue, saturation and value.
//!
//! Source: A. Smith, "Color gamut transform pairs" (1978). Works on sRGB-encoded values, as picture editors do. Each
//! change may be a field, so that a mask can limit it to some places. Cost: O(pixels), about 15 ns per pixel.
use crate::anywhere::{pointwise, rgb, rgb_mut};
use shibo_kernel::pointwise::color;
use shibo_node::{AnyColor, Context, Fact, In, Node, Number, Output, Outputs, node};
use shibo_value::{Planes, Stop, Type};

/// Changes the hue, saturation and value of colours. Each change is a number or a field, or, for colours
/// in space, a solid.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "color": GradientMap(input: "cells.value", stops: [(0, "#b0402a"), (1, "#e8b25a")]),
/// "turn": Gradient(angle: 0),
/// "degrees": Remap(input: "turn", to: (0, 360)),
/// "example": Hsv(input: "color", hue: "degrees", saturation: 0.9),
/// ```
///
/// Elsewhere: Substance Designer *HSL*, Material Maker *Adjust HSV*, Blender *Hue/Saturation/Value*, Houdini *HSV
/// Adjust*.
#[node]
pub struct Hsv {
    /// The colours.
    pub input: In<AnyColor>,
    /// Rotation of the hue in degrees: red, yellow, green, cyan, blue, magenta are 60° apart.
    #[schemars(extend("minimum" = -360.0, "maximum" = 360.0, "unit" = "°"))]
    #[default(In::constant(0.0))]
    pub hue: In<Number>,
    /// Factor on the saturation: 0 is grey, 1 changes nothing. The result is clamped to full saturation.
    #[default(In::constant(1.0))]
    pub saturation: In<Number>,
    /// Factor on the value, the largest of the encoded channels: 0 is black, 1 changes nothing.
    #[default(In::constant(1.0))]
    pub value: In<Number>,
}

const PORTS: &[&str] = &["input", "hue", "saturation", "value"];

impl Node for Hsv {
    const OUTPUTS: &'static [Output] = &[Output::color_of("color", PORTS, "The changed colours, scene-linear.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let inputs = [
            (cx.get(&self.input)?, "input"),
            (cx.get(&self.hue)?, "hue"),
            (cx.get(&self.saturation)?, "saturation"),
            (cx.get(&self.value)?, "value"),
        ];
        let fill = |out: &mut [&mut [f32]], [input, hue, saturation, value]: [Planes<'_>; 4]| {
            if let Some(out) = rgb_mut(out) {
                color::adjust_hsv(rgb(&input), [hue.plane(0), saturation.plane(0), value.plane(0)], out);
            }
        };
        Ok(Outputs::one(pointwise(Type::Rgb, inputs, fill)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, gray, rgb};
    use crate::testing::{port, render};
    use shibo_value::Field;

    #[test]
    fn reds_become_greens_and_grey_stays_grey() {
        let node = Hsv { input: port(0), hue: port(1), ..Hsv::default() };
        let (red, third) = (Field::constant(Type::Rgb, &[0.8, 0.0, 0.0]), Field::constant(Type::Gray, &[120.0]));
        let out = render(&node, &[red.into(), third.into()]);
        let pixel = [0, 1, 2].map(|k| out.plane(k)[77]);
        assert!(pixel[0].abs() < 1e-6 && (pixel[1] - 0.8).abs() < 1e-5 && pixel[2].abs() < 1e-6, "{pixel:?}");
        let grey =
            render(&Hsv { input: port(0), saturation: port(1), ..Hsv::default() }, &[rgb().into(), gray().into()]);
        assert!(grey.data().iter().all(|v| v.is_finite() && *v >= 0.0));
    }

    #[test]
    fn any_change_is_finite() {
        for change in [-1e30, -1.0, 0.0, 1.0, 1e6] {
            let field = Field::constant(Type::Gray, &[change]);
            let hue = Hsv { input: port(0), hue: port(1), ..Hsv::default() };
            conforms(&hue, &[rgb().into(), field.clone().into()]);
            let others = Hsv { input: port(0), saturation: port(1), ..Hsv::default() };
            conforms(&others, &[rgb().into(), field.into()]);
        }
        conforms(&Hsv { input: port(0), value: port(1), ..Hsv::default() }, &[rgb().into(), gray().into()]);
    }
}
