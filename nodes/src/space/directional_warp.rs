//! [`DirectionalWarp`]: a field pushed along a direction.
//!
//! A point p of the result shows the input at p − amount·value(p) in the direction, read by Catmull-Rom; so features
//! move the way the angle points. The halo of a tile is only as wide as its own displacements. Cost: O(pixels).
use crate::bounds::at_most_half;
use crate::warped::Warped;
use shibo_kernel::ground::math::{clamp, cos_degrees, sin_degrees};
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Direction, EveryField, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Pushes a field along a direction, by the amount that another field gives.
///
/// ```ron
/// "stripes": Gradient(times: 20, repeat: Mirror),
/// "cells": Worley(size: 8),
/// "push": Remap(input: "cells.border", from: (0, 3), clamp: true),
/// "example": DirectionalWarp(input: "stripes", by: "push", amount: 4, angle: 20),
/// ```
///
/// Elsewhere: Substance Designer *Directional Warp*, *Multi Directional Warp*; Blender *Displace*.
#[node]
pub struct DirectionalWarp {
    /// Field to push.
    pub input: In<EveryField>,
    /// Displacement: 0 is none, 1 moves by `amount`, −1 by `amount` the other way. Values are clamped to -1..1.
    #[schemars(extend("minimum" = -1.0, "maximum" = 1.0))]
    pub by: In<Gray>,
    /// The direction in which features move, in degrees, from +x towards +y: a number or a field; or vectors.
    #[default(In::constant(0.0))]
    pub angle: In<Direction>,
    /// Largest displacement; at most half the canvas' longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(1.0)]
    pub amount: f64,
}

impl Node for DirectionalWarp {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, pushed.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("amount", self.amount, canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.amount == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, by, angle) = (cx.get(&self.input)?, cx.get(&self.by)?, cx.get(&self.angle)?);
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let (limit, amount) = (self.amount, narrow(self.amount));
        let push = move |out: &mut Tile, [by, angle]: [&Tile; 2]| {
            for (k, part) in [cos_degrees, sin_degrees].into_iter().enumerate() {
                let planes = by.plane(0).iter().zip(angle.plane(0));
                let push = |(by, angle): (&f32, &f32)| -amount * clamp(*by, -1.0, 1.0) * part(*angle);
                out.plane_mut(k).iter_mut().zip(planes).for_each(|(out, pair)| *out = push(pair));
            }
            Ok(())
        };
        let by = Field::map(Type::Vec2, [by, angle], Halo::NONE, push);
        let (ty, tiling) = (input.ty(), input.tiling().and(by.tiling()));
        Ok(Outputs::one(Field::new(ty, tiling, Warped { input, by, limit })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, port, raster, render};

    fn node() -> DirectionalWarp {
        DirectionalWarp { input: port(0), by: port(1), amount: 4.0, ..DirectionalWarp::default() }
    }

    #[test]
    fn features_move_where_the_angle_points() {
        let number = |v: f32| Field::constant(Type::Gray, &[v]).into();
        let input = raster(&lumps(), &canvas());
        let right = render(&node(), &[lumps().into(), number(0.5)]);
        // 2 mm are four pixels.
        assert_eq!(right.row(0, 7)[4..], input.row(0, 7)[..60]);
        let down = DirectionalWarp { angle: port(2), ..node() };
        let down = render(&down, &[lumps().into(), number(9.0), number(90.0)]);
        assert_eq!(down.row(0, 28), input.row(0, 20));
    }

    #[test]
    fn holds_in_any_window() {
        for amount in [0.0, 1e-9, 16.0] {
            let node = DirectionalWarp { amount, angle: port(1), ..node() };
            check_field(&field(&node, &[lumps().to_rgb().into(), lumps().into()]));
        }
    }
}
