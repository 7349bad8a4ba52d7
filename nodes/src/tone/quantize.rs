//! [`Quantize`]: rounds to few values. Cost: O(pixels), bound by memory.
use crate::anywhere::changed;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::steps::{self, Steps};
use shibo_node::{CanvasFacts, Context, Fact, FieldOrSolid, In, Linear, Node, Output, Outputs, node};
use shibo_value::Stop;
use shibo_value::diagnostics::{Code, Problem};

/// Rounds values to a few evenly spaced levels: terraces, posters.
///
/// ```ron
/// "clouds": Fractal(size: 20, octaves: 3),
/// "wide": Levels(input: "clouds", low: 0.2, high: 0.8),
/// "example": Quantize(input: "wide", levels: 6, softness: 0.3),
/// ```
///
/// Elsewhere: Substance Designer *Quantize*, Material Maker *Quantize*, Blender *Posterize*, Houdini *Quantize*.
#[node]
pub struct Quantize {
    /// Field or solid to round; the channels of a colour are rounded alike.
    pub input: In<FieldOrSolid>,
    /// Number of levels, both ends of `range` included.
    #[schemars(range(min = 2, max = 65536))]
    #[default(8)]
    pub levels: u32,
    /// Lowest and highest level; values beyond are clamped.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Linear::new(0.0, 1.0))]
    pub range: Linear,
    /// Share of a step that rises smoothly: 0 is a hard edge, 1 is the smoothest staircase.
    #[schemars(range(min = 0, max = 1))]
    pub softness: f64,
}

/// Reports a range of zero width.
pub(super) fn check_range(range: Linear) -> Vec<Problem> {
    if (narrow(range.at1) - narrow(range.at0)).abs() >= 1e-9 {
        return Vec::new();
    }
    let message = format!("range is `({}, {})`; its numbers must differ", range.at0, range.at1);
    vec![Problem::new(Code::BadValue, message).at("range").help("write for example `range: (0, 1)`")]
}

impl Node for Quantize {
    const OUTPUTS: &'static [Output] = &[Output::value_of("result", &["input"], "The input with few values.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        check_range(self.range)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let spec = Steps { range: [narrow(self.range.at0), narrow(self.range.at1)], levels: self.levels };
        let softness = narrow(self.softness);
        Ok(Outputs::one(changed(input, move |values, out| steps::quantize(values, &spec, softness, out))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs, rgb};
    use crate::testing::OnCanvas as _;
    use crate::testing::port;

    #[test]
    fn rounds_to_the_nearest_level() {
        let node = Quantize { input: port(0), levels: 5, ..Quantize::default() };
        conforms(&node, &[rgb().into()]);
        let pairs = pairs(&gray(), &field(&node, &[gray().into()], "result"));
        assert!(pairs.iter().all(|(x, y)| *y == (x.clamp(0.0, 1.0) * 4.0 + 0.5).floor() / 4.0));
        let soft = Quantize { softness: 0.7, levels: 65536, range: Linear::new(3.0, -2.0), ..node };
        conforms(&soft, &[gray().into()]);
    }

    #[test]
    fn refuses_range_of_zero_width() {
        let problems = Quantize { range: Linear::new(0.5, 0.5), ..Quantize::default() };
        assert_eq!(problems.check_on(&crate::testing::canvas())[0].field.as_deref(), Some("range"));
    }
}
