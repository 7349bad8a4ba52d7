//! [`GridPoints`]: points in rows and columns.
//!
//! Source: JP4905282B2 §3, claims 6 and 7 (rows A1–A6, A10). Beyond the source: staggered rows and
//! grids that repeat with the canvas. Cost: O(points).
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::points::{GridSpec, grid, grid_counts};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{GridOrder, Points, Stop, Tiling, Type};

/// Maximum number of points.
pub(super) const MAX_POINTS: usize = 4_000_000;

/// Points in rows and columns, regular or jittered: the seed points of the wrinkle method.
///
/// The pitch is rounded so that it divides the canvas. On a canvas that tiles, the grid repeats; otherwise its border
/// points lie on the edge.
///
/// ```ron
/// "points": GridPoints(pitch: 3, stagger: 0.5, jitter: 0.7),
/// "links": ConnectNeighbors(points: "points", neighbors: Delaunay),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.5, 0.9), depth: 0.5),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Blender *Mesh Grid*; Houdini *Grid*; Substance Designer *Tile Generator*.
#[node]
#[derive(PartialEq)]
pub struct GridPoints {
    /// Distance between columns and between rows; one number sets both.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Xy::new(1.0, 1.0))]
    pub pitch: Xy,
    /// By how much every second row is shifted, as a share of the pitch; 0.5 makes a grid of triangles.
    #[schemars(range(min = 0, max = 1))]
    pub stagger: f64,
    /// Largest random shift of points, as a share of the pitch: at 1 by up to half a pitch in x and in y.
    #[schemars(range(min = 0, max = 1))]
    #[default(1.0)]
    pub jitter: f64,
    /// True to keep points at the border in place. Has no effect on a canvas that tiles, which has no border.
    #[default(true)]
    pub keep_border: bool,
    /// Another seed gives other shifts.
    pub seed: u64,
}

impl GridPoints {
    fn spec(&self, canvas: &CanvasFacts) -> GridSpec {
        GridSpec {
            size: canvas.size_mm().as_vec2(),
            pitch: glam::DVec2::new(self.pitch.x, self.pitch.y).as_vec2(),
            stagger: narrow(self.stagger),
            jitter: narrow(self.jitter),
            keep_border: self.keep_border,
            periodic: canvas.tile() == Tiling::BOTH,
        }
    }
}

impl Node for GridPoints {
    const OUTPUTS: &'static [Output] = &[Output::new("points", Type::Points, "The points, by rows.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let pitch = glam::DVec2::new(self.pitch.x, self.pitch.y);
        if pitch.cmpgt(canvas.size_mm()).any() {
            let size = canvas.size_mm();
            let pitch = if pitch.x == pitch.y { format!("{}", pitch.x) } else { format!("({}, {})", pitch.x, pitch.y) };
            let message =
                format!("pitch is `{pitch}`; it must be at most as large as the canvas, {} × {} mm", size.x, size.y);
            return vec![Problem::new(Code::OutOfRange, message).at("pitch")];
        }
        // Estimated in f64 first: a tiny pitch on a large canvas would overflow the exact count.
        let wanted = (canvas.size_mm() / pitch).element_product();
        if wanted > MAX_POINTS as f64 {
            return vec![too_many(wanted, "pitch")];
        }
        let (columns, rows) = grid_counts(&self.spec(canvas));
        if columns.saturating_mul(rows) > MAX_POINTS { vec![too_many(wanted, "pitch")] } else { Vec::new() }
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if canvas.tile() == Tiling::BOTH { Tiling::BOTH } else { Tiling::NONE }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let spec = self.spec(cx.canvas);
        let hash = Hash::new(cx.seed(self.seed));
        let (columns, rows) = grid_counts(&spec);
        afford(cx, columns * rows, "pitch")?;
        let made = grid(&spec, hash);
        cx.check()?;
        let regular = (self.jitter > 0.0).then(|| grid(&GridSpec { jitter: 0.0, ..spec }, hash).points);
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let order = GridOrder {
            columns: count(made.nx),
            rows: count(made.ny),
            pitch: made.pitch,
            stagger: narrow(self.stagger),
        };
        Ok(Outputs::one(Points {
            positions: made.points,
            regular,
            size_mm: cx.size_mm(),
            periodic: Node::tiling(self, cx.canvas),
            pitch: made.pitch.min_element(),
            grid: Some(order),
            ..Points::default()
        }))
    }
}

/// The error for too many points, for example after a typing error.
pub(super) fn too_many(wanted: f64, field: &str) -> Problem {
    let message = format!("{field} would make about {wanted:.0} points; at most {MAX_POINTS} are allowed");
    Problem::new(Code::TooLarge, message).at(field).help("make them fewer, or use a smaller canvas")
}

/// Memory of a point in the stages that follow, in bytes: with its links, springs and segments, and during the motion.
const BYTES: u64 = 256;

/// Refuses points that would not fit the memory budget.
pub(super) fn afford(cx: &Context<'_>, count: usize, field: &str) -> Result<(), Problem> {
    let (needed, allowed) = (count as u64 * BYTES, cx.evaluator.memory());
    if needed <= allowed {
        return Ok(());
    }
    let message = format!(
        "{field} makes {count} points, which with their links and springs need about {} MiB; {} MiB are allowed",
        needed >> 20,
        allowed >> 20
    );
    let help = "use fewer points (a larger pitch), or raise --memory";
    Err(Problem::new(Code::TooLarge, message).at(field).help(help))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, outputs};
    use shibo_value::Canvas;
    use shibo_value::Value;

    fn points(node: &GridPoints, canvas: &Canvas) -> std::sync::Arc<Points> {
        match outputs(node, &[], canvas).unwrap().take("", true) {
            Some(Value::Points(points)) => points.clone(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_bounded_grid_touches_the_edges() {
        let canvas = Canvas { tile: Tiling::NONE, size_mm: glam::DVec2::splat(4.0), ..canvas() };
        let made = points(&GridPoints { jitter: 0.0, ..GridPoints::default() }, &canvas);
        assert_eq!(made.len(), 25);
        assert_eq!(made.positions[24], glam::Vec2::splat(4.0));
        assert_eq!(made.grid.unwrap().columns, 5);
    }

    #[test]
    fn a_periodic_grid_divides_the_canvas() {
        let made = points(&GridPoints { pitch: Xy::new(3.0, 3.0), ..GridPoints::default() }, &canvas());
        assert_eq!(made.len(), 11 * 11);
        assert_eq!(made.periodic, Tiling::BOTH);
        assert!(made.regular.is_some());
    }

    #[test]
    fn too_many_points_are_refused() {
        let node = GridPoints { pitch: Xy::new(1e-4, 1e-4), ..GridPoints::default() };
        assert_eq!(node.check_on(&canvas())[0].code, Code::TooLarge);
        let node = GridPoints { pitch: Xy::new(100.0, 1.0), ..GridPoints::default() };
        assert_eq!(node.check_on(&canvas())[0].code, Code::OutOfRange);
    }
}
