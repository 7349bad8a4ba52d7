//! [`MakeVector`]: a vector of two numbers, or of an angle and a length. Cost: O(pixels); with an angle about 5 ns
//! each.
use shibo_kernel::ground::math::{cos_degrees, sin_degrees};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// A vector everywhere, from two fields: its components, or its angle and its length.
///
/// Vectors are displacements for `Warp` and directions for `JacobianFromVectors`. y points down the picture.
///
/// ```ron
/// "cells": Worley(size: 9),
/// "push": Remap(input: "cells.value", to: (-4, 4)),
/// "vector": MakeVector(x: "push", y: 0),
/// "stripes": Gradient(times: 16, repeat: Mirror),
/// "example": Warp(input: "stripes", by: "vector"),
/// ```
///
/// Elsewhere: Blender *Combine XYZ*, Houdini *Float to Vector*.
#[node]
pub struct MakeVector {
    /// The first component, to the right; in mm if the vector is a displacement.
    #[default(In::constant(0.0))]
    pub x: In<Gray>,
    /// The second component, down.
    #[default(In::constant(0.0))]
    pub y: In<Gray>,
    /// Instead of `x` and `y`: the direction in degrees, from +x towards +y.
    pub angle: Option<In<Gray>>,
    /// With `angle`: length of the vectors.
    pub length: Option<In<Gray>>,
}

impl Node for MakeVector {
    const OUTPUTS: &'static [Output] = &[Output::new("vector", Type::Vec2, "The vector, (x, y).")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let given = self.x.slot().is_some() || self.y.slot().is_some();
        let problem = |message, at, help: &str| vec![Problem::new(Code::BadValue, message).at(at).help(help)];
        match (&self.angle, &self.length) {
            (Some(_), _) if given => problem(
                "`angle` is given, and so is `x` or `y`; only one sort of vector can be",
                "angle",
                "remove `angle`, or `x` and `y`",
            ),
            (None, Some(_)) => problem(
                "`length` is given, but `angle` is not",
                "length",
                "say `angle`, or give the vector by `x` and `y`",
            ),
            _ => Vec::new(),
        }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (angle, length) = (cx.get_opt(&self.angle)?, cx.get_opt(&self.length)?);
        let Some(angle) = angle else {
            let fields = [cx.get(&self.x)?, cx.get(&self.y)?];
            return Ok(Outputs::one(Field::map(
                Type::Vec2,
                fields,
                Halo::NONE,
                |out: &mut Tile, [x, y]: [&Tile; 2]| {
                    out.plane_mut(0).copy_from_slice(x.plane(0));
                    out.plane_mut(1).copy_from_slice(y.plane(0));
                    Ok(())
                },
            )));
        };
        let length = length.unwrap_or_else(|| Field::constant(Type::Gray, &[1.0]));
        let turn = |out: &mut Tile, [angle, length]: [&Tile; 2]| {
            for (k, part) in [cos_degrees, sin_degrees].into_iter().enumerate() {
                let planes = angle.plane(0).iter().zip(length.plane(0));
                out.plane_mut(k).iter_mut().zip(planes).for_each(|(out, (angle, length))| *out = length * part(*angle));
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Vec2, [angle, length], Halo::NONE, turn)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, gray};
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, lumps, port, raster, render};

    #[test]
    fn makes_vectors_from_components_or_angle() {
        let node = MakeVector { x: port(0), y: port(1), ..MakeVector::default() };
        let inputs = [gray().into(), lumps().into()];
        conforms(&node, &inputs);
        let out = render(&node, &inputs);
        assert_eq!((out.channels(), out.plane(0)), (2, raster(&gray(), &canvas()).data()));
        let polar = MakeVector { angle: Some(port(0)), length: Some(port(1)), ..MakeVector::default() };
        let number = |v: f32| Field::constant(Type::Gray, &[v]).into();
        let out = render(&polar, &[number(150.0), number(2.0)]);
        assert!((out.plane(0)[3] + 3f32.sqrt()).abs() < 1e-6 && (out.plane(1)[3] - 1.0).abs() < 1e-6);
        conforms(&MakeVector { length: None, ..polar }, &[gray().into()]);
    }

    #[test]
    fn refuses_contradictory_parameters() {
        let both = MakeVector { x: port(0), angle: Some(port(1)), ..MakeVector::default() };
        let half = MakeVector { length: Some(port(0)), ..MakeVector::default() };
        let at = |node: &MakeVector| node.check_on(&canvas())[0].field.clone();
        assert_eq!((at(&both).as_deref(), at(&half).as_deref()), (Some("angle"), Some("length")));
    }
}
