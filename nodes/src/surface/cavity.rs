//! [`Cavity`]: masks of places below their surroundings.
//!
//! Compares the height with the height smoothed by a Gaussian. Cost: that of one blur, O(pixels), nearly independent of
//! the radius.
use crate::bounds::at_most_half;
use crate::values::pairs;
use shibo_kernel::filter::fields;
use shibo_kernel::ground::math::saturate;
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Stop, Type};

/// Masks of hollows and of peaks: where a height lies below its surroundings, and where above.
///
/// ```ron
/// "cells": Worley(size: 7),
/// "grooves": Remap(input: "cells.border", from: (0, 0.8), to: (1, 0), clamp: true),
/// "dome": Pillow(input: "grooves", radius: 1.5),
/// "example": Cavity(input: "dome", radius: 1, depth: 0.5),
/// ```
///
/// Elsewhere: Substance Designer *Curvature Sobel*, Blender *Cavity Mask*.
#[node]
pub struct Cavity {
    /// Height in mm.
    pub input: In<Gray>,
    /// Size of the hollows: standard deviation σ of the surroundings; at most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// Difference from the surroundings at which a mask reaches 1.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.1)]
    pub depth: f64,
}

impl Node for Cavity {
    const OUTPUTS: &'static [Output] = &[
        Output::new("cavity", Type::Gray, "From 0 to 1 in hollows."),
        Output::new("peaks", Type::Gray, "From 0 to 1 on peaks."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let height = cx.get(&self.input)?;
        let soft = fields::blurred(&height, self.radius, cx.size_mm());
        let map = |sign: f64| {
            let scale = narrow(sign / self.depth.max(1e-9));
            pairs([&height, &soft], move |h, s| saturate(scale * (s - h)))
        };
        Ok(Outputs::one(map(1.0)).with("peaks", map(-1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, lumps, outputs, port, raster};
    use shibo_value::{Field, Tiling, Value};

    fn both(node: &Cavity, input: Field) -> [Field; 2] {
        let made = outputs(node, &[input.into()], &canvas()).unwrap();
        ["cavity", "peaks"].map(|name| match made.take(name, name == "cavity") {
            Some(Value::Field(field)) => field.clone(),
            other => panic!("{other:?}"),
        })
    }

    #[test]
    fn waves_have_hollows_and_peaks() {
        let waves = Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = narrow(0.3 * (grid.center(window.x + k % width, 0).x * std::f64::consts::TAU / 8.0).sin());
            }
            Ok(())
        });
        let node = Cavity { input: port(0), radius: 1.0, depth: 0.2 };
        let [cavity, peaks] = both(&node, waves).map(|field| raster(&field, &canvas()));
        // A Gaussian of 1 mm keeps e^(-½(2π/8)²) of waves of 8 mm.
        let lost = 1.0 - (-0.5 * (std::f64::consts::TAU / 8.0).powi(2)).exp();
        for x in 0..64 {
            let wave = 0.3 * lost * ((x as f64 + 0.5) * 0.5 * std::f64::consts::TAU / 8.0).sin() / 0.2;
            let (hollow, peak) = (f64::from(cavity.row(0, 3)[x]), f64::from(peaks.row(0, 3)[x]));
            assert!((hollow - (-wave).clamp(0.0, 1.0)).abs() < 0.01 && (peak - wave.clamp(0.0, 1.0)).abs() < 0.01);
        }
    }

    #[test]
    fn holds_in_any_window() {
        for (radius, depth) in [(1e-9, 1e-300), (1.0, 0.1), (16.0, 1e4)] {
            both(&Cavity { input: port(0), radius, depth }, lumps()).iter().for_each(check_field);
        }
    }
}
