//! [`HighPass`]: detail without large shapes.
//!
//! input − input blurred + middle. Cost: that of one blur, O(pixels), nearly independent of the radius.
use crate::bounds::at_most_half;
use crate::values::pairs;
use shibo_kernel::filter::fields;
use shibo_kernel::ground::number::narrow;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::Stop;
use shibo_value::diagnostics::Problem;

/// Removes shapes that are larger than a radius: uneven light of a photograph, hills under a relief.
///
/// ```ron
/// "clouds": Fractal(size: 20, octaves: 8),
/// "flat": HighPass(input: "clouds", radius: 1.5),
/// "example": Levels(input: "flat", low: 0.4, high: 0.6),
/// ```
///
/// Elsewhere: Substance Designer *Highpass*.
#[node]
pub struct HighPass {
    /// Field to flatten.
    pub input: In<AnyField>,
    /// Shapes larger than this are removed: standard deviation σ of a Gaussian; at most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(2.0)]
    pub radius: f64,
    /// The result for an even input; 0 leaves detail around 0.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(0.5)]
    pub middle: f64,
}

impl Node for HighPass {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The detail, around the middle.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let (soft, middle) = (fields::blurred(&input, self.radius, cx.size_mm()), narrow(self.middle));
        Ok(Outputs::one(pairs([&input, &soft], move |v, soft| (v - soft) + middle)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};
    use shibo_value::{Field, Tiling, Type};

    #[test]
    fn removes_hills_and_keeps_ripples() {
        // A wave as long as the canvas and one of 2 mm: a Gaussian of 2 mm keeps 0.93 of the first and nothing of the
        // second.
        let waves = Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let x = grid.center(window.x + k % width, 0).x * std::f64::consts::TAU;
                #[expect(clippy::cast_possible_truncation, reason = "a test picture")]
                let value = ((x / 32.0).sin() + 0.1 * (x / 2.0).sin()) as f32;
                *v = value;
            }
            Ok(())
        });
        let out = render(&HighPass { input: port(0), radius: 2.0, middle: 0.5 }, &[waves.into()]);
        let keeps = 1.0 - (-0.5 * (2.0 * std::f64::consts::TAU / 32.0_f64).powi(2)).exp();
        for (k, v) in (0..64).zip(out.row(0, 9)) {
            let x = (f64::from(k) + 0.5) * 0.5 * std::f64::consts::TAU;
            let want = 0.5 + keeps * (x / 32.0).sin() + 0.1 * (x / 2.0).sin();
            assert!((f64::from(*v) - want).abs() < 0.01, "{v} {want}");
        }
    }

    #[test]
    fn holds_in_any_window() {
        for (radius, middle) in [(1e-9, 0.0), (0.4, 0.5), (16.0, 1e6)] {
            check_field(&field(&HighPass { input: port(0), radius, middle }, &[lumps().to_rgb().into()]));
        }
    }
}
