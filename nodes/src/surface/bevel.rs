//! [`Bevel`]: raises a mask to a shape with bevelled edges.
//!
//! Applies a profile to the exact distance from the edge, see [`kernel::distance`](shibo_kernel::filter::distance).
//! Cost: that of one or two distances, O(pixels · width in pixels).
use crate::bounds::at_most_half;
use crate::distances;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::surface::profile::{self, Profile};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// The side of the mask's edge on which the slope lies.
#[choice]
pub enum BevelSide {
    /// Inside: the slope starts at the edge
    #[default]
    Inside,
    /// Outside: the slope ends at the edge
    Outside,
    /// Half inside and half outside
    Both,
}

/// Raises a shape and bevels its edge: from 0 outside to the full height inside, along a profile.
///
/// ```ron
/// "cells": Worley(size: 10),
/// "height": Bevel(mask: "cells.border", threshold: 0.5, width: 1.2, height: 1),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Substance Designer *Bevel*, *Bevel Smooth*; Material Maker *Bevel*.
#[node]
pub struct Bevel {
    /// Mask; the shape is the area where it is above the threshold. The edge is located between pixels: a mask with
    /// soft edges gives smoother slopes than one of black and white.
    pub mask: In<Gray>,
    /// The value at the shape's edge.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(0.5)]
    pub threshold: f64,
    /// Width of the slope; at most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub width: f64,
    /// Height of the raised shape; below 0 the shape is sunk.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(0.5)]
    pub height: f64,
    /// The side of the edge on which the slope lies.
    #[default(BevelSide::Inside)]
    pub side: BevelSide,
    /// The shape of the slope.
    #[default(Profile::Round)]
    pub profile: Profile,
}

impl Node for Bevel {
    const OUTPUTS: &'static [Output] = &[Output::new("height", Type::Gray, "The height of the shape.").in_unit("mm")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("width", self.width, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (mask, width) = (cx.get(&self.mask)?, self.width);
        let (height, profile, steep) = (narrow(self.height), self.profile, narrow(1.0 / width.max(1e-12)));
        let map = |fields: [Field; 1], line: [f32; 2]| {
            Field::map(Type::Gray, fields, Halo::NONE, move |out: &mut Tile, [d]: [&Tile; 1]| {
                profile::apply(profile, d.data(), line, height, out.data_mut());
                Ok(())
            })
        };
        let away = |radius: f64, inside: bool| distances::to_edge(&mask, self.threshold, radius, inside);
        Ok(Outputs::one(match self.side {
            BevelSide::Inside => map([away(width, true)], [steep, 0.0]),
            BevelSide::Outside => map([away(width, false)], [-steep, 1.0]),
            BevelSide::Both => {
                let sides = [away(0.5 * width, true), away(0.5 * width, false)];
                Field::map(Type::Gray, sides, Halo::NONE, move |out: &mut Tile, [inside, outside]: [&Tile; 2]| {
                    let across: Vec<f32> = inside.data().iter().zip(outside.data()).map(|(a, b)| a - b).collect();
                    profile::apply(profile, &across, [steep, 0.5], height, out.data_mut());
                    Ok(())
                })
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};
    use shibo_value::Tiling;

    /// The half plane right of x = 16 mm; its edge is precise to a small part of a pixel.
    fn half() -> Field {
        Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = grid.center(window.x + k % width, 0).as_vec2().x - 15.5;
            }
            Ok(())
        })
    }

    #[test]
    fn slopes_lie_on_the_chosen_side() {
        for (side, from) in [(BevelSide::Inside, 16.0), (BevelSide::Outside, 12.0), (BevelSide::Both, 14.0)] {
            let node =
                Bevel { mask: port(0), width: 4.0, height: 3.0, side, profile: Profile::Linear, ..Bevel::default() };
            let out = render(&node, &[half().into()]);
            for (x, v) in out.row(0, 20).iter().enumerate() {
                let at = (x as f32 + 0.5) * 0.5;
                let want = 3.0 * ((at - from) / 4.0).clamp(0.0, 1.0);
                assert!((v - want).abs() < 1e-4, "{side:?} at {at}: {v} {want}");
            }
        }
    }

    #[test]
    fn holds_in_any_window() {
        for side in [BevelSide::Inside, BevelSide::Outside, BevelSide::Both] {
            for (width, profile) in [(1e-9, Profile::Cove), (3.0, Profile::Smooth), (16.0, Profile::Round)] {
                let node = Bevel { mask: port(0), width, height: -2.0, side, profile, ..Bevel::default() };
                check_field(&field(&node, &[lumps().into()]));
            }
        }
    }
}
