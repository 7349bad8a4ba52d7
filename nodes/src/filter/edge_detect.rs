//! [`EdgeDetect`]: finds where a field changes abruptly.
//!
//! The gradient of the field, smoothed by a Gaussian of σ (J. Canny, 1986), times σ·√(2π): a step of height 1 gives 1
//! if pixels are smaller than σ. If pixels are larger, the line is wider and proportionally fainter, so that a small
//! picture is the average of a large one. Of a colour the channel with the strongest gradient counts. Cost: that of one
//! blur, O(pixels).
use crate::bounds::at_most_half;
use shibo_kernel::filter::{fields, slopes};
use shibo_kernel::ground::math::atan2_degrees;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Buffer, Field, Halo, Stop, Tile, Type};

/// Finds edges: their strength, and the direction in which the field rises across them.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "example": EdgeDetect(input: "cells.value", radius: 0.15),
/// ```
///
/// Elsewhere: Substance Designer *Edge Detect*, Material Maker *Edge Detect*, Blender *Filter* (Sobel), Houdini *Edge
/// Detect*.
#[node]
pub struct EdgeDetect {
    /// Field in which to look for edges.
    pub input: In<AnyField>,
    /// Width of the lines, and size of the detail that is ignored: standard deviation σ of a Gaussian; at most half the
    /// canvas' longer side. Lines narrower than two pixels are drawn two pixels wide and proportionally fainter. With 0
    /// they are two pixels wide and of full strength, so they depend on the resolution.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.1)]
    pub radius: f64,
    /// Factor on the strength: with 1, a step of 1 gives 1 if the radius is larger than a pixel.
    #[schemars(range(min = 0, max = 1e6))]
    #[default(1.0)]
    pub strength: f64,
}

/// σ in pixels of the Gaussian derivative that responds to a step like central differences.
const PIXELS: f64 = 0.8;

impl EdgeDetect {
    /// Fills a plane from the strongest gradient of each pixel.
    fn output(&self, soft: &Field, of: impl Fn(f32, f32, f32) -> f32 + Send + Sync + 'static) -> Field {
        let (radius, strength) = (self.radius, self.strength);
        let halo = Halo::px(slopes::HALO);
        Field::map(Type::Gray, [soft.clone()], halo, move |out: &mut Tile, [soft]: [&Tile; 1]| {
            let (rect, step) = (out.window, tile::step(&out.grid));
            let [mut bx, mut by, mut gx, mut gy] = [(); 4].map(|()| Buffer::zeros(rect.len()));
            for k in 0..soft.channels() {
                slopes::slopes(&tile::view(soft, k), rect, step, &mut gx, &mut gy);
                for i in 0..rect.len() {
                    if gx[i] * gx[i] + gy[i] * gy[i] > bx[i] * bx[i] + by[i] * by[i] {
                        (bx[i], by[i]) = (gx[i], gy[i]);
                    }
                }
            }
            let sigma = if radius > 0.0 { radius } else { PIXELS * out.grid.step.element_product().sqrt() };
            let scale = narrow(sigma * std::f64::consts::TAU.sqrt() * strength);
            for (i, out) in out.plane_mut(0).iter_mut().enumerate() {
                *out = of(bx[i], by[i], scale);
            }
            Ok(())
        })
    }
}

impl Node for EdgeDetect {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[
        Output::new("edges", Type::Gray, "How strong the edge is: the height of the step."),
        Output::new("angle", Type::Gray, "The direction in which the input rises, -180..180, from +x towards +y.")
            .in_unit("°"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let soft = if self.radius > 0.0 { fields::blurred(&input, self.radius, cx.size_mm()) } else { input };
        let strength = |x: f32, y: f32, scale: f32| (x * x + y * y).sqrt() * scale;
        let angle = |x: f32, y: f32, _: f32| atan2_degrees(y, x);
        Ok(Outputs::one(self.output(&soft, strength)).with("angle", self.output(&soft, angle)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, lumps, outputs, port, raster, unlike_average};
    use shibo_value::{Tiling, Value};

    /// A step of 2 across a line through the middle, in a direction.
    fn step(degrees: f64) -> Field {
        let way = glam::DVec2::from_angle(degrees.to_radians());
        Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width) - 16.0;
                *v = if at.dot(way) > 0.0 { 2.0 } else { 0.0 };
            }
            Ok(())
        })
    }

    fn both(node: &EdgeDetect, input: Field) -> [Field; 2] {
        let made = outputs(node, &[input.into()], &canvas()).unwrap();
        ["edges", "angle"].map(|name| match made.take(name, name == "edges") {
            Some(Value::Field(field)) => field.clone(),
            other => panic!("{other:?}"),
        })
    }

    #[test]
    fn steps_have_their_height_and_their_direction() {
        for degrees in [0.0, 30.0, 90.0, 180.0] {
            for radius in [0.0, 0.5, 2.0] {
                let node = EdgeDetect { input: port(0), radius, ..EdgeDetect::default() };
                let [edges, angle] = both(&node, step(degrees)).map(|field| raster(&field, &canvas()));
                let most = (20..44).flat_map(|y| edges.row(0, y)[20..44].to_vec()).fold(0.0, f32::max);
                // On pixels of half a mm a narrow line is wider and proportionally fainter.
                let faint = if radius > 0.0 { radius / (radius * radius + 0.25 * PIXELS * PIXELS).sqrt() } else { 1.0 };
                let share = f64::from(most) / (2.0 * faint);
                assert!((0.8..1.2).contains(&share), "{degrees} {radius}: {most}");
                let off = f64::from(angle.row(0, 32)[32]) - degrees;
                let off = (off + 540.0).rem_euclid(360.0) - 180.0;
                // Without smoothing, pixels form staircases with other directions.
                assert!(off.abs() < 5.0 || (radius == 0.0 && degrees % 90.0 != 0.0), "{degrees} {radius}: {off}");
            }
        }
    }

    #[test]
    fn a_small_picture_is_the_average_of_a_large_one() {
        // The radius is less than a pixel of half a mm.
        let node = EdgeDetect { input: port(0), radius: 0.4, ..EdgeDetect::default() };
        let [edges, _] = both(&node, lumps());
        let unlike = unlike_average(&edges);
        assert!(unlike < 0.2, "{unlike}");
    }

    #[test]
    fn holds_in_any_window() {
        for (radius, strength) in [(0.0, 1e6), (0.6, 1.0), (16.0, 0.0)] {
            let node = EdgeDetect { input: port(0), radius, strength };
            both(&node, lumps().to_rgb()).iter().for_each(check_field);
            check_field(&both(&node, lumps())[0]);
        }
    }
}
