//! [`CutSurface`]: cuts a solid along a curved surface.
//!
//! Source: Momoi & Takatera 2014, §4.1, §4.2 (rows B25, B27, B29): a parametric surface (u, v), read from a file or
//! given, sampled evenly in u and v. Cost: that of the solid plus about 30 ns a pixel.
use super::trees::{Triple, vector};
use crate::csv_points::FARTHEST;
use crate::shown::{shown_by, shown_channels};
use glam::{DVec2, DVec3};
use shibo_kernel::wood::surface;
use shibo_node::{
    CanvasFacts, Context, Fact, FilePath, In, InSpace, MaterialInputs, Node, Output, Outputs, choice, node,
};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{ChannelSet, Cut, Field, Key, Stop, Tile, Tiling, Type};
use std::io::ErrorKind;
use std::sync::Arc;

/// A surface to cut along.
#[choice]
pub enum SurfaceShape {
    /// A cylinder around the z axis: u runs around it, v along it.
    #[default]
    Cylinder,
    /// A bowl, half of a sphere: u runs around its axis, v from the rim to the middle.
    Bowl,
    /// A bicubic Bézier patch with the 16 points of `controls`.
    Bezier,
    /// A grid of points from `file`, smooth between them.
    Points,
}

/// Cuts a solid, or a material of solids, along a curved surface; the canvas shows it unrolled, u to the right and v down, 0 to 1.
///
/// To move or turn the surface in the tree, place the solid by `PlaceInTree` first.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "placed": PlaceInTree(solid: "wood", position: (0, 30, 0), turn: (90, 0, 0)),
/// "example": CutSurface(solid: "placed", shape: Cylinder, radius: 12, length: 40),
/// ```
///
/// Elsewhere: Blender *Texture Coordinate* (Object); Houdini *Attribute from Volume*.
#[node]
pub struct CutSurface {
    /// Solid, or material of solids, to cut.
    pub solid: In<InSpace>,
    /// The surface.
    #[default(SurfaceShape::Cylinder)]
    pub shape: SurfaceShape,
    /// For a cylinder or a bowl: its radius.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(20.0)]
    pub radius: f64,
    /// For a cylinder: its length; the height of the canvas if not given.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub length: Option<f64>,
    /// For a cylinder or a bowl: the angle that it covers around the axis.
    #[schemars(range(min = 0.1, max = 360), extend("unit" = "°"))]
    #[default(360.0)]
    pub arc: f64,
    /// For `Bezier`: 16 control points by rows, u first.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub controls: Vec<Triple>,
    /// For `Points`: a CSV file with one `x,y,z` in mm per line and an empty line between rows. All rows have the same
    /// number of points, at least 2; at most 4 million points in total.
    pub file: Option<FilePath>,
}

type Surface = Arc<dyn Fn(f64, f64) -> DVec3 + Send + Sync>;

const MOST: usize = 4_000_000;

/// A grid of points from a file: the points, and the number of points in a row.
fn read_grid(file: &FileHandle) -> Result<(Vec<DVec3>, usize), Problem> {
    let bad = |line: usize, what: &str| {
        let place = if line > 0 { format!(", line {line}") } else { String::new() };
        let help = "write one `x,y,z` in mm a line and an empty line between rows of equally many points";
        Problem::new(Code::BadFile, format!("`{}`{place}: {what}", file.display())).at("file").help(help)
    };
    let bytes = file.bytes(256 << 20).map_err(|error| match error.kind() {
        ErrorKind::FileTooLarge => bad(0, "it has more than 256 MiB"),
        _ => bad(0, &error.to_string()),
    })?;
    let text = String::from_utf8(bytes).map_err(|e| bad(0, &format!("it is not readable text: {e}")))?;
    let (mut points, mut row, mut columns) = (Vec::new(), 0, None);
    let mut end = |row: &mut usize, line: usize| {
        if *row == 0 {
            return Ok(());
        }
        let first = *columns.get_or_insert(*row);
        if first != *row {
            return Err(bad(line, &format!("this row has {row} points; the first one has {first}")));
        }
        *row = 0;
        Ok(())
    };
    for (number, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            end(&mut row, number)?;
            continue;
        }
        let numbers: Vec<f64> = line.split(',').map(|w| w.trim().parse().unwrap_or(f64::NAN)).collect();
        match numbers[..] {
            [x, y, z] if numbers.iter().all(|v| v.abs() <= FARTHEST) => points.push(DVec3::new(x, y, z)),
            _ => return Err(bad(number + 1, &format!("it is not three finite numbers within ±{FARTHEST:e}"))),
        }
        row += 1;
        if points.len() > MOST {
            return Err(bad(number + 1, &format!("there are more than {MOST} points")));
        }
    }
    end(&mut row, text.lines().count())?;
    let columns = columns.unwrap_or(0);
    if columns < 2 || points.len() < 2 * columns {
        return Err(bad(0, "a surface needs at least 2 rows of 2 points"));
    }
    Ok((points, columns))
}

impl CutSurface {
    fn surface(&self, cx: &Context<'_>) -> Result<(Surface, Vec<u8>), Stop> {
        let (radius, length) = (self.radius, self.length.unwrap_or(cx.size_mm().y));
        let arc = self.arc.to_radians();
        let bytes = |points: &[DVec3]| points.iter().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes).collect();
        let round = DVec3::new(radius, length, arc);
        Ok(match self.shape {
            SurfaceShape::Cylinder => (
                Arc::new(move |u, v| {
                    DVec3::new(radius * libm::cos(arc * u), radius * libm::sin(arc * u), length * (1.0 - v))
                }),
                bytes(&[round]),
            ),
            SurfaceShape::Bowl => (
                Arc::new(move |u, v| {
                    let down = std::f64::consts::FRAC_PI_2 * v;
                    let flat = radius * libm::cos(down);
                    DVec3::new(flat * libm::cos(arc * u), flat * libm::sin(arc * u), -radius * libm::sin(down))
                }),
                bytes(&[round + 1.0]),
            ),
            SurfaceShape::Bezier => {
                let controls: [DVec3; 16] =
                    std::array::from_fn(|i| self.controls.get(i).map_or(DVec3::ZERO, |c| vector(*c)));
                let bytes = bytes(&controls);
                (Arc::new(move |u, v| surface::patch(&controls, u, v)), bytes)
            }
            SurfaceShape::Points => {
                let Some(path) = cx.file("file") else {
                    return Err(Problem::new(Code::MissingInput, "file is not given").at("file").into());
                };
                let (points, columns) = read_grid(path)?;
                let bytes = [&bytes(&points)[..], &columns.to_le_bytes()].concat();
                (Arc::new(move |u, v| surface::grid(&points, columns, u, v)), bytes)
            }
        })
    }
}

impl Node for CutSurface {
    const OUTPUTS: &'static [Output] = &[Output::like("value", &["solid"], "What the surface shows of the solid.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        match self.shape {
            SurfaceShape::Bezier if self.controls.len() != 16 => {
                let message =
                    format!("controls has {} points; a patch needs 16, four rows of four", self.controls.len());
                vec![Problem::new(Code::BadValue, message).at("controls")]
            }
            SurfaceShape::Points if self.file.is_none() => {
                vec![Problem::new(Code::MissingInput, "shape is `Points`, which needs `file`").at("shape")]
            }
            _ => Vec::new(),
        }
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.file.iter().map(|file| ("file", file)).collect()
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        let round = matches!(self.shape, SurfaceShape::Cylinder | SurfaceShape::Bowl) && self.arc == 360.0;
        Tiling { x: round, y: false }
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        shown_channels(inputs.at("solid"))
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let size = cx.size_mm();
        let (surface, bytes) = self.surface(cx)?;
        let key = Key::of("surface", &[&[self.shape as u8], &bytes, &size.x.to_le_bytes(), &size.y.to_le_bytes()]);
        // The largest distance between neighbours on a coarse grid, in mm of space per mm of canvas.
        let mut stretch = DVec2::ZERO;
        let net = 48;
        for i in 0..net {
            for k in 0..net {
                let (u, v, step) = (f64::from(i) / f64::from(net), f64::from(k) / f64::from(net), 0.5 / f64::from(net));
                let at = surface(u, v);
                let ways = DVec2::new(surface(u + step, v).distance(at), surface(u, v + step).distance(at));
                stretch = stretch.max(ways / (step * size));
            }
        }
        let place = Field::generate(Type::Rgb, Node::tiling(self, cx.canvas), move |out: &mut Tile, _| {
            let (grid, window) = (out.grid, out.window);
            let width = out.width();
            let count = window.len();
            let mut planes = out.planes_mut();
            let mut i = 0;
            while i < count {
                let (x, y) = (i32::try_from(i % width).unwrap_or(0), i32::try_from(i / width).unwrap_or(0));
                let uv = grid.center(window.x + x, window.y + y) / size;
                let p = surface(uv.x, uv.y);
                (0..3).for_each(|k| planes[k][i] = shibo_kernel::ground::number::narrow(p[k]));
                i += 1;
            }
            Ok(())
        });
        let spacing = move |grid: &shibo_value::Grid| (stretch * grid.step).max_element();
        // Every solid that is cut reads the points, so they get a cache key.
        let place = place.keyed(Key::of("surface points", &[key.as_bytes()]));
        Ok(Outputs::one(shown_by(cx, &cx.get(&self.solid)?, &Cut::new(key, place, spacing))))
    }
}
