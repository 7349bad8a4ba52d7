//! [`Pillow`]: domes between grooves.
//!
//! `1 - (1 - min(d/radius, 1))²` of the distance d to the grooves: steep at the edge of a groove, flat at the radius,
//! like full-grain leather between its wrinkles. Cost: that of the distance, O(pixels · radius in pixels).
use crate::bounds::at_most_half;
use shibo_kernel::filter::{distance, fields};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Type};

/// Raises the areas between grooves to domes, 0 in the grooves and 1 on top.
///
/// ```ron
/// "cells":   Worley(size: 6),
/// "grooves": Remap(input: "cells.border", from: (0, 0.6), to: (1, 0), clamp: true),
/// "example": Pillow(input: "grooves", radius: 1.5),
/// ```
///
/// Elsewhere: Substance Designer *Bevel*; Material Maker *Bevel*; Photoshop *Bevel and Emboss*.
#[node]
pub struct Pillow {
    /// Input; grooves are where it is above the threshold.
    pub input: In<Gray>,
    /// Distance from a groove at which a dome reaches its full height; at most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// The value at a groove's edge.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(0.35)]
    pub threshold: f64,
}

impl Node for Pillow {
    const OUTPUTS: &'static [Output] =
        &[Output::new("dome", Type::Gray, "From 0 in the grooves to 1 on top of the domes.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    #[expect(clippy::cast_possible_truncation, reason = "fields are f32")]
    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let distances = fields::distances(&cx.get(&self.input)?, self.threshold as f32, self.radius);
        let radius = self.radius as f32;
        Ok(Outputs::one(Field::map(Type::Gray, [distances], Halo::NONE, move |out, [d]| {
            out.data_mut().copy_from_slice(d.data());
            distance::dome(out.data_mut(), radius);
            Ok(())
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};

    #[test]
    fn domes_rise_from_the_grooves() {
        let pillow = Pillow { input: port(0), radius: 2.0, ..Pillow::default() };
        let (dome, input) =
            (render(&pillow, &[lumps().into()]), crate::testing::raster(&lumps(), &crate::testing::canvas()));
        assert!(dome.data().iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(dome.data().iter().any(|v| *v > 0.9));
        assert!(dome.data().iter().zip(input.data()).all(|(d, g)| *g <= 0.35 || *d == 0.0));
        check_field(&field(&pillow, &[lumps().into()]));
        check_field(&field(&Pillow { radius: 1e-9, ..pillow }, &[lumps().into()]));
    }
}
