//! [`Levels`]: black point, white point and gamma.
//!
//! The tool of this name in every picture editor. Colours are changed scene-linear, so a `gamma` above 1 lightens less
//! than on encoded values. Cost: O(pixels); with a gamma about 1 ns per pixel.
use crate::anywhere::changed;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::tone;
use shibo_node::{Context, Fact, FieldOrSolid, In, Linear, Node, Output, Outputs, node};
use shibo_value::Stop;

/// Stretches the contrast: `low` becomes black and `high` white, and values beyond them are clamped.
///
/// ```ron
/// "clouds": Fractal(size: 14),
/// "example": Levels(input: "clouds", low: 0.25, high: 0.75),
/// ```
///
/// Elsewhere: Substance Designer *Levels*; Blender *Map Range*, *RGB Curves*; Photoshop *Levels*; Houdini *Levels*.
#[node]
pub struct Levels {
    /// Field or solid to change; the channels of a colour are changed alike.
    pub input: In<FieldOrSolid>,
    /// The value that becomes black.
    #[schemars(range(min = -1e9, max = 1e9))]
    pub low: f64,
    /// The value that becomes white. If `high` is below `low` the result is inverted; if both are equal it is a step.
    #[schemars(range(min = -1e9, max = 1e9))]
    #[default(1.0)]
    pub high: f64,
    /// Changes values between black and white by the power 1/gamma: above 1 lightens, below 1 darkens.
    #[schemars(range(min = 0.01, max = 100))]
    #[default(1.0)]
    pub gamma: f64,
    /// New values of black and white, `(black, white)`.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Linear::new(0.0, 1.0))]
    pub output: Linear,
}

impl Node for Levels {
    const OUTPUTS: &'static [Output] = &[Output::value_of("result", &["input"], "The input with new levels.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let spec = tone::Levels {
            input: [narrow(self.low), narrow(self.high)],
            gamma: narrow(self.gamma),
            output: [narrow(self.output.at0), narrow(self.output.at1)],
        };
        Ok(Outputs::one(changed(input, move |values, out| tone::levels(values, out, &spec))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs, rgb};
    use crate::testing::port;

    #[test]
    fn stretches_and_clamps() {
        let levels = Levels { input: port(0), low: 0.25, high: 0.75, ..Levels::default() };
        for input in [gray(), rgb()] {
            let inputs = [input.clone().into()];
            conforms(&levels, &inputs);
            let wanted = |x: f32| ((x - 0.25) * 2.0).clamp(0.0, 1.0);
            assert!(pairs(&input, &field(&levels, &inputs, "result")).iter().all(|(x, y)| *y == wanted(*x)));
        }
    }

    #[test]
    fn extreme_parameters_conform() {
        for (low, high, gamma) in [(0.5, 0.5, 1.0), (1.0, 0.0, 100.0), (-1e9, 1e9, 0.01), (0.5, 0.5 + 1e-40, 2.0)] {
            let output = Linear::new(1e9, -1e9);
            conforms(&Levels { input: port(0), low, high, gamma, output }, &[gray().into()]);
        }
    }

    #[test]
    fn gamma_lightens_the_middle() {
        let levels = Levels { input: port(0), gamma: 2.0, ..Levels::default() };
        let pairs = pairs(&gray(), &field(&levels, &[gray().into()], "result"));
        assert!(pairs.iter().all(|(x, y)| (y - x.clamp(0.0, 1.0).sqrt()).abs() < 1e-6));
    }
}
