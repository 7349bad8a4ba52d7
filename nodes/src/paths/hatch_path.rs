//! [`HatchPath`]: parallel lines within closed curves. See [`kernel::hatch`](shibo_kernel::path::hatch). Cost:
//! O(pieces + lines).
use crate::degrees::sin_cos;
use glam::DVec2;
use shibo_kernel::path::hatch::{self, Hatch};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Stop, Tiling, Type};

/// Maximum number of lines, if each row has one.
const MOST_ROWS: f64 = 1e6;

/// Fills closed curves with parallel lines: the rows of embroidery, a hatching, grooves within a shape.
///
/// A place is inside if the curves wind around it, as in fonts: a hole runs the other way than the curve around it. Open
/// curves and those that go around the canvas enclose nothing. `Stitch` sews the lines: with a short pitch it makes a
/// tatami fill of rows, with a pitch longer than every line it makes satin, one stitch for each line. Where the canvas
/// tiles, the lines repeat with it.
///
/// ```ron
/// "leaf": Path(d: "M 4 30 C 4 8 22 2 36 6 C 36 22 26 36 4 30 Z M 26 10 C 20 9 15 14 16 20 C 22 21 27 16 26 10 Z"),
/// "rows": HatchPath(path: "leaf", pitch: 0.8, angle: 30),
/// "tatami": Stitch(path: "rows", pitch: 4, width: 0.8, twist: 1.2, pull: 0.1, spread: 0.8),
/// "color": Blend(base: "#2b3140", top: "= #5f9a4a * (0.5 + 0.5 * tatami.shade)", mask: "tatami.mask"),
/// "example": Relief(height: "tatami", base_color: "color"),
/// ```
///
/// Elsewhere: Ink/Stitch *Fill Stitch*, *Satin*; Inkscape *Hatches*.
#[node]
pub struct HatchPath {
    /// The closed curves.
    pub path: In<value::Path>,
    /// Distance between lines.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(1.0)]
    pub pitch: f64,
    /// Direction of the lines, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Length of the shortest line that is kept.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "mm"))]
    pub shortest: f64,
    /// True if every second line runs backwards, as one thread does.
    #[default(true)]
    pub turns: bool,
}

impl Node for HatchPath {
    const OUTPUTS: &'static [Output] = &[Output::new("path", Type::Path, "The lines, row by row.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let path = cx.get(&self.path)?;
        if hatch::closed(&path).next().is_none() {
            let problem = Problem::new(Code::Advice, "path has no closed curve: there is nothing to fill").at("path");
            cx.evaluator.warn(problem.help("close the curves, for example by `Path(…, closed: true)`"));
        }
        let (sin, cos) = sin_cos(self.angle);
        let Self { pitch, shortest, turns, .. } = *self;
        let hatch = Hatch { pitch, way: DVec2::new(cos, sin), shortest, turns };
        let rows = hatch.rows(&path);
        if rows > MOST_ROWS {
            let message = format!("pitch makes {rows:.0} rows of lines; at most {MOST_ROWS:.0} are allowed");
            return Err(Problem::new(Code::TooLarge, message).at("pitch").help("make the pitch larger").into());
        }
        Ok(Outputs::one(hatch.lines(&path, &|| cx.check().is_err()).ok_or(Stop::Cancelled)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paths::Path;
    use crate::testing::{canvas, outputs, port};
    use shibo_value::Value;

    #[test]
    fn lines_fill_a_square_and_open_curves_give_none() {
        let path = |d: &str| {
            let node = Path { d: d.into(), ..Path::default() };
            outputs(&node, &[], &canvas()).unwrap().take("path", true).cloned().unwrap()
        };
        let lines = |node: HatchPath, d: &str| match outputs(&node, &[path(d)], &canvas())
            .map(|o| o.take("path", true).cloned())
        {
            Ok(Some(Value::Path(path))) => Some(path.curves.iter().map(value::Polyline::length).sum::<f64>()),
            _ => None,
        };
        let node = || HatchPath { path: port(0), ..HatchPath::default() };
        let square = "M 10 10 H 20 V 20 H 10 Z";
        assert_eq!(lines(HatchPath { pitch: 0.5, ..node() }, square), Some(200.0));
        assert!((lines(HatchPath { angle: 45.0, ..node() }, square).unwrap() - 100.0).abs() < 3.0);
        assert_eq!(lines(node(), "M 10 10 H 20"), Some(0.0));
        assert_eq!(lines(HatchPath { pitch: 1e-7, ..node() }, square), None);
    }
}
