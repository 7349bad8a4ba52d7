//! [`Blur`]: a Gaussian of any width.
//!
//! Narrow Gaussians are applied directly, wide ones to a picture that is halved as often as their width allows, see
//! [`kernel::blur`](shibo_kernel::filter::blur) and [`kernel::fields`](shibo_kernel::filter::fields). Error against the
//! exact Gaussian below 0.3 % of the range. Cost: O(pixels), nearly independent of the radius.
use crate::on_atlas;
use shibo_kernel::filter::fields;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Stop};

/// Softens a field by a Gaussian. Takes grey fields and colours.
///
/// ```ron
/// "cells":   Worley(size: 8),
/// "example": Blur(input: "cells.border", radius: 0.6),
/// ```
///
/// Elsewhere: Substance Designer *Blur HQ*, *Gaussian Blur*; Material Maker *Gaussian Blur*; Blender *Blur*; Houdini
/// *Blur*.
#[node]
pub struct Blur {
    /// Field to soften.
    pub input: In<AnyField>,
    /// Standard deviation σ of the Gaussian; at most half the canvas' longer side. 0 changes nothing.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// The atlas on which the input lies. If given, `radius` is measured on the surface, and the blur reads across
    /// borders of charts. This reads the whole picture; three times `radius` may be 64 texels at most.
    pub atlas: Option<In<Atlas>>,
}

impl Node for Blur {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, softened.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let most = 0.5 * canvas.size_mm().max_element();
        if self.radius <= most {
            return Vec::new();
        }
        let message = format!(
            "radius is `{}` mm; it must be at most half the canvas' longer side, {most} mm: beyond that nothing is left",
            self.radius
        );
        vec![Problem::new(Code::OutOfRange, message).at("radius")]
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.radius == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        if self.radius == 0.0 || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        if let Some(atlas) = cx.get_opt(&self.atlas)? {
            return Ok(Outputs::one(on_atlas::blurred(input, atlas, self.radius)));
        }
        Ok(Outputs::one(fields::blurred(&input, self.radius, cx.size_mm())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{check_field, field, lumps, port, render};

    fn blurred(radius: f64) -> Blur {
        Blur { input: port(0), radius, atlas: None }
    }

    #[test]
    fn keeps_mean_and_reduces_contrast() {
        let inputs = [lumps().into()];
        let mean = |v: &[f32]| v.iter().sum::<f32>() / v.len() as f32;
        let span = |v: &[f32]| v.iter().fold(f32::MIN, |a, b| a.max(*b)) - v.iter().fold(f32::MAX, |a, b| a.min(*b));
        let [sharp, soft, gone] = [0.0, 1.0, 16.0].map(|radius| render(&blurred(radius), &inputs));
        assert!((mean(soft.data()) - mean(sharp.data())).abs() < 1e-3);
        assert!(span(soft.data()) < span(sharp.data()) && span(gone.data()) < 0.02);
    }

    #[test]
    fn holds_in_any_window() {
        for radius in [1e-12, 0.3, 2.0, 16.0] {
            check_field(&field(&blurred(radius), &[lumps().into()]));
            check_field(&field(&blurred(radius), &[lumps().to_rgb().into()]));
        }
    }

    #[test]
    fn refuses_radius_beyond_half_the_canvas() {
        let problems = blurred(17.0).check_on(&crate::testing::canvas());
        assert_eq!(problems[0].field.as_deref(), Some("radius"));
        assert!(blurred(16.0).check_on(&crate::testing::canvas()).is_empty());
    }
}
