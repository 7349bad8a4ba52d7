//! [`ConvertColor`]: converts between colour spaces.
//!
//! Sources: IEC 61966-2-1 (sRGB), CIE 15 (Lab), B. Ottosson, "A perceptual color space for image processing" (2020), A.
//! Smith (1978) for HSV, G. Joblove and D. Greenberg (1978) for HSL, ITU-R BT.709 (YCbCr). Cost: O(pixels), 1 to 20 ns
//! per pixel.
use crate::anywhere::{pointwise, rgb, rgb_mut};
use shibo_kernel::pointwise::color::{self, ColorSpace};
use shibo_node::{AnyColor, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Planes, Stop, Type};

/// Converts colours between colour spaces: to change only lightness or hue, or to make colours from numbers.
///
/// The three channels of the result are the components of the colour space in its own units, in the order of its name.
/// Formulas take them apart (`lch.r`, `lch.g`, `lch.b`), change them and put them together, `"= (l, c, h)"`; a second node
/// converts them back. Oklab colours outside of the range of real colours, with a channel below 0, are clamped to 0.
///
/// ```ron
/// "noise": Fractal(size: 12, seed: 1),
/// "hue": Remap(input: "noise", from: (0.2, 0.8), to: (0, 360)),
/// "lch": "= (0.75, 0.12, hue)",
/// "example": ConvertColor(input: "lch", from: Oklch, to: Linear),
/// ```
///
/// Elsewhere: Blender *Combine Color*, *Separate Color*; Houdini *OCIO Transform*.
#[node]
pub struct ConvertColor {
    /// Colours, or three numbers.
    pub input: In<AnyColor>,
    /// Colour space of the input.
    #[default(ColorSpace::Linear)]
    pub from: ColorSpace,
    /// Colour space of the result.
    #[default(ColorSpace::Oklab)]
    pub to: ColorSpace,
}

impl Node for ConvertColor {
    const OUTPUTS: &'static [Output] = &[Output::color_of("color", &["input"], "The colours in the other space.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (from, to) = (self.from, self.to);
        let input = cx.get(&self.input)?;
        if from == to {
            return Ok(Outputs::one(input));
        }
        let fill = move |out: &mut [&mut [f32]], [input]: [Planes<'_>; 1]| {
            if let Some(out) = rgb_mut(out) {
                color::convert(from, to, rgb(&input), out);
            }
        };
        Ok(Outputs::one(pointwise(Type::Rgb, [(input, "input")], fill)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, rgb};
    use crate::testing::port;
    use shibo_value::Field;

    #[test]
    fn any_space_from_any_numbers_is_finite() {
        use ColorSpace as C;
        let spaces = [C::Linear, C::Srgb, C::Hsv, C::Hsl, C::YCbCr, C::Xyz, C::Lab, C::Lch, C::Oklab, C::Oklch];
        for from in spaces {
            for to in spaces {
                conforms(&ConvertColor { input: port(0), from, to }, &[rgb().into()]);
            }
            let wild = Field::constant(Type::Rgb, &[-1e3, 1e4, 50.0]);
            conforms(&ConvertColor { input: port(0), from, to: C::Linear }, &[wild.into()]);
        }
    }
}
