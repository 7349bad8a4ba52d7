//! [`Remap`]: maps one range of numbers to another. Cost: O(pixels), bound by memory.
use crate::anywhere::changed;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::tone;
use shibo_node::{CanvasFacts, Context, Fact, FieldOrSolid, In, Linear, Node, Output, Outputs, node};
use shibo_value::Stop;
use shibo_value::diagnostics::{Code, Problem};

/// Maps one range of numbers to another linearly: for example lengths to shares, or bright to dark.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "example": Remap(input: "cells.border", from: (0, 1.5), to: (1, 0), clamp: true),
/// ```
///
/// Elsewhere: Blender *Map Range*; Houdini *Fit*; Substance Designer *Histogram Scan*, *Histogram Range*; Material
/// Maker *Remap*.
#[node]
pub struct Remap {
    /// Field or solid to map; the channels of a colour are mapped alike.
    pub input: In<FieldOrSolid>,
    /// Two values of the input, in its unit.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Linear::new(0.0, 1.0))]
    pub from: Linear,
    /// The two values of the result.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Linear::new(0.0, 1.0))]
    pub to: Linear,
    /// True to clamp results to `to`; false to continue along the line.
    pub clamp: bool,
}

/// Minimum difference between the values of `from`: with a smaller one, results could overflow.
const LEAST: f64 = 1e-9;

impl Node for Remap {
    const OUTPUTS: &'static [Output] = &[Output::value_of("result", &["input"], "The input on its new range.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let Linear { at0, at1 } = self.from;
        if self.clamp || f64::from((narrow(at1) - narrow(at0)).abs()) >= LEAST {
            return Vec::new();
        }
        let message = format!("from is `({at0}, {at1})`; its numbers must differ");
        vec![Problem::new(Code::BadValue, message).at("from").help("for a step say `clamp: true`, or use `Threshold`")]
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.from == self.to && !self.clamp).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        if self.no_op().is_some() {
            return Ok(Outputs::one(input));
        }
        let pair = |line: Linear| [narrow(line.at0), narrow(line.at1)];
        let (from, to, clamp) = (pair(self.from), pair(self.to), self.clamp);
        Ok(Outputs::one(changed(input, move |values, out| tone::remap(values, out, from, to, clamp))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs, rgb};
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, port};

    fn remap(from: (f64, f64), to: (f64, f64), clamp: bool) -> Remap {
        Remap { input: port(0), from: Linear::new(from.0, from.1), to: Linear::new(to.0, to.1), clamp }
    }

    #[test]
    fn follows_the_line() {
        for input in [gray(), rgb()] {
            let inputs = [input.clone().into()];
            let (free, clamped) = (remap((0.0, 0.5), (1.0, 3.0), false), remap((0.0, 0.5), (1.0, 3.0), true));
            conforms(&free, &inputs);
            conforms(&clamped, &inputs);
            assert!(pairs(&input, &field(&free, &inputs, "result")).iter().all(|(x, y)| *y == 1.0 + 4.0 * x));
            let wanted = |x: f32| (1.0 + 4.0 * x).clamp(1.0, 3.0);
            assert!(pairs(&input, &field(&clamped, &inputs, "result")).iter().all(|(x, y)| *y == wanted(*x)));
        }
    }

    #[test]
    fn passes_on_unchanged_input() {
        let same = remap((0.2, 0.7), (0.2, 0.7), false);
        assert_eq!(same.no_op(), Some("input"));
        let input = gray();
        let output = field(&same, &[input.clone().into()], "result");
        assert_eq!(output.id(), input.id());
        assert_eq!(remap((0.2, 0.7), (0.2, 0.7), true).no_op(), None);
    }

    #[test]
    fn refuses_range_of_zero_width() {
        for from in [(0.5, 0.5), (1e9, 1e9 + 1e-3), (0.0, 1e-12)] {
            assert_eq!(remap(from, (0.0, 1.0), false).check_on(&canvas())[0].field.as_deref(), Some("from"));
            conforms(&remap(from, (-1e9, 1e9), true), &[gray().into()]);
        }
        conforms(&remap((0.0, 1e-8), (-1e9, 1e9), false), &[gray().into()]);
    }
}
