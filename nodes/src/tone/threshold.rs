//! [`Threshold`]: a mask of values above a level.
//!
//! The soft edge is the cubic step, `softness` wide in values and centred on `level`. Cost: O(pixels), bound by memory.
use crate::anywhere::changed;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::tone;
use shibo_node::{Context, Fact, In, Node, Number, Output, Outputs, node};
use shibo_value::Stop;

/// A mask: 1 where the input is above a level, 0 where it is below.
///
/// ```ron
/// "clouds": Fractal(size: 14),
/// "example": Threshold(input: "clouds", level: 0.52),
/// ```
///
/// Elsewhere: Substance Designer *Histogram Scan*; Blender *Math* (Greater Than); Material Maker *Step*; Houdini
/// *Compare*.
#[node]
pub struct Threshold {
    /// Field or solid to compare.
    pub input: In<Number>,
    /// The level, in the unit of the input.
    #[schemars(range(min = -1e9, max = 1e9))]
    #[default(0.5)]
    pub level: f64,
    /// Width of the edge, in the unit of the input; 0 makes a hard, aliased edge.
    #[schemars(range(min = 0, max = 1e9))]
    #[default(0.04)]
    pub softness: f64,
}

impl Node for Threshold {
    const OUTPUTS: &'static [Output] = &[Output::number_of("mask", &["input"], "1 above the level, 0 below.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (level, softness) = (narrow(self.level), narrow(self.softness));
        let input = cx.get(&self.input)?;
        Ok(Outputs::one(changed(input, move |values, out| tone::threshold(values, out, level, softness))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs};
    use crate::testing::port;

    #[test]
    fn is_a_mask() {
        for softness in [0.0, 1e-42, 0.3, 1e9] {
            let threshold = Threshold { input: port(0), level: 0.5, softness };
            conforms(&threshold, &[gray().into()]);
            for (x, y) in pairs(&gray(), &field(&threshold, &[gray().into()], "mask")) {
                assert!((0.0..=1.0).contains(&y));
                if f64::from((x - 0.5).abs()) > 0.5 * softness {
                    assert_eq!(y, if x > 0.5 { 1.0 } else { 0.0 }, "{x} {softness}");
                }
            }
        }
    }
}
