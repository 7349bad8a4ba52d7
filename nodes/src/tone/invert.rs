//! [`Invert`]: one minus a field. Cost: O(pixels), bound by memory.
use crate::anywhere::changed;
use shibo_kernel::pointwise::tone;
use shibo_node::{Context, Fact, FieldOrSolid, In, Node, Output, Outputs, node};
use shibo_value::Stop;

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
    /// Field or solid to invert. Values outside 0..1 are inverted too: 1.2 becomes -0.2.
    pub input: In<FieldOrSolid>,
}

impl Node for Invert {
    const OUTPUTS: &'static [Output] = &[Output::value_of("result", &["input"], "One minus the input.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(changed(cx.get(&self.input)?, tone::invert)?))
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
