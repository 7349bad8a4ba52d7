//! [`SlopeBlur`]: a blur up or down the slopes of another field.
//!
//! From each pixel a path follows the gradient g of the other field: a step leads `length / steps · g / √(s² + |g|²)`,
//! where s is the steepness. So a path has the full `length` on steep slopes, and stops on tops and in hollows. Cost:
//! O(pixels · length in pixels), about 12 ns for each pixel of the length, at most 64.
use crate::bounds::at_most_half;
use shibo_kernel::filter::paths::{self, Reader, Reduce};
use shibo_kernel::filter::slopes;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::View;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Buffer, Field, FieldSource, Given, Grid, Read, Stop, Tile, Window};

/// How the values on a path are combined.
#[choice]
pub enum SlopeBlurMode {
    /// Their mean: the input is smeared along the slopes
    #[default]
    Blur,
    /// The minimum: edges are eaten away
    Min,
    /// The maximum: edges grow outwards
    Max,
}

/// Smears a field up or down the slopes of another field: chipped edges, paint that runs, worn corners.
///
/// ```ron
/// "cells": Worley(size: 10),
/// "stones": Threshold(input: "cells.border", level: 0.6, softness: 0.05),
/// "noise": Fractal(size: 3, octaves: 5),
/// "example": SlopeBlur(input: "stones", slope: "noise", length: 1.5, mode: Min),
/// ```
///
/// Elsewhere: Substance Designer *Slope Blur Grayscale*, *Slope Blur Color*; Material Maker *Slope Blur*.
#[node]
pub struct SlopeBlur {
    /// Field to smear.
    pub input: In<AnyField>,
    /// Field whose slopes the paths follow.
    pub slope: In<Gray>,
    /// Length of the paths on steep slopes; above 0 they lead uphill, below 0 downhill. At most half the canvas' longer
    /// side.
    #[schemars(range(min = -5e5, max = 5e5), extend("unit" = "mm"))]
    #[default(0.5)]
    pub length: f64,
    /// The slope, in units of the field per mm, on which paths have 0.7 of that length.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "1/mm"))]
    #[default(0.2)]
    pub steepness: f64,
    /// How the values on a path are combined.
    #[default(SlopeBlurMode::Blur)]
    pub mode: SlopeBlurMode,
}

/// Maximum number of steps of a path.
const MOST: f64 = 64.0;

struct Followed {
    input: Field,
    slope: Field,
    length: f64,
    steepness: f64,
    mode: SlopeBlurMode,
}

impl Followed {
    /// Length of a path, and its halo including interpolation, in pixels.
    fn reach(&self, grid: &Grid) -> (i32, i32) {
        let (x, y) = grid.pixels(self.length.abs());
        (x + 1, y + 1)
    }

    /// Turns slopes into steps, in pixels.
    fn steps(&self, grid: &Grid, count: usize, gx: &mut [f32], gy: &mut [f32]) {
        let (length, square) = (narrow(self.length / count as f64), narrow(self.steepness * self.steepness));
        let [px, py] = grid.step.map(|step| 1.0 / step).to_array().map(narrow);
        for (x, y) in gx.iter_mut().zip(gy) {
            // Clamp slopes whose square would overflow; they count as steep anyway.
            let (a, b) = (x.clamp(-1e15, 1e15), y.clamp(-1e15, 1e15));
            let scale = length / (square + a * a + b * b).max(1e-30).sqrt();
            (*x, *y) = (a * scale * px, b * scale * py);
        }
    }
}

impl FieldSource for Followed {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let (dx, dy) = self.reach(grid);
        vec![
            Read::new(&self.input, grid, window.grow(dx, dy)),
            Read::new(&self.slope, grid, window.grow(dx + 1, dy + 1)),
        ]
    }

    fn reaches_by(&self) -> Option<&'static str> {
        Some("length")
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, slope, rect) = (given.tile(0), given.tile(1), out.window);
        let big = input.window;
        let (mut gx, mut gy) = (Buffer::zeros(big.len()), Buffer::zeros(big.len()));
        slopes::slopes(&tile::view(slope, 0), big, tile::step(&out.grid), &mut gx, &mut gy);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to a few")]
        let count = (self.length.abs() / out.grid.min_step()).ceil().clamp(1.0, MOST) as usize;
        self.steps(&out.grid, count, &mut gx, &mut gy);
        given.check()?;
        let views: Vec<_> = (0..input.channels()).map(|k| tile::view(input, k)).collect();
        let slope = Reader::new(&[View::new(&gx, big), View::new(&gy, big)]);
        let reduce = match self.mode {
            SlopeBlurMode::Blur => Reduce::Mean,
            SlopeBlurMode::Min => Reduce::Least,
            SlopeBlurMode::Max => Reduce::Greatest,
        };
        paths::follow(&Reader::new(&views), &slope, rect, (count, reduce), &mut out.planes_mut());
        Ok(())
    }
}

impl Node for SlopeBlur {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, smeared.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("length", self.length.abs(), canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.length == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, slope) = (cx.get(&self.input)?, cx.get(&self.slope)?);
        if self.no_op().is_some() || input.as_constant().is_some() || slope.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let (ty, tiling) = (input.ty(), input.tiling().and(slope.tiling()));
        let Self { length, steepness, mode, .. } = *self;
        Ok(Outputs::one(Field::new(ty, tiling, Followed { input, slope, length, steepness, mode })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, port, raster, render};
    use shibo_value::{Tiling, Type};

    fn node() -> SlopeBlur {
        SlopeBlur { input: port(0), slope: port(1), ..SlopeBlur::default() }
    }

    /// A field that rises by `slope` for each mm to the right.
    fn ramp(slope: f32) -> Field {
        Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = slope * grid.center(window.x + k % width, 0).as_vec2().x;
            }
            Ok(())
        })
    }

    #[test]
    fn follows_the_slope() {
        // On a slope of 3/4 with a steepness of 1, paths of 5 mm are 3 mm, six pixels; in ten steps.
        let node = SlopeBlur { length: 5.0, steepness: 1.0, ..node() };
        let out = render(&node, &[ramp(1.0).into(), ramp(0.75).into()]);
        let input = raster(&ramp(1.0), &canvas());
        for x in 0..50 {
            // The mean of a ramp is half way.
            assert!((out.row(0, 7)[x] - (input.row(0, 7)[x] + 1.5)).abs() < 1e-3);
        }
        let most = SlopeBlur { mode: SlopeBlurMode::Max, ..node.clone() };
        let out = render(&most, &[ramp(1.0).into(), ramp(0.75).into()]);
        assert!((0..50).all(|x| (out.row(0, 7)[x] - (input.row(0, 7)[x] + 3.0)).abs() < 1e-3));
        let least = SlopeBlur { mode: SlopeBlurMode::Min, length: -5.0, ..node };
        let out = render(&least, &[ramp(1.0).into(), ramp(0.75).into()]);
        assert!((10..64).all(|x| (out.row(0, 7)[x] - (input.row(0, 7)[x] - 3.0)).abs() < 1e-3));
    }

    #[test]
    fn holds_in_any_window() {
        for (length, steepness) in [(0.0, 0.2), (3.0, 0.01), (-16.0, 1e6), (1e-9, 1e-300)] {
            for mode in [SlopeBlurMode::Blur, SlopeBlurMode::Min, SlopeBlurMode::Max] {
                let node = SlopeBlur { length, steepness, mode, ..node() };
                check_field(&field(&node, &[lumps().to_rgb().into(), lumps().into()]));
            }
        }
    }
}
