//! [`OffsetPath`]: parallel curves.
//!
//! The curves are exact, up to half a micrometre at round joins; see [`kernel::offset`](shibo_kernel::path::offset).
//! Cost: O(pieces · pieces within the distance) for each copy.
use shibo_kernel::path::offset;
use shibo_kernel::path::pen::MOST_PIECES;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Stop, Tiling, Type};

/// Curves parallel to a path, at a distance in mm: a seam beside an edge, a double line, the rim of a patch.
///
/// The curves are the places at `distance` from the path, on its right as one goes along it. A negative distance is on
/// the left. The inside of an `Outline` lies on its right. Where the path turns away, the curve goes around the corner
/// as an arc. Places that lie nearer than `distance` to any curve of the path are left out, so a curve may be cut in two
/// or vanish. The parallel of a closed curve is closed, and that of an open one ends beside its ends. Where the canvas
/// tiles, curves go on at the other side.
///
/// ```ron
/// "star": Path(d: "M 20 5 L 24.5 15 L 35 16 L 27 23.5 L 29.5 34 L 20 28 L 10.5 34 L 13 23.5 L 5 16 L 15.5 15 Z", reach: 3),
/// "seam": OffsetPath(path: "star", distance: 1.7),
/// "sewn": Stitch(path: "seam", pitch: 2.4, width: 0.8, pull: 0.2),
/// "rims": OffsetPath(path: "star", distance: -1.2, copies: 3),
/// "rim": Path(outline: "rims", reach: 0.6),
/// "patch": "= smoothstep(-0.4, 0.4, star.across) - sewn.pull + 0.5 * smoothstep(0.5, 0.2, rim.distance)",
/// "height": Blend(base: "patch", top: "= patch + sewn", mask: "sewn.mask"),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Inkscape *Path Offset*; Illustrator *Offset Path*; Houdini *PolyExpand2D*; Blender *Offset Curve*.
#[node]
pub struct OffsetPath {
    /// The path.
    pub path: In<value::Path>,
    /// Distance from the path to the first curve: positive to the right of the path, negative to its left.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(1.0)]
    pub distance: f64,
    /// Number of curves, each farther away by `distance` than the one before.
    #[schemars(range(min = 1, max = 1000))]
    #[default(1)]
    pub copies: u32,
    /// Length of the shortest curve that is kept.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "mm"))]
    pub shortest: f64,
    /// True for curves on both sides of the path: those on the right come first.
    pub both: bool,
}

impl Node for OffsetPath {
    const OUTPUTS: &'static [Output] = &[Output::new("path", Type::Path, "The parallel curves.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (most, farthest) = (canvas.size_mm().max_element(), self.distance.abs() * f64::from(self.copies));
        if farthest <= most {
            return Vec::new();
        }
        let (field, help) = match self.copies {
            1 => ("distance", "make the distance smaller"),
            _ => ("copies", "make `distance` or `copies` smaller"),
        };
        let message = format!(
            "the farthest curve would be {farthest} mm away; at most {most} mm, the canvas' longer side, is allowed"
        );
        vec![Problem::new(Code::OutOfRange, message).at(field).help(help)]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let path = cx.get(&self.path)?;
        let sides: &[f64] = if self.both && self.distance != 0.0 { &[1.0, -1.0] } else { &[1.0] };
        let mut made = value::Path { curves: Vec::new(), ..(*path).clone() };
        for side in sides {
            for copy in 1..=self.copies {
                let distance = side * self.distance * f64::from(copy);
                let curves = offset::offset(&path, distance, &|| cx.check().is_err()).ok_or(Stop::Cancelled)?.curves;
                made.curves.extend(curves);
                if made.len() > MOST_PIECES {
                    let message = format!("the curves have more than {MOST_PIECES} straight pieces");
                    let problem = Problem::new(Code::TooLarge, message).at("copies");
                    return Err(problem.help("make `copies` smaller, or the path simpler").into());
                }
            }
        }
        made.curves.retain(|curve| curve.length() >= self.shortest);
        if made.is_empty() && !path.is_empty() {
            let message = "no curve is left: places at this distance lie nearer to another part of the path";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("distance").help("make the distance smaller"));
        }
        Ok(Outputs::one(made))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paths::Path;
    use crate::testing::{OnCanvas as _, canvas, outputs, port};
    use shibo_value::Value;

    fn lengths(node: &OffsetPath) -> Vec<f64> {
        let square = Path { d: "M 10 10 H 20 V 20 H 10 Z".into(), ..Path::default() };
        let square = outputs(&square, &[], &canvas()).unwrap().take("path", true).cloned().unwrap();
        let Some(Value::Path(path)) = outputs(node, &[square], &canvas()).unwrap().take("path", true).cloned() else {
            panic!("no path")
        };
        path.curves.iter().map(|curve| (curve.length() * 10.0).round() / 10.0).collect()
    }

    fn node() -> OffsetPath {
        OffsetPath { path: port(0), ..OffsetPath::default() }
    }

    #[test]
    fn copies_and_sides_are_in_order() {
        assert_eq!(lengths(&OffsetPath { copies: 3, ..node() }), [32.0, 24.0, 16.0]);
        assert_eq!(lengths(&OffsetPath { distance: 2.0, both: true, ..node() }), [24.0, 52.6]);
        assert_eq!(lengths(&OffsetPath { distance: 0.0, both: true, ..node() }), [40.0]);
        assert_eq!(lengths(&OffsetPath { copies: 3, shortest: 20.0, ..node() }), [32.0, 24.0]);
        assert!(lengths(&OffsetPath { distance: 6.0, ..node() }).is_empty());
    }

    #[test]
    fn refuses_offsets_larger_than_the_canvas() {
        let refused = |node: OffsetPath| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(OffsetPath { distance: -32.0, ..node() }), None);
        assert_eq!(refused(OffsetPath { distance: -33.0, ..node() }).as_deref(), Some("distance"));
        assert_eq!(refused(OffsetPath { copies: 33, ..node() }).as_deref(), Some("copies"));
    }
}
