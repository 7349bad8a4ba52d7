//! [`FlowFromPaths`]: directions that follow paths.
//!
//! See [`kernel::flow`](shibo_kernel::path::flow). Cost of a tile: its pixels times the length of path within `reach`.
use shibo_kernel::ground::{math, tile};
use shibo_kernel::path::flow::{Flow, Flowing};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Field, Halo, Stop, Type};
use std::sync::Arc;

/// A field of directions that follows the nearest paths: along each path, and interpolated by distance between paths.
///
/// Use `flow` and `angle` as directions for `Fibers`, `TileSampler`, `Scratches` and `Streamlines`. Beyond `reach`
/// there is no direction: `flow` is `(0, 0)` and `angle` 0.
///
/// ```ron
/// "guides": Path(d: "M -2 8 C 12 -4 20 22 42 10 M -2 30 C 10 40 26 22 42 36"),
/// "flow": FlowFromPaths(path: "guides", reach: 24, lines: true),
/// "hair": Fibers(direction: "flow", density: 900, length: (4, 7), width: 0.4, thickness: (0.1, 0.5)),
/// "example": Relief(height: "hair"),
/// ```
///
/// Elsewhere: Houdini *Guide Groom*, *Attribute Transfer* from curves; Blender *Sample Nearest* on curves.
#[node]
pub struct FlowFromPaths {
    /// The paths to follow.
    pub path: In<value::Path>,
    /// Largest distance from a path at which it has an effect.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(10.0)]
    pub reach: f64,
    /// True if a path means the same in both directions, as for fibres and grain; if false, paths in opposite
    /// directions cancel out.
    pub lines: bool,
}

impl Node for FlowFromPaths {
    const OUTPUTS: &'static [Output] = &[
        Output::new("flow", Type::Vec2, "The direction, of length 1."),
        Output::new("angle", Type::Gray, "Its angle from +x towards +y; with `lines` from -90° to 90°.").in_unit("°"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let most = 4.0 * canvas.size_mm().max_element();
        if self.reach <= most {
            return Vec::new();
        }
        let message = format!("reach is `{}` mm; it must be at most {most} mm", self.reach);
        vec![Problem::new(Code::OutOfRange, message).at("reach").help("that is four times the canvas")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let path = cx.get(&self.path)?;
        let (flow, lines, tiling) = (Arc::new(Flow::new(&path, self.reach)), self.lines, path.periodic);
        let ways = Field::generate(Type::Vec2, tiling, move |out, given| {
            let (frame, stop) = (tile::frame(out), || given.check().is_err());
            let mut all = vec![Flowing::default(); out.window.len()];
            flow.fill(&stop, &frame, lines, &mut all);
            for (axis, plane) in out.planes_mut().into_iter().enumerate() {
                for (out, flowing) in plane.iter_mut().zip(&all) {
                    let length = (flowing.way[0] * flowing.way[0] + flowing.way[1] * flowing.way[1]).sqrt();
                    // If all directions cancel out, there is no direction.
                    let clear = length > 1e-5 * flowing.weight && length > 0.0;
                    *out = if clear { flowing.way[axis] / length } else { 0.0 };
                }
            }
            given.check()
        });
        let ways = cx.shared_field("ways", ways);
        let angle = Field::map(Type::Gray, [ways.clone()], Halo::NONE, |out, [ways]| {
            let ways = ways.plane(0).iter().zip(ways.plane(1));
            out.plane_mut(0).iter_mut().zip(ways).for_each(|(out, (x, y))| {
                *out = if *x == 0.0 && *y == 0.0 { 0.0 } else { math::atan2_degrees(*y, *x) };
            });
            Ok(())
        });
        Ok(Outputs::one(both(&ways)).with("angle", angle))
    }
}

/// Two of the planes as a field of their own.
fn both(all: &Field) -> Field {
    Field::map(Type::Vec2, [all.clone()], Halo::NONE, |out, [all]| {
        out.data_mut().copy_from_slice(all.data());
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::paths::Path;
    use crate::testing::{OnCanvas as _, canvas, outputs, port};
    use shibo_value::Value;

    fn path(d: &str) -> Value {
        outputs(&Path { d: d.into(), ..Path::default() }, &[], &canvas()).unwrap().take("path", true).cloned().unwrap()
    }

    #[test]
    fn flows_conform() {
        for lines in [true, false] {
            let node = FlowFromPaths { path: port(0), reach: 7.0, lines };
            conforms(&node, &[path("M -3 4 C 12 30 20 -5 29 36 M 5 5 L 9 30")]);
        }
        assert_eq!(FlowFromPaths { reach: 129.0, ..FlowFromPaths::default() }.check_on(&canvas()).len(), 1);
    }

    #[test]
    fn a_line_gives_its_angle() {
        let node = FlowFromPaths { path: port(0), reach: 6.0, lines: false };
        let angle = |d: &str, name: &str| {
            let tile = part(&field(&node, &[path(d)], name), &canvas(), 0, 0, 64, 64);
            (tile.row(0, 30)[20], tile.row(0, 62)[60])
        };
        let (near, far) = angle("M 5 20 L 15 10", "angle");
        assert!((near + 45.0).abs() < 0.1 && far == 0.0, "{near} {far}");
        let (near, _) = angle("M 15 10 L 5 20", "flow");
        assert!((near + 0.5f32.sqrt()).abs() < 1e-3, "{near}");
    }
}
