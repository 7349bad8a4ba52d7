//! [`PackChannels`]: a colour of three fields. Cost: O(pixels), bound by memory.
use shibo_node::{Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Puts three fields together as the channels of a colour: for packed maps, or after `SplitChannels`.
///
/// The numbers are kept as they are; a file written as sRGB encodes them, one written raw does not.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "height": Remap(input: "cells.border", from: (0, 1.5), clamp: true),
/// "noise": Perlin(size: 5),
/// "example": PackChannels(r: "height", g: "noise", b: "cells.value"),
/// ```
///
/// Elsewhere: Substance Designer *RGBA Merge*, *Channels Shuffle*; Material Maker *Combine*, Blender *Combine Color*,
/// Houdini *Float to Vector*.
#[node]
pub struct PackChannels {
    /// The first channel, red.
    #[default(In::constant(0.0))]
    pub r: In<Gray>,
    /// The second channel, green.
    #[default(In::constant(0.0))]
    pub g: In<Gray>,
    /// The third channel, blue.
    #[default(In::constant(0.0))]
    pub b: In<Gray>,
}

impl Node for PackChannels {
    const OUTPUTS: &'static [Output] = &[Output::new("color", Type::Rgb, "The three fields as a colour.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let inputs = [cx.get(&self.r)?, cx.get(&self.g)?, cx.get(&self.b)?];
        Ok(Outputs::one(Field::map(Type::Rgb, inputs, Halo::NONE, |out: &mut Tile, inputs: [&Tile; 3]| {
            out.planes_mut().into_iter().zip(inputs).for_each(|(out, input)| out.copy_from_slice(input.plane(0)));
            Ok(())
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, gray};
    use crate::testing::{canvas, lumps, port, raster, render};

    #[test]
    fn three_fields_are_three_channels() {
        let node = PackChannels { r: port(0), b: port(1), ..PackChannels::default() };
        let inputs = [gray().into(), lumps().into()];
        conforms(&node, &inputs);
        let out = render(&node, &inputs);
        assert_eq!(out.plane(0), raster(&gray(), &canvas()).data());
        assert_eq!(out.plane(2), raster(&lumps(), &canvas()).data());
        assert!(out.plane(1).iter().all(|v| *v == 0.0));
    }
}
