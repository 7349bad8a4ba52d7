//! [`TangentField`]: directions on a surface.
//!
//! Source: JP5149288B2 III, claim 11 (rows C20, C21): t and b at every point, both or only one of them drawn by the
//! user or found automatically. Method: the smoothest field that follows the given directions, after F. Knöppel et al.,
//! *Globally optimal direction fields* (2013), solved by conjugate gradients. Cost: O(vertices · rounds).
use crate::csv_points;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::mesh::field::{Fault, FieldSpec, Principal, Wish, tangent_field};
use shibo_kernel::mesh::topology::topology;
use shibo_node::{CanvasFacts, Context, Fact, FilePath, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Curve, Mesh, Stop, Type};

/// A point or direction in space.
type Triple = (f64, f64, f64);

/// Source of the directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FieldFrom {
    /// From `direction`, projected onto the surface; where it is normal to the surface, from the surroundings.
    Direction,
    /// Round the axis that has `direction` and passes through `axis`.
    Around,
    /// From strokes; as smooth as possible between them.
    Strokes,
    /// From the principal curvature of the surface, the largest or the smallest. Such directions have no sign, so
    /// `symmetry` is at least 2.
    Curvature(Principal),
    /// As smooth as possible, and otherwise at random.
    Smooth,
}

/// Directions on a mesh along which features lie: drawn, round an axis, or computed.
///
/// In synthesis the x axis of the exemplar follows the directions, and its y axis is perpendicular, never mirrored. On
/// a closed shape other than a ring every field has points without a direction, like the crown of a head; `shibo dump`
/// lists them as `singular`. Use strokes to move them to places where they do not disturb.
///
/// Elsewhere: Houdini *Attribute Paint* with *Comb*, *Surface Tangent Field*; Blender hair combing; nothing in
/// Substance.
///
/// ```ron
/// "ring": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ring"),
/// "flow": TangentField(mesh: "ring", from: Around, turn: 30),
/// "example": JacobianFromMesh(atlas: "atlas", frames: "flow"),
/// ```
#[node]
pub struct TangentField {
    /// The mesh.
    pub mesh: In<Mesh>,
    /// An additional stroke.
    pub line: Option<In<Curve>>,
    /// Source of the directions. By default strokes if there are any, otherwise `direction`.
    pub from: Option<FieldFrom>,
    /// A direction in space, z up; for `Around` the direction of the axis.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6))]
    #[default((0.0, 0.0, 1.0))]
    pub direction: Triple,
    /// With `Around`: a point on the axis.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub axis: Triple,
    /// Lines on the surface, each of at least two points. At most 10000 points.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub strokes: Vec<Vec<Triple>>,
    /// A CSV file with an additional stroke, one `x,y,z` in mm per line, no header.
    pub file: Option<FilePath>,
    /// Length over which directions are smoothed. With 0 it is chosen automatically: strokes reach everywhere, and
    /// other directions are smoothed over two edges of the mesh. With strokes, `direction` is used beyond this length.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub smooth: f64,
    /// Number of equivalent directions at a point, evenly spaced around it: 1, 2 or 4. Synthesis needs 1.
    #[schemars(range(min = 1, max = 4))]
    #[default(1)]
    pub symmetry: u8,
    /// Rotation of all directions in the surface, clockwise seen from outside.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub turn: f64,
    /// Size of the features, for `JacobianFromMesh` and synthesis.
    #[schemars(range(min = 0.015625, max = 64))]
    #[default(1.0)]
    pub length: f64,
    /// Another seed gives another field of `Smooth`.
    pub seed: u64,
}

/// Maximum number of points of all strokes.
const MOST: usize = 10_000;

fn vector((x, y, z): Triple) -> DVec3 {
    DVec3::new(x, y, z)
}

impl TangentField {
    fn drawn(&self) -> bool {
        !self.strokes.is_empty() || self.file.is_some() || self.line.is_some()
    }

    fn source(&self) -> FieldFrom {
        self.from.unwrap_or(if self.drawn() { FieldFrom::Strokes } else { FieldFrom::Direction })
    }

    fn wish(&self, cx: &Context<'_>) -> Result<Wish, Stop> {
        let direction = vector(self.direction);
        Ok(match self.source() {
            FieldFrom::Direction => Wish::Direction(direction),
            FieldFrom::Around => Wish::Around(direction, vector(self.axis)),
            FieldFrom::Curvature(which) => Wish::Curvature(which),
            FieldFrom::Smooth => Wish::Smooth(Hash::new(cx.seed(self.seed))),
            FieldFrom::Strokes => {
                let written = self.strokes.iter().map(|stroke| stroke.iter().copied().map(vector).collect());
                let mut strokes: Vec<Vec<DVec3>> = written.collect();
                if let Some(path) = cx.file("file") {
                    let points = csv_points::read(path, ("file", "x,y,z"), MOST)?;
                    strokes.push(points.into_iter().map(DVec3::from_array).collect());
                }
                strokes.extend(cx.get_opt(&self.line)?.map(|line| line.points.clone()));
                if strokes.iter().map(Vec::len).sum::<usize>() > MOST {
                    let message = format!("the strokes have more than {MOST} points");
                    return Err(Problem::new(Code::TooLarge, message).at("strokes").into());
                }
                Wish::Strokes(strokes, direction)
            }
        })
    }

    /// The error for a stroke that lies off the surface.
    fn far(&self, stroke: usize, point: usize, far: f64, most: f64) -> Problem {
        let place = match self.strokes.len() {
            n if stroke < n => "strokes",
            n if stroke == n && self.file.is_some() => "file",
            _ => "line",
        };
        let message = format!(
            "point {point} of stroke {stroke} lies `{far:.1}` mm off the surface; up to {most:.1} mm are allowed"
        );
        Problem::new(Code::BadValue, message).at(place).help("give points in mm in the mesh's coordinates, z up")
    }
}

impl Node for TangentField {
    const FACTS: &'static [Fact] = &[Fact::Seed];
    const OUTPUTS: &'static [Output] = &[Output::new("frames", Type::Frames, "The directions.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        if self.symmetry == 3 {
            problems.push(Problem::new(Code::BadValue, "symmetry is `3`; it must be 1, 2 or 4").at("symmetry"));
        }
        if matches!(self.source(), FieldFrom::Direction | FieldFrom::Around) && vector(self.direction).length() < 1e-9 {
            let message = "direction is zero; it must point somewhere";
            problems.push(Problem::new(Code::BadValue, message).at("direction"));
        }
        if let Some(short) = self.strokes.iter().position(|stroke| stroke.len() < 2) {
            let message = format!("stroke {short} has fewer than two points");
            problems.push(Problem::new(Code::BadValue, message).at("strokes"));
        }
        if self.strokes.iter().map(Vec::len).sum::<usize>() > MOST {
            let message = format!("the strokes have more than {MOST} points");
            problems.push(Problem::new(Code::TooLarge, message).at("strokes"));
        }
        if self.from == Some(FieldFrom::Strokes) && !self.drawn() {
            let message = "there are no strokes; `from: Strokes` needs `strokes`, `file` or `line`";
            problems.push(Problem::new(Code::MissingInput, message).at("from"));
        }
        problems
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.file.iter().map(|file| ("file", file)).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mesh = cx.get(&self.mesh)?;
        if topology(&mesh.triangles).twisted > 0 {
            let message = "a piece of the mesh has no outside, as a Möbius strip: no directions go on all over it";
            let help = "take the mesh's other parts by `part` of LoadMesh, or cut the piece open";
            return Err(Problem::new(Code::BadFile, message).at("mesh").help(help).into());
        }
        let spec = FieldSpec {
            wish: self.wish(cx)?,
            smooth: self.smooth,
            symmetry: self.symmetry,
            turn: self.turn.to_radians(),
            length: self.length,
        };
        let frames = match tangent_field(&mesh, &spec, &|| cx.check().is_err()) {
            Ok(frames) => frames,
            Err(Fault::Far(stroke, point, far, most)) => return Err(self.far(stroke, point, far, most).into()),
            Err(Fault::Stopped) => {
                cx.check()?;
                return Err(Problem::new(Code::BadValue, "the field was not finished").into());
            }
        };
        cx.check()?;
        Ok(Outputs::one(frames))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshForm, MeshShape};
    use crate::testing::{OnCanvas as _, canvas, outputs, port};
    use shibo_value::{Frames, Value};
    use std::sync::Arc;

    fn frames(node: &TangentField) -> Result<Arc<Frames>, Stop> {
        let shape = MeshShape { shape: MeshForm::Torus, segments: 24, ..MeshShape::default() };
        let mesh = outputs(&shape, &[], &canvas()).unwrap().take("mesh", true).cloned().unwrap();
        let found = outputs(node, &[mesh], &canvas())?.take("frames", true).cloned();
        let Some(Value::Frames(frames)) = found else { panic!("no frames") };
        Ok(frames)
    }

    #[test]
    fn strokes_are_taken_if_there_are_any() {
        let plain = TangentField { mesh: port(0), ..TangentField::default() };
        assert_eq!((plain.source(), plain.symmetry), (FieldFrom::Direction, 1));
        let around = frames(&TangentField { from: Some(FieldFrom::Around), ..plain.clone() }).unwrap();
        assert!(around.singular.is_empty() && around.t.iter().all(|t| t.z.abs() < 1e-3));
        let [_, high] = around.mesh.bounds();
        let ring = high.x;
        let drawn = TangentField { strokes: vec![vec![(ring, -2.0, 0.0), (ring, 2.0, 0.0)]], ..plain.clone() };
        assert_eq!(drawn.source(), FieldFrom::Strokes);
        assert!(frames(&drawn).is_ok());
        let far = TangentField { strokes: vec![vec![(ring, -2.0, 0.0), (0.0, 0.0, 500.0)]], ..plain.clone() };
        let Err(Stop::Failed(problem)) = frames(&far) else { panic!("a stroke far off") };
        assert_eq!((problem.code, problem.field.as_deref()), (Code::BadValue, Some("strokes")));
        assert!(problem.message.contains("point 1 of stroke 0"), "{}", problem.message);
    }

    #[test]
    fn refuses_invalid_parameters() {
        let fields = |node: TangentField| -> Vec<String> {
            node.check_on(&canvas()).into_iter().filter_map(|problem| problem.field).collect()
        };
        let plain = TangentField { mesh: port(0), ..TangentField::default() };
        assert!(fields(plain.clone()).is_empty());
        assert_eq!(fields(TangentField { symmetry: 3, ..plain.clone() }), ["symmetry"]);
        assert_eq!(fields(TangentField { direction: (0.0, 0.0, 0.0), ..plain.clone() }), ["direction"]);
        assert_eq!(fields(TangentField { from: Some(FieldFrom::Strokes), ..plain.clone() }), ["from"]);
        assert_eq!(fields(TangentField { strokes: vec![vec![(0.0, 0.0, 0.0)]], ..plain }), ["strokes"]);
    }
}
