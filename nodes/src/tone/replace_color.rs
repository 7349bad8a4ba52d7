//! [`ReplaceColor`]: replaces one colour by another.
//!
//! Compares colours by their distance in Oklab (B. Ottosson, 2020), where black and white are 1 apart and equal
//! distances look about equal. Cost: O(pixels), about 40 ns per pixel.
use crate::anywhere::{pointwise, rgb, rgb_mut};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::color;
use shibo_node::{AnyColor, Color, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Planes, Stop, Type};

/// Replaces a colour, and similar colours, by another; also gives a mask of the replaced places.
///
/// ```ron
/// "cells": Worley(size: 6),
/// "stones": GradientMap(input: "cells.value", stops: [(0.33, "#3f5f3a"), (0.33, "#b08a5a"), (0.66, "#b08a5a"), (0.66, "#5a4a42")], interpolation: Constant),
/// "shade": Remap(input: "cells.border", from: (0, 1), to: (0.6, 1), clamp: true),
/// "shaded": Blend(base: "stones", top: "shade", mode: Multiply),
/// "example": ReplaceColor(input: "shaded", from: "#b08a5a", to: "#2a6a9a", tolerance: 0.12),
/// ```
///
/// Elsewhere: Substance Designer *Replace Color*.
#[node]
pub struct ReplaceColor {
    /// The colours.
    pub input: In<AnyColor>,
    /// The colour to replace.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4))]
    #[default(Color::srgb([128, 128, 128]))]
    pub from: Color,
    /// The new colour.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4))]
    #[default(Color::srgb([176, 48, 32]))]
    pub to: Color,
    /// Colours within this distance are replaced completely. Black and white are 1 apart, just distinguishable colours
    /// about 0.02.
    #[schemars(range(min = 0, max = 2))]
    #[default(0.1)]
    pub tolerance: f64,
    /// Width of the transition beyond `tolerance`: within it colours change partly, farther away they stay unchanged.
    #[schemars(range(min = 0, max = 2))]
    #[default(0.05)]
    pub softness: f64,
    /// True to turn lighter and darker shades of the old colour into such shades of the new one; false to make all of
    /// them the new colour.
    #[default(true)]
    pub keep_shading: bool,
}

impl Node for ReplaceColor {
    const OUTPUTS: &'static [Output] = &[
        Output::color_of("color", &["input"], "The colours with the new one, scene-linear."),
        Output::number_of("mask", &["input"], "How much each place was changed, 0..1."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let spec = color::Replace {
            from: self.from.0,
            to: self.to.0,
            tolerance: narrow(self.tolerance),
            softness: narrow(self.softness),
            keep_shading: self.keep_shading,
        };
        let fill = move |out: &mut [&mut [f32]], [input]: [Planes<'_>; 1]| {
            if let Some(out) = rgb_mut(out) {
                color::replace(rgb(&input), &spec, out);
            }
        };
        let mask = move |out: &mut [&mut [f32]], [input]: [Planes<'_>; 1]| {
            color::likeness(rgb(&input), &spec, &mut *out[0]);
        };
        let color = pointwise(Type::Rgb, [(input.clone(), "input")], fill)?;
        Ok(Outputs::one(color).with("mask", pointwise(Type::Gray, [(input, "input")], mask)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, rgb};
    use crate::testing::{canvas, port, raster, render};
    use shibo_value::Field;

    fn node() -> ReplaceColor {
        let (from, to) = (Color([0.2, 0.2, 0.2]), Color([0.8, 0.1, 0.1]));
        ReplaceColor { input: port(0), from, to, ..ReplaceColor::default() }
    }

    fn pixel(node: &ReplaceColor, color: [f32; 3]) -> [f32; 3] {
        let out = render(node, &[Field::constant(Type::Rgb, &color).into()]);
        [0, 1, 2].map(|k| out.plane(k)[5])
    }

    #[test]
    fn replaces_colour_and_keeps_others() {
        let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
        assert!(close(pixel(&node(), [0.2; 3]), [0.8, 0.1, 0.1]));
        assert_eq!(pixel(&node(), [0.0, 0.9, 0.0]), [0.0, 0.9, 0.0]);
        // Greys within the tolerance become flat, or keep their differences in shade.
        let flat = ReplaceColor { keep_shading: false, ..node() };
        assert!(close(pixel(&flat, [0.18; 3]), [0.8, 0.1, 0.1]));
        assert!(pixel(&node(), [0.18; 3])[0] < 0.79);
    }

    #[test]
    fn conforms_with_any_softness() {
        for softness in [0.0, 0.05, 2.0] {
            conforms(&ReplaceColor { softness, ..node() }, &[rgb().into()]);
        }
        let inputs = [rgb().into()];
        let mask = crate::conform::field(&node(), &inputs, "mask");
        assert!(raster(&mask, &canvas()).data().iter().all(|v| (0.0..=1.0).contains(v)));
    }
}
