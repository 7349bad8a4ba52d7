//! [`Sharpen`]: an unsharp mask.
//!
//! input + amount·(input − input blurred). Cost: that of one blur, O(pixels), nearly independent of the radius.
use crate::bounds::at_most_half;
use crate::values::pairs;
use shibo_kernel::filter::fields;
use shibo_kernel::ground::number::narrow;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::Stop;
use shibo_value::diagnostics::Problem;

/// Strengthens detail of a certain size: its difference from the surroundings grows.
///
/// Values are not clamped: beside a strong edge they may leave the range of the input.
///
/// ```ron
/// "clouds": Fractal(size: 12, octaves: 7),
/// "example": Sharpen(input: "clouds", radius: 0.8, amount: 2.5),
/// ```
///
/// Elsewhere: Substance Designer *Sharpen*, Material Maker *Sharpen*, Blender *Filter* (Sharpen), Houdini *Sharpen*.
#[node]
pub struct Sharpen {
    /// Field to sharpen.
    pub input: In<AnyField>,
    /// Size of the detail: standard deviation σ of the blur that the input is compared with; at most half the canvas'
    /// longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.2)]
    pub radius: f64,
    /// Strength: 0 changes nothing, 1 doubles the finest detail; below 0 softens.
    #[schemars(range(min = -1, max = 100))]
    #[default(1.0)]
    pub amount: f64,
}

impl Node for Sharpen {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, sharpened.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.radius == 0.0 || self.amount == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let (soft, amount) = (fields::blurred(&input, self.radius, cx.size_mm()), narrow(self.amount));
        Ok(Outputs::one(pairs([&input, &soft], move |v, soft| v + amount * (v - soft))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, port, raster, render};

    #[test]
    fn enlarges_differences_from_the_mean() {
        let node = Sharpen { input: port(0), radius: 1.0, amount: 2.0 };
        let out = render(&node, &[lumps().into()]);
        // The kernel of the blur, summed up by hand in the middle of the canvas.
        let input = raster(&lumps(), &canvas());
        let (mut sum, mut all) = (0.0, 0.0);
        for dy in -12..=12_i32 {
            for dx in -12..=12_i32 {
                let weight = (-f64::from(dx * dx + dy * dy) / 8.0).exp();
                let at = |k: i32, d: i32| usize::try_from(k + d).unwrap();
                all += weight;
                sum += weight * f64::from(input.row(0, at(30, dy))[at(27, dx)]);
            }
        }
        let v = f64::from(input.row(0, 30)[27]);
        assert!((f64::from(out.row(0, 30)[27]) - (v + 2.0 * (v - sum / all))).abs() < 0.01);
    }

    #[test]
    fn holds_in_any_window() {
        for (radius, amount) in [(0.0, 1.0), (0.3, 100.0), (16.0, -1.0)] {
            check_field(&field(&Sharpen { input: port(0), radius, amount }, &[lumps().to_rgb().into()]));
        }
    }
}
