//! [`Invert`]: one minus a field. Cost: O(pixels), bound by memory.
use shibo_kernel::pointwise::tone;
use shibo_node::{AnyField, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Field, Halo, Stop, Tile};

/// One minus the input: bright becomes dark.
///
/// ```ron
/// "cells": Worley(size: 8, normalize: true),
/// "example": Invert(input: "cells"),
/// ```
///
/// Elsewhere: Substance Designer *Invert Grayscale*; Blender *Invert Color*; Material Maker *Invert*; Houdini
/// *Complement*.
#[node]
pub struct Invert {
    /// Field to invert. Values outside 0..1 are inverted too: 1.2 becomes -0.2.
    pub input: In<AnyField>,
}

impl Node for Invert {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "One minus the input.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let fill = |out: &mut Tile, [input]: [&Tile; 1]| {
            tone::invert(input.data(), out.data_mut());
            Ok(())
        };
        Ok(Outputs::one(Field::map(input.ty(), [input], Halo::NONE, fill)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs, rgb};
    use crate::testing::port;

    #[test]
    fn inverts_every_channel() {
        let invert = Invert { input: port(0) };
        for input in [gray(), rgb()] {
            let inputs = [input.clone().into()];
            conforms(&invert, &inputs);
            assert!(pairs(&input, &field(&invert, &inputs, "result")).iter().all(|(x, y)| *y == 1.0 - x));
        }
    }
}
