//! [`Path`]: lines and curves on the canvas.
//!
//! Curves are cut into straight pieces that lie within half a micrometre of them, and sorted into bins. See
//! [`kernel::nearest`](shibo_kernel::path::nearest). Cost of a tile: its pixels, and the pieces within `reach` of it.
use super::sources;
use crate::planes::plane;
use glam::DVec2;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::path::chain;
use shibo_kernel::path::nearest::{Beside, Nearest};
use shibo_kernel::path::pen::{self, MOST_PIECES, Pen};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Field, Halo, Segments, Stop, Tiling, Type};
use std::sync::Arc;

/// Maximum number of copies of a path.
const MOST_COPIES: u32 = 10_000;

/// Maximum length of a straight piece on a canvas that tiles, in canvas sides.
const MOST_CANVASES: f64 = 64.0;

/// Lines and curves on the canvas, in mm, from places, SVG path data, outlines or segments; with fields of the position
/// along and across them.
///
/// Give exactly one of `points`, `d`, `outline` and `segments`. On a canvas that tiles, a path repeats with it, and a
/// path that ends whole canvases away from its start continues round the canvas without an end. Fields are known within
/// `reach`. Beyond it, `along` and `ids` are 0, `distance` is `reach`, `across` is `reach` or `-reach` by the side of
/// the nearest curve, and `tangent` is `(0, 0)`.
///
/// ```ron
/// "curve": Path(points: [(0, 20), (10, 14), (20, 20), (30, 26), (40, 20)], smooth: true, reach: 9),
/// "rope": "= sqrt(max(0, 9 - curve.across * curve.across)) + 0.5 * abs(sin(45 * (curve.along + curve.across)))",
/// "cut": "= rope * step(curve.distance, 3)",
/// "example": Relief(height: "cut", strength: 0.6),
/// ```
///
/// Elsewhere: Substance Designer *Path*, *Path to Signed Distance*; Blender *Curve to Mesh*; Houdini *Curve*.
#[node]
pub struct Path {
    /// Places `(x, y)`, from the canvas' upper left corner, through which the path passes.
    #[schemars(extend("unit" = "mm"))]
    pub points: Vec<(f64, f64)>,
    /// True for a smooth curve through `points`, false for straight lines.
    pub smooth: bool,
    /// SVG path data, with 1 mm as the unit: `M 0 5 C 10 5 10 15 20 15`.
    pub d: String,
    /// Another path, such as the outlines of an `Svg`.
    pub outline: Option<In<value::Path>>,
    /// Segments. Two segments that meet are always joined; of more, those that continue nearly straight.
    pub segments: Option<In<Segments>>,
    /// True to close curves: each ends where it starts.
    pub closed: bool,
    /// Factor on all positions.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(1.0)]
    pub scale: f64,
    /// Shift of the path, applied after `scale`.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub offset: Xy,
    /// Number of times that the path is drawn.
    #[schemars(range(min = 1, max = 10000))]
    #[default(1)]
    pub copies: u32,
    /// Shift from one copy to the next.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub step: Xy,
    /// Largest distance from the path at which its fields are known.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(5.0)]
    pub reach: f64,
}

impl Path {
    /// The names of the parameters that give a path.
    fn given(&self) -> Vec<&'static str> {
        let all = [
            ("points", !self.points.is_empty()),
            ("d", !self.d.trim().is_empty()),
            ("outline", self.outline.is_some()),
            ("segments", self.segments.is_some()),
        ];
        all.iter().filter(|(_, given)| *given).map(|(name, _)| *name).collect()
    }

    fn place(&self, p: DVec2) -> DVec2 {
        p * self.scale + DVec2::new(self.offset.x, self.offset.y)
    }

    /// Draws the path of `points` and `d`.
    fn draw(&self, (size, tiling): (DVec2, Tiling), pen: &mut Pen) -> Result<(), Problem> {
        let mut points: Vec<DVec2> = self.points.iter().map(|&(x, y)| self.place(DVec2::new(x, y))).collect();
        let around = points.first().zip(points.last()).and_then(|(a, b)| pen::around(*a, *b, size, tiling));
        if points.len() > 1 && self.smooth {
            // A path that ends where it starts is closed, and its last point is dropped.
            let closed = self.closed || around == Some(DVec2::ZERO);
            if around == Some(DVec2::ZERO) {
                points.pop();
            }
            pen.through(&points, closed, around.filter(|shift| *shift != DVec2::ZERO));
        } else if let Some((first, rest)) = points.split_first() {
            pen.move_to(*first);
            rest.iter().for_each(|p| pen.line_to(*p));
            if self.closed {
                pen.close();
            }
        }
        let mut data = Pen::default();
        sources::draw_data(&self.d, self.scale, DVec2::new(self.offset.x, self.offset.y), &mut data)?;
        if !self.d.trim().is_empty() {
            sources::draw_path(&data.finish(size, tiling), self.closed, 1.0, DVec2::ZERO, pen);
        }
        Ok(())
    }

    fn path(&self, cx: &Context<'_>) -> Result<value::Path, Stop> {
        let (canvas, offset) = ((cx.size_mm(), cx.tiling()), DVec2::new(self.offset.x, self.offset.y));
        let mut pen = Pen::default();
        self.draw(canvas, &mut pen)?;
        if let Some(outline) = cx.get_opt(&self.outline)? {
            sources::draw_path(&outline, self.closed, self.scale, offset, &mut pen);
        }
        if let Some(segments) = cx.get_opt(&self.segments)? {
            let mut lines = Pen::default();
            chain::draw(&segments, &mut lines);
            let lines = lines.finish(segments.size_mm, segments.periodic);
            sources::draw_path(&lines, self.closed, self.scale, offset, &mut pen);
        }
        if pen.pieces() * self.copies as usize > MOST_PIECES {
            return Err(sources::too_many("copies").into());
        }
        let path = pen.finish(canvas.0, canvas.1);
        let path = sources::repeated(path, self.copies, DVec2::new(self.step.x, self.step.y));
        let longest = path.pieces().map(|[a, b]| ((b - a).abs() / canvas.0).max_element()).fold(0.0, f64::max);
        if canvas.1 != Tiling::NONE && longest > MOST_CANVASES {
            let message = format!(
                "the path has a straight piece {longest:.0} canvases long; where the canvas tiles, at most {MOST_CANVASES} are allowed"
            );
            return Err(Problem::new(Code::OutOfRange, message).help("are all positions in mm?").into());
        }
        Ok(path)
    }
}

impl Node for Path {
    const OUTPUTS: &'static [Output] = &[
        Output::new("path", Type::Path, "The path."),
        Output::new(
            "along",
            Type::Gray,
            "How far along its curve from the beginning; beyond an open end it goes on, below 0 at the beginning.",
        )
        .in_unit("mm"),
        Output::new(
            "across",
            Type::Gray,
            "Distance to the side, at most `reach`: above 0 on the right as one goes along it, below 0 on the left.",
        )
        .in_unit("mm"),
        Output::new("distance", Type::Gray, "Distance from the path, at most `reach`.").in_unit("mm"),
        Output::new("tangent", Type::Vec2, "Which way the path goes, of length 1."),
        Output::new("ids", Type::Ids, "The number of the nearest curve, from 1; 0 beyond `reach`."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    // Version 2: the side is known beyond `reach`, too.
    const VERSION: u32 = 2;

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let given = self.given();
        if given.is_empty() {
            let message = "there is no path; give `points: [(x, y), …]`, `d: \"M …\"`, `outline` or `segments`";
            return vec![Problem::new(Code::MissingInput, message)];
        }
        if let [first, second, ..] = given[..] {
            let message = format!("both {first} and {second} are given; a path is made from one of them");
            return vec![Problem::new(Code::BadValue, message).at(second).help("write a `Path` for each")];
        }
        let mut problems = Vec::new();
        if self.points.len() == 1 {
            let message = "points has one place; a path needs at least two";
            problems.push(Problem::new(Code::BadValue, message).at("points"));
        }
        if self.points.len() > MOST_PIECES / 64 {
            let message = format!("points has {} places; at most {} are allowed", self.points.len(), MOST_PIECES / 64);
            problems.push(Problem::new(Code::TooLarge, message).at("points"));
        }
        if let Some((x, y)) = self.points.iter().find(|(x, y)| !(x.abs() <= 1e6 && y.abs() <= 1e6)) {
            let message = format!("points has the place `({x}, {y})`; coordinates must be within ±1000000 mm");
            problems.push(Problem::new(Code::OutOfRange, message).at("points"));
        }
        let most = 4.0 * canvas.size_mm().max_element();
        if canvas.tile() != Tiling::NONE && self.reach > most {
            let message = format!("reach is `{}` mm; on a canvas that tiles it must be at most {most} mm", self.reach);
            problems.push(Problem::new(Code::OutOfRange, message).at("reach").help("that is four times the canvas"));
        }
        if self.copies > MOST_COPIES {
            problems.push(sources::too_many("copies"));
        }
        if problems.is_empty() {
            problems.extend(self.draw((canvas.size_mm(), canvas.tile()), &mut Pen::default()).err());
        }
        problems
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let path = Arc::new(self.path(cx)?);
        let (nearest, reach, tiling) = (Arc::new(Nearest::new(&path)), self.reach, cx.tiling());
        let field = |ty: Type, put: fn(Option<&Beside>, f64) -> [f64; 4]| {
            let nearest = nearest.clone();
            Field::generate(ty, tiling, move |out, given| {
                let (frame, stop) = (tile::frame(out), || given.check().is_err());
                let mut planes = out.planes_mut();
                nearest.fill(&stop, &frame, reach, &mut |k, beside| {
                    planes.iter_mut().zip(put(beside, reach)).for_each(|(plane, value)| plane[k] = narrow(value));
                });
                given.check()
            })
        };
        // Four numbers in one field, so that the nearest curve is searched only once.
        let beside = field(Type::Jacobian, |beside, reach| match beside {
            Some(b) => [b.along, b.across, b.distance, f64::from(b.curve % 0x00FF_FFFF + 1)],
            None => [0.0, reach, reach, 0.0],
        });
        let beside = cx.shared_field("beside", beside);
        let tangent = field(Type::Vec2, |beside, _| beside.map_or([0.0; 4], |b| [b.tangent.x, b.tangent.y, 0.0, 0.0]));
        let plane = |ty: Type, number: usize| plane(&beside, ty, number);
        Ok(Outputs::one(path)
            .with("along", plane(Type::Gray, 0))
            .with("across", across(&beside, nearest.clone(), reach))
            .with("distance", plane(Type::Gray, 2))
            .with("tangent", tangent)
            .with("ids", plane(Type::Ids, 3)))
    }
}

/// The signed distances across: from the shared field within `reach`, beyond it `reach` with the sign of the side.
fn across(all: &Field, nearest: Arc<Nearest>, reach: f64) -> Field {
    Field::map(Type::Gray, [all.clone()], Halo::NONE, move |out, [all]| {
        let ids = all.plane(3);
        if ids.contains(&0.0) {
            let frame = tile::frame(out);
            let farthest = nearest.farthest(&frame) * (1.0 + 1e-9);
            let sides = out.plane_mut(0);
            nearest.fill(&|| false, &frame, farthest, &mut |k, beside| {
                let side = beside.map_or(1.0, |beside| beside.across);
                sides[k] = narrow(reach.copysign(side));
            });
        }
        for ((out, across), id) in out.plane_mut(0).iter_mut().zip(all.plane(1)).zip(ids) {
            *out = if *id == 0.0 { *out } else { *across };
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{field, part};
    use crate::testing::{OnCanvas as _, canvas, check_field, outputs, port};
    use shibo_value::{Canvas, Value};

    const FIELDS: [&str; 5] = ["along", "across", "distance", "tangent", "ids"];

    fn line(points: &[(f64, f64)]) -> Path {
        Path { points: points.to_vec(), ..Path::default() }
    }

    fn curves(node: &Path, inputs: &[Value]) -> Vec<(usize, bool, f64)> {
        let outputs = outputs(node, inputs, &canvas()).unwrap();
        let Some(Value::Path(path)) = outputs.take("path", true).cloned() else { panic!("no path") };
        path.curves.iter().map(|c| (c.points.len(), c.closed, (c.length() * 1e3).round() / 1e3)).collect()
    }

    #[test]
    fn fields_conform() {
        let wave = Path {
            smooth: true,
            reach: 6.0,
            copies: 2,
            step: Xy::new(3.0, 13.0),
            ..line(&[(-7.0, 5.0), (9.0, 15.0), (25.0, 5.0)])
        };
        let star = Path { d: "M 2 2 L 30 8 A 9 5 20 0 1 12 30 Q 3 20 28 25 Z m 4 4 h 3".into(), ..Path::default() };
        for node in [wave.clone(), star, Path { reach: 50.0, ..wave }] {
            for name in FIELDS {
                let field = field(&node, &[], name);
                assert_eq!(field.tiling(), Tiling::BOTH);
                // Where two places of the path are equally near, rounding decides, so only the distance is compared.
                if name == "distance" {
                    check_field(&field);
                }
                let whole = part(&field, &canvas(), -65, -7, 197, 75);
                assert!(whole.data().iter().all(|v| v.is_finite()));
                for (x, y, width, height) in [(-65, -7, 1, 1), (-3, 5, 37, 11), (61, -1, 71, 3)] {
                    let mut crop = part(&field, &canvas(), x, y, width, height);
                    let small = crop.clone();
                    crop.copy_from(&whole, 0, 0);
                    assert_eq!(small.data(), crop.data(), "{name} at {x}, {y}");
                }
            }
        }
    }

    #[test]
    fn sides_are_known_beyond_the_reach() {
        let node = Path { reach: 3.0, ..line(&[(-40.0, 10.0), (72.0, 10.0)]) };
        let canvas = Canvas { tile: Tiling::NONE, ..canvas() };
        let outputs = outputs(&node, &[], &canvas).unwrap();
        let Some(Value::Field(across)) = outputs.take("across", false) else { panic!("no field") };
        let tile = part(across, &canvas, 0, 0, 64, 64);
        // With pixels of ½ mm, the first row lies 9¾ mm to the left, the last one 21¾ mm to the right.
        assert!(tile.row(0, 0).iter().all(|across| *across == -3.0), "{:?}", tile.row(0, 0));
        assert!(tile.row(0, 63).iter().all(|across| *across == 3.0), "{:?}", tile.row(0, 63));
        assert_eq!((tile.row(0, 18)[20], tile.row(0, 22)[20]), (-0.75, 1.25));
    }

    #[test]
    fn measures_along_and_across_a_straight_line() {
        // A line from (4, 10) to (28, 10); pixels of ½ mm, the first at ¼ mm.
        let node = Path { reach: 3.0, ..line(&[(4.0, 10.0), (28.0, 10.0)]) };
        let at = |name: &str, x: usize, y: usize| {
            let tile = part(&field(&node, &[], name), &canvas(), 0, 0, 64, 64);
            (0..tile.channels()).map(|c| tile.row(c, y)[x]).collect::<Vec<_>>()
        };
        assert_eq!(
            (at("along", 20, 22), at("across", 20, 22), at("distance", 20, 22)),
            (vec![6.25], vec![1.25], vec![1.25])
        );
        assert_eq!(
            (at("across", 20, 18), at("tangent", 20, 18), at("ids", 20, 18)),
            (vec![-0.75], vec![1.0, 0.0], vec![1.0])
        );
        assert_eq!(at("along", 5, 20), [-1.25]);
        assert_eq!(
            (at("across", 20, 40), at("tangent", 20, 40), at("ids", 20, 40)),
            (vec![3.0], vec![0.0, 0.0], vec![0.0])
        );
    }

    #[test]
    fn makes_paths_from_all_sources() {
        let square = [(2.0, 2.0), (10.0, 2.0), (10.0, 10.0), (2.0, 10.0)];
        assert_eq!(curves(&line(&square), &[]), [(4, false, 24.0)]);
        assert_eq!(curves(&Path { closed: true, ..line(&square) }, &[]), [(5, true, 32.0)]);
        let data = Path { d: "M2 2H10V10H2Z".into(), scale: 0.5, ..Path::default() };
        assert_eq!(curves(&data, &[]), [(5, true, 16.0)]);
        // A circle of two arcs.
        let round = Path { d: "M 6 10 a 4 4 0 0 1 8 0 a 4 4 0 0 1 -8 0".into(), ..Path::default() };
        let circle = curves(&round, &[])[0];
        assert!(circle.1 && (circle.2 - 8.0 * std::f64::consts::PI).abs() < 0.01, "{circle:?}");
        // Round the canvas, twice.
        let around = Path { copies: 2, step: Xy::new(0.0, 8.0), ..line(&[(0.0, 3.0), (32.0, 35.0)]) };
        assert_eq!(curves(&around, &[]), [(2, true, 45.255), (2, true, 45.255)]);
        let outline: Value = outputs(&line(&square), &[], &canvas()).unwrap().take("path", true).cloned().unwrap();
        let copy = Path { outline: Some(port(0)), closed: true, offset: Xy::new(1.0, 0.0), ..Path::default() };
        assert_eq!(curves(&copy, &[outline]), [(5, true, 32.0)]);
    }

    #[test]
    fn refuses_invalid_paths() {
        let refused =
            |node: Path| node.check_on(&canvas()).first().map(|p| (p.code, p.field.clone().unwrap_or_default()));
        let base = line(&[(1.0, 1.0), (5.0, 5.0)]);
        assert_eq!(refused(base.clone()), None);
        assert_eq!(refused(Path::default()), Some((Code::MissingInput, String::new())));
        assert_eq!(refused(line(&[(1.0, 1.0)])), Some((Code::BadValue, "points".into())));
        assert_eq!(refused(line(&[(1.0, 1.0), (f64::NAN, 1.0)])), Some((Code::OutOfRange, "points".into())));
        assert_eq!(refused(Path { reach: 129.0, ..base.clone() }), Some((Code::OutOfRange, "reach".into())));
        assert_eq!(refused(Path { d: "M 1 1 L 2 2".into(), ..base }), Some((Code::BadValue, "d".into())));
        for (d, at) in [("M 1 1 L 2 x", 10), ("M 1 1 W 3", 6), ("5 5", 0)] {
            let node = Path { d: d.into(), ..Path::default() };
            let problem = node.check_on(&canvas()).remove(0);
            assert_eq!((problem.code, problem.within.map(|range| range.start)), (Code::BadValue, Some(at)), "{d}");
        }
        let far = line(&[(0.0, 0.0), (1e6, 0.0)]);
        assert!(crate::testing::outputs(&far, &[], &canvas()).is_err());
    }
}
