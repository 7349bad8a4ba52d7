//! [`HexPoints`]: the corners of hexagons.
//!
//! Source: JP4905282B2 §3 (rows A7v, A13v). Beyond the source: jitter, and tilings that repeat with the canvas.
//! Cost: O(points · log points).
use super::grid_points::{MAX_POINTS, afford, too_many};
use glam::{DVec2, Vec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::links::GridShape;
use shibo_kernel::leather::points::{hexagon_grid, hexagons_until};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Edges, Points, Stop, Tiling, Type};
use std::sync::Arc;

/// Points at the corners of a tiling by regular hexagons; two sides of each hexagon are horizontal.
///
/// On a canvas that tiles, the hexagons are stretched a little so that a whole number of them fits.
///
/// ```ron
/// "points": HexPoints(edge: 3, jitter: 0.3),
/// "links": ConnectNeighbors(points: "points", neighbors: HexEdges),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.4, 0.9), depth: 0.5, taper: 0.6),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Houdini *Tri Grid*; Material Maker *Beehive*.
#[node]
#[derive(PartialEq)]
pub struct HexPoints {
    /// Length of the sides of a hexagon, the distance between neighbours.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(1.0)]
    pub edge: f64,
    /// Largest random shift of points, as a share of the edge: at 1 by up to half an edge in x and in y.
    #[schemars(range(min = 0, max = 1))]
    pub jitter: f64,
    /// Another seed gives other shifts.
    pub seed: u64,
}

impl HexPoints {
    /// Approximate number of corners: a hexagon has six, and each belongs to three hexagons.
    fn count(&self, canvas: &CanvasFacts) -> f64 {
        canvas.size_mm().element_product() / (self.edge * self.edge * 0.75 * 3f64.sqrt())
    }
}

impl Node for HexPoints {
    const OUTPUTS: &'static [Output] = &[Output::new("points", Type::Points, "The corners, by rows.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        // A hexagon is 2 edges wide and √3 edges high.
        let hexagon = DVec2::new(2.0, 3f64.sqrt()) * self.edge;
        if hexagon.cmpgt(canvas.size_mm()).any() {
            let size = canvas.size_mm();
            let message = format!(
                "edge is `{}`; a hexagon of {:.3} × {:.3} mm must fit on the canvas, {} × {} mm",
                self.edge, hexagon.x, hexagon.y, size.x, size.y
            );
            return vec![Problem::new(Code::OutOfRange, message).at("edge")];
        }
        let wanted = self.count(canvas);
        if wanted > MAX_POINTS as f64 { vec![too_many(wanted, "edge")] } else { Vec::new() }
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if canvas.tile() == Tiling::BOTH { Tiling::BOTH } else { Tiling::NONE }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let periodic = Node::tiling(self, cx.canvas);
        let edge = narrow(self.edge);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a few million")]
        afford(cx, self.count(cx.canvas) as usize, "edge")?;
        let until = || cx.check().is_err();
        let (size, repeats) = (cx.size_mm().as_vec2(), periodic == Tiling::BOTH);
        let (regular, edges) = hexagons_until(size, edge, repeats, &until);
        cx.check()?;
        let hash = Hash::new(cx.seed(self.seed));
        let reach = self.edge * self.jitter;
        let stray = |(n, p): (u64, &Vec2)| {
            let rnd = DVec2::new(hash.unit(2 * n), hash.unit(2 * n + 1)) - 0.5;
            (p.as_dvec2() + rnd * reach).as_vec2()
        };
        let jittered = self.jitter > 0.0;
        let positions = if jittered { (0..).zip(&regular).map(stray).collect() } else { regular.clone() };
        Ok(Outputs::one(Points {
            positions,
            regular: jittered.then_some(regular),
            size_mm: cx.size_mm(),
            periodic,
            pitch: edge,
            edges: Some(Edges {
                links: Arc::new(edges.pairs),
                offsets: Arc::new(edges.wraps),
                grid: hexagon_grid(size, edge, repeats).and_then(count),
            }),
            ..Points::default()
        }))
    }
}

/// Columns and rows.
fn count(shape: GridShape) -> Option<[u32; 2]> {
    Some([u32::try_from(shape.nx).ok()?, u32::try_from(shape.ny).ok()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, outputs};
    use shibo_value::Value;

    fn points(node: &HexPoints) -> std::sync::Arc<Points> {
        match outputs(node, &[], &canvas()).unwrap().take("", true) {
            Some(Value::Points(points)) => points.clone(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn jitter_keeps_the_regular_places() {
        let made = points(&HexPoints { edge: 2.0, jitter: 0.5, ..HexPoints::default() });
        let regular = made.regular.as_ref().unwrap();
        assert_eq!(regular, &points(&HexPoints { edge: 2.0, ..HexPoints::default() }).positions);
        let far = made.positions.iter().zip(regular).map(|(a, b)| (*a - *b).abs().max_element());
        let far = far.fold(0.0, f32::max);
        assert!(far > 0.3 && far <= 0.5 + 1e-5, "{far}");
    }

    #[test]
    fn sizes_are_checked() {
        let check = |edge| HexPoints { edge, ..HexPoints::default() }.check_on(&canvas()).first().map(|p| p.code);
        assert_eq!(check(20.0), Some(Code::OutOfRange));
        assert_eq!(check(1e-3), Some(Code::TooLarge));
        assert_eq!(check(1.0), None);
    }
}
