//! [`SplitChannels`]: the components of a colour, a normal or a vector, as separate fields. Cost: O(pixels), bound by
//! memory.
use shibo_node::{AnyVector, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Splits a colour, a normal or a vector into fields of one number each.
///
/// `x`, `y` and `z` are components: those of a normal lie in -1..1, those of a vector have its unit, usually mm. `r`,
/// `g` and `b` are the channels as they are stored, so those of a normal lie in 0..1. A vector has no third component:
/// `z` and `b` are 0.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "color": GradientMap(input: "cells.value", stops: [(0, "#304a80"), (0.5, "#c8b060"), (1, "#a03a2a")]),
/// "parts": SplitChannels(input: "color"),
/// "example": Levels(input: "parts.r", high: 0.6),
/// ```
///
/// Elsewhere: Substance Designer *RGBA Split*, Material Maker *Decompose*, Blender *Separate Color*, *Separate XYZ*,
/// Houdini *Vector to Float*.
#[node]
pub struct SplitChannels {
    /// The colour, normal or vector to split.
    pub input: In<AnyVector>,
}

impl Node for SplitChannels {
    const OUTPUTS: &'static [Output] = &[
        Output::new("x", Type::Gray, "The first component."),
        Output::new("y", Type::Gray, "The second component."),
        Output::new("z", Type::Gray, "The third component; 0 of a vector."),
        Output::new("r", Type::Gray, "The first channel as it is kept: red."),
        Output::new("g", Type::Gray, "The second channel as it is kept: green."),
        Output::new("b", Type::Gray, "The third channel as it is kept: blue; 0 of a vector."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let channel = |k: usize, decode: bool| {
            if k >= input.channels() {
                return Field::constant(Type::Gray, &[0.0]);
            }
            Field::map(Type::Gray, [input.clone()], Halo::NONE, move |out: &mut Tile, [input]: [&Tile; 1]| {
                for (out, v) in out.data_mut().iter_mut().zip(input.plane(k)) {
                    *out = if decode { 2.0 * v - 1.0 } else { *v };
                }
                Ok(())
            })
        };
        let normal = input.ty() == Type::Normal;
        Ok(Outputs::one(channel(0, normal))
            .with("y", channel(1, normal))
            .with("z", channel(2, normal))
            .with("r", channel(0, false))
            .with("g", channel(1, false))
            .with("b", channel(2, false)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, rgb};
    use crate::testing::{canvas, port, raster};

    fn split(input: Field) -> [f32; 6] {
        let (node, inputs) = (SplitChannels { input: port(0) }, [input.into()]);
        conforms(&node, &inputs);
        ["x", "y", "z", "r", "g", "b"].map(|name| raster(&field(&node, &inputs, name), &canvas()).data()[64 * 9 + 5])
    }

    #[test]
    fn gives_components_and_channels() {
        let color = raster(&rgb(), &canvas());
        let [r, g, b] = [0, 1, 2].map(|k| color.plane(k)[64 * 9 + 5]);
        assert_eq!(split(rgb()), [r, g, b, r, g, b]);
        assert_eq!(split(Field::constant(Type::Normal, &[0.75, 0.25, 1.0])), [0.5, -0.5, 1.0, 0.75, 0.25, 1.0]);
        assert_eq!(split(Field::constant(Type::Vec2, &[3.0, -4.0])), [3.0, -4.0, 0.0, 3.0, -4.0, 0.0]);
    }
}
