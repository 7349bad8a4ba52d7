//! [`Morphology`]: shapes grown and shrunk.
//!
//! Source: J. Serra, "Image analysis and mathematical morphology" (1982), with a flat disk: the pixels whose centres
//! lie within the radius; see [`kernel::morphology`](shibo_kernel::filter::morphology). Cost: O(pixels · radius in
//! pixels), about 4 ns a pixel for a radius of 8; `Open` and `Close` twice that.
use super::disk::of_disks;
use crate::bounds::at_most_half;
use shibo_kernel::filter::morphology::extreme;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Key, Stop};

/// Operation on bright shapes; dark shapes get the opposite one.
#[choice]
pub enum MorphologyOperation {
    /// They grow by the radius: each place gets the maximum within it
    #[default]
    Dilate,
    /// They shrink by the radius: each place gets the minimum within it
    Erode,
    /// They shrink and grow again: parts that are thinner than the disk vanish, the rest stays
    Open,
    /// They grow and shrink again: gaps that are thinner than the disk are filled
    Close,
}

/// Grows or shrinks bright shapes by a disk; in a height, its ridges.
///
/// Channels of a colour are filtered separately. A radius of less than a pixel changes nothing.
///
/// ```ron
/// "cells": Worley(size: 7),
/// "net": Threshold(input: "cells.border", level: 0.5, softness: 0.1),
/// "example": Morphology(input: "net", operation: Erode, radius: 0.8),
/// ```
///
/// Elsewhere: Material Maker *Dilate*, Blender *Dilate/Erode*, Houdini *Dilate/Erode*.
#[node]
pub struct Morphology {
    /// Field to change.
    pub input: In<AnyField>,
    /// Operation on bright shapes.
    #[default(MorphologyOperation::Dilate)]
    pub operation: MorphologyOperation,
    /// Radius of the disk; at most half the canvas' longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.3)]
    pub radius: f64,
}

fn pass(input: Field, radius: f64, erode: bool) -> Field {
    of_disks(input, radius, move |input, rect, disk, out| extreme(input, rect, disk, erode, out))
}

impl Node for Morphology {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input with changed shapes.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.radius == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let first = matches!(self.operation, MorphologyOperation::Erode | MorphologyOperation::Open);
        let once = pass(input, self.radius, first);
        if matches!(self.operation, MorphologyOperation::Dilate | MorphologyOperation::Erode) {
            return Ok(Outputs::one(once));
        }
        // A cache key of its own lets neighbouring tiles share tiles of the first pass.
        let once = match cx.evaluator.key() {
            Some(key) => once.keyed(Key::of("first pass", &[key.as_bytes()])).owned_by(key),
            None => once,
        };
        Ok(Outputs::one(pass(once, self.radius, !first)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, check_field, field, lumps, port, render};
    use MorphologyOperation as M;
    use glam::DVec2;
    use shibo_value::{Tiling, Type};

    fn node(operation: MorphologyOperation, radius: f64) -> Morphology {
        Morphology { input: port(0), operation, radius }
    }

    /// A disk of 5 mm in the middle of the canvas, and a hair of half a mm beside it.
    fn shapes() -> Field {
        Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width);
                let hair = window.x + k % width == 58;
                *v = if at.distance(DVec2::splat(16.0)) < 5.0 || hair { 1.0 } else { 0.0 };
            }
            Ok(())
        })
    }

    /// The radius of the disk in the result, from its area.
    fn radius(operation: MorphologyOperation) -> (f64, bool) {
        let out = render(&node(operation, 2.0), &[shapes().into()]);
        let area: f32 = (0..64).map(|y| out.row(0, y)[..52].iter().sum::<f32>()).sum();
        ((f64::from(area) * 0.25 / std::f64::consts::PI).sqrt(), out.row(0, 3)[58] > 0.5)
    }

    #[test]
    fn shapes_grow_and_shrink_by_the_radius() {
        for (operation, wanted, hair) in
            [(M::Dilate, 7.0, true), (M::Erode, 3.0, false), (M::Open, 5.0, false), (M::Close, 5.0, true)]
        {
            let (got, left) = radius(operation);
            assert!((got - wanted).abs() < 0.25 && left == hair, "{operation:?}: {got} {left}");
        }
    }

    #[test]
    fn holds_in_any_window() {
        for operation in [M::Dilate, M::Erode, M::Open, M::Close] {
            for radius in [0.0, 0.3, 2.5, 16.0] {
                check_field(&field(&node(operation, radius), &[lumps().into()]));
            }
            check_field(&field(&node(operation, 1.0), &[lumps().to_rgb().into()]));
        }
        assert!(!node(M::Dilate, 17.0).check_on(&canvas()).is_empty());
    }
}
