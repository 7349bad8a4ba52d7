//! [`CurvatureMap`]: the curvature of a height.
//!
//! Computes the mean curvature of the height smoothed by a Gaussian, see
//! [`kernel::curvature`](shibo_kernel::surface::curvature): the same edges have the same curvature at every resolution.
//! Cost: that of one blur, O(pixels).
use crate::bounds::at_most_half;
use shibo_kernel::filter::fields;
use shibo_kernel::ground::math::saturate;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::surface::curvature;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// The curvature of a height: positive on edges and tops, negative in grooves.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "grooves": Remap(input: "cells.border", from: (0, 0.8), to: (1, 0), clamp: true),
/// "dome": Pillow(input: "grooves", radius: 2),
/// "curvature": CurvatureMap(input: "dome", radius: 0.25),
/// "example": Levels(input: "curvature.normalized"),
/// ```
///
/// Elsewhere: Substance Designer *Curvature*, *Curvature Smooth*; Houdini *Measure*.
#[node]
pub struct CurvatureMap {
    /// Height in mm.
    pub input: In<Gray>,
    /// Size of the detail that is removed: standard deviation σ of a Gaussian; at most half the canvas' longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.1)]
    pub radius: f64,
    /// The curvature that becomes 1 in `normalized`; the negative of it becomes 0.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "1/mm"))]
    #[default(1.0)]
    pub range: f64,
}

impl Node for CurvatureMap {
    const OUTPUTS: &'static [Output] = &[
        Output::new("curvature", Type::Gray, "The mean curvature; convex is positive.").in_unit("1/mm"),
        Output::new("normalized", Type::Gray, "The same as 0..1 around ½."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let soft = if self.radius > 0.0 { fields::blurred(&input, self.radius, cx.size_mm()) } else { input };
        let map = |scale: Option<f32>| {
            Field::map(
                Type::Gray,
                [soft.clone()],
                Halo::px(curvature::HALO),
                move |out: &mut Tile, [soft]: [&Tile; 1]| {
                    let (rect, step) = (out.window, tile::step(&out.grid));
                    curvature::mean_curvature(&tile::view(soft, 0), rect, step, out.plane_mut(0));
                    if let Some(scale) = scale {
                        out.data_mut().iter_mut().for_each(|v| *v = saturate(0.5 + scale * *v));
                    }
                    Ok(())
                },
            )
        };
        Ok(Outputs::one(map(None)).with("normalized", map(Some(narrow(0.5 / self.range.max(1e-9))))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, outputs, port, render};
    use shibo_value::{Tiling, Value};

    #[test]
    fn a_ball_has_its_curvature() {
        // A cap of a ball of 40 mm; the surroundings of the cap do not affect its middle.
        let ball = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width) - 16.0;
                *v = narrow((1600.0 - at.length_squared()).max(0.0).sqrt() - 40.0);
            }
            Ok(())
        });
        for radius in [0.0, 1.0] {
            let node = CurvatureMap { input: port(0), radius, range: 0.05 };
            let out = render(&node, &[ball.clone().into()]);
            for (x, y) in [(32, 32), (20, 40), (45, 30)] {
                assert!((out.row(0, y)[x] - 0.025).abs() < 0.003, "{radius}: {}", out.row(0, y)[x]);
            }
            let made = outputs(&node, &[ball.clone().into()], &canvas()).unwrap();
            let Some(Value::Field(half)) = made.take("normalized", false) else { panic!() };
            assert!((crate::testing::raster(half, &canvas()).row(0, 32)[32] - 0.75).abs() < 0.03);
        }
    }

    #[test]
    fn holds_in_any_window() {
        for radius in [0.0, 0.7, 16.0] {
            check_field(&field(&CurvatureMap { input: port(0), radius, range: 1e-9 }, &[lumps().into()]));
        }
    }
}
