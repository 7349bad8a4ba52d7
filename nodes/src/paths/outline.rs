//! [`Outline`]: the level lines of a field.
//!
//! The field is read once, on a grid in mm that does not depend on the resolution. Lines are joined by
//! [`kernel::contour`](shibo_kernel::path::contour) and smoothed by [`kernel::ease`](shibo_kernel::path::ease). Cost:
//! O(samples): 1024² samples take about 0.1 s, in addition to the field itself; `offset` adds about as much.
use glam::{DVec2, UVec2};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::window::Frame;
use shibo_kernel::path::contour::Mask;
use shibo_kernel::path::ease;
use shibo_kernel::path::nearest::Nearest;
use shibo_kernel::path::pen::MOST_PIECES;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Stop, Tiling, Type, Window};

/// Samples along the longer side of the canvas, without `pitch`.
const SAMPLES: f64 = 1024.0;

/// Maximum number of samples.
const MOST: f64 = 4_194_304.0;

/// Smoothing without `smooth`, in samples.
const SMOOTH: f64 = 2.0;

/// Maximum distance of the path from the smoothed curve, in samples.
const TOLERANCE: f64 = 0.02;

/// The outline of a shape of any kind: the lines on which a field has the value `threshold`, as a path.
///
/// Seams, piping, borders and inlays then follow any mask: a blob of noise, a letter, a crack, a colony. The shape lies
/// where the field is above `threshold`, on the right of the path, so `across` of a `Path` of the outline is above 0
/// inside the shape. Lines close; where the canvas tiles, they go on at the other side. Elsewhere they end at the edge
/// of the canvas. The path is the same at all resolutions of the picture if the field is.
///
/// ```ron
/// "noise": Fractal(basis: Simplex, size: 20, octaves: 1, seed: 2),
/// "outline": Outline(input: "noise", threshold: 0.5, smooth: 0.5, shortest: 12),
/// "edge": Path(outline: "outline", reach: 6),
/// "inside": Outline(input: "noise", threshold: 0.5, smooth: 0.5, shortest: 12, offset: -2),
/// "seam": Stitch(path: "inside", pitch: 3.4, width: 1, pull: 0.3),
/// "patch": "= 1.6 * smoothstep(-0.6, 0.8, edge.across) - seam.pull - 0.6 * seam.holes",
/// "height": Blend(base: "patch", top: "= patch + seam", mask: "seam.mask"),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Houdini *Trace*; Blender *Mesh to Curve* of a boundary; Substance Designer *Mask to Paths*; Inkscape
/// *Trace Bitmap*; contour lines, isolines.
#[node]
pub struct Outline {
    /// The field.
    pub input: In<Gray>,
    /// The value on the lines.
    #[schemars(range(min = -1e9, max = 1e9))]
    #[default(0.5)]
    pub threshold: f64,
    /// Length over which lines are smoothed. It rounds corners; by default two samples, 0 does not smooth.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    pub smooth: Option<f64>,
    /// Length of the shortest line that is kept.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "mm"))]
    #[default(1.0)]
    pub shortest: f64,
    /// Distance from the shape to the path: positive for a path outside of the shape, negative for one inside.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    pub offset: f64,
    /// Distance of the samples of the field; by default a 1024th of the longer side of the canvas.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub pitch: Option<f64>,
}

impl Outline {
    /// Columns and rows of samples.
    fn samples(&self, size: DVec2) -> DVec2 {
        let pitch = self.pitch.unwrap_or(size.max_element() / SAMPLES);
        (size / pitch).ceil().max(DVec2::splat(4.0))
    }

    /// The field with distances in place of its values: positive inside, in mm.
    fn distances(&self, cx: &Context<'_>, lines: &value::Path, (values, size): (&[f32], UVec2)) -> Result<Mask, Stop> {
        let pixel = cx.size_mm() / size.as_dvec2();
        let reach = self.offset.abs() + 3.0 * pixel.max_element();
        let side = |inside: bool| if inside { reach } else { -reach };
        let mut all: Vec<f32> = values.iter().map(|v| narrow(side(f64::from(*v) > self.threshold))).collect();
        let frame = Frame { window: Window::full(size), origin: [0.0; 2], step: pixel.to_array() };
        Nearest::new(lines).fill(&|| cx.check().is_err(), &frame, reach, &mut |k, beside| {
            if let Some(beside) = beside {
                all[k] = narrow(beside.distance).copysign(all[k]);
            }
        });
        cx.check()?;
        Ok(Mask::new(all, size, pixel, lines.periodic))
    }

    fn path(&self, cx: &Context<'_>) -> Result<value::Path, Stop> {
        let (size_mm, tiling) = (cx.size_mm(), cx.tiling());
        let empty = || value::Path { curves: Vec::new(), size_mm, periodic: tiling };
        let field = cx.get(&self.input)?;
        if field.as_constant().is_some() {
            return Ok(empty());
        }
        let size = self.samples(size_mm).as_uvec2();
        let tile = cx.evaluator.raster(&field, &cx.canvas.grid(size), Window::full(size))?;
        let values = tile.plane(0);
        if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
            let message = format!("input has the value `{bad}` somewhere; it must be finite everywhere");
            return Err(Problem::new(Code::NotFinite, message).at("input").into());
        }
        let (pixel, repeats) = (size_mm / size.as_dvec2(), field.tiling().and(tiling));
        let lines = |mask: &Mask, level: f64| -> Result<value::Path, Stop> {
            let path = mask.lines(level, &|| cx.check().is_err()).ok_or(Stop::Cancelled)?;
            if path.len() <= MOST_PIECES {
                return Ok(path);
            }
            let message = format!("the outline has {} straight pieces; at most {MOST_PIECES} are allowed", path.len());
            let problem = Problem::new(Code::TooLarge, message).at("input");
            Err(problem.help("blur the field, or make `pitch` larger").into())
        };
        let mut path = lines(&Mask::new(values.to_vec(), size, pixel, repeats), self.threshold)?;
        if self.offset != 0.0 && !path.is_empty() {
            path = lines(&self.distances(cx, &path, (values, size))?, -self.offset)?;
        }
        let pitch = pixel.max_element();
        let sigma = self.smooth.unwrap_or(SMOOTH * pitch);
        let path = ease::ease(&path, sigma, TOLERANCE * pitch, self.shortest);
        Ok(value::Path { periodic: tiling, ..path })
    }
}

impl Node for Outline {
    const OUTPUTS: &'static [Output] =
        &[Output::new("path", Type::Path, "The lines; higher values are on their right.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let size = canvas.size_mm();
        let mut problems = Vec::new();
        let samples = self.samples(size).element_product();
        if samples > MOST {
            let pitch = self.pitch.unwrap_or(0.0);
            let least = 1.001 * (size.element_product() / MOST).sqrt();
            let message = format!(
                "pitch is `{pitch}` mm; the field would be read at {samples:.0} places, and {MOST:.0} are allowed"
            );
            let problem = Problem::new(Code::TooLarge, message).at("pitch");
            problems.push(problem.help(format!("write `pitch: {least:.4}` or more, or make the canvas smaller")));
        }
        let most = size.max_element();
        for (field, value) in [("smooth", self.smooth.unwrap_or(0.0)), ("offset", self.offset)] {
            if value.abs() > most {
                let message = format!("{field} is `{value}` mm; it must be at most {most} mm, as large as the canvas");
                problems.push(Problem::new(Code::OutOfRange, message).at(field));
            }
        }
        problems
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(self.path(cx)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{OnCanvas as _, canvas, outputs, port};
    use shibo_value::{Canvas, Field, Value};
    use std::sync::Arc;

    /// 5 mm minus the distance from a point beside the corner of the canvas, where the disc repeats.
    fn disc() -> Value {
        Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
            let (grid, window) = (out.grid, out.window);
            let width = window.width.cast_signed();
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let p = grid.center(window.x + k % width, window.y + k / width) - DVec2::new(1.0, 31.5);
                *v = narrow(5.0 - (p - (p / 32.0).round() * 32.0).length());
            }
            Ok(())
        })
        .into()
    }

    fn node() -> Outline {
        Outline { input: port(0), threshold: 0.0, ..Outline::default() }
    }

    fn drawn(node: &Outline, canvas: &Canvas) -> Result<Arc<value::Path>, Stop> {
        match outputs(node, &[disc()], canvas)?.take("path", true) {
            Some(Value::Path(path)) => Ok(path.clone()),
            other => panic!("no path: {other:?}"),
        }
    }

    fn area(path: &value::Path) -> f64 {
        path.pieces().map(|[a, b]| 0.5 * a.perp_dot(b)).sum()
    }

    #[test]
    fn a_disc_keeps_its_size_at_any_resolution() {
        let first = drawn(&node(), &canvas()).unwrap();
        for n in [256, 2048] {
            let canvas = Canvas { resolution: UVec2::splat(n), ..canvas() };
            assert_eq!(drawn(&node(), &canvas).unwrap(), first);
        }
        for samples in [256.0, 1024.0, 2048.0] {
            for smooth in [None, Some(0.0), Some(0.5)] {
                let node = Outline { pitch: Some(32.0 / samples), smooth, ..node() };
                let path = drawn(&node, &canvas()).unwrap();
                let [curve] = &path.curves[..] else { panic!("{} curves", path.curves.len()) };
                let (length, area) = (curve.length() / 10.0, area(&path) / 25.0);
                let pi = std::f64::consts::PI;
                assert!(
                    (length / pi - 1.0).abs() < 0.01 && (area / pi - 1.0).abs() < 0.01,
                    "{samples}: {length} {area}"
                );
            }
        }
    }

    #[test]
    fn offsets_are_outside_and_inside() {
        for offset in [-2.0, 1.5, 6.0] {
            let path = drawn(&Outline { offset, ..node() }, &canvas()).unwrap();
            let radius = 5.0 + offset;
            let want = std::f64::consts::TAU * radius;
            let length: f64 = path.curves.iter().map(value::Polyline::length).sum();
            assert!((length / want - 1.0).abs() < 0.01, "{offset}: {length} instead of {want}");
        }
        assert!(drawn(&Outline { offset: -6.0, ..node() }, &canvas()).unwrap().is_empty());
    }

    #[test]
    fn short_lines_are_dropped_and_open_ones_end_at_the_border() {
        assert!(drawn(&Outline { shortest: 32.0, ..node() }, &canvas()).unwrap().is_empty());
        let flat = Canvas { tile: Tiling::NONE, ..canvas() };
        let path = drawn(&node(), &flat).unwrap();
        assert!(path.curves.len() > 1 && path.curves.iter().all(|curve| !curve.closed));
        let ends = path.curves.iter().flat_map(|c| [c.points[0], c.points[c.points.len() - 1]]);
        assert!(ends.into_iter().all(|p| ((p - 16.0).abs().max_element() - 16.0).abs() < 0.02));
    }

    #[test]
    fn refuses_invalid_outlines() {
        let refused = |node: Outline| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(node()), None);
        assert_eq!(refused(Outline { pitch: Some(1e-9), ..node() }).as_deref(), Some("pitch"));
        assert_eq!(refused(Outline { smooth: Some(33.0), ..node() }).as_deref(), Some("smooth"));
        assert_eq!(refused(Outline { offset: -33.0, ..node() }).as_deref(), Some("offset"));
        let constant: Value = Field::constant(Type::Gray, &[1.0]).into();
        let path = outputs(&node(), &[constant], &canvas()).unwrap();
        assert!(matches!(path.take("path", true), Some(Value::Path(path)) if path.is_empty()));
    }
}
