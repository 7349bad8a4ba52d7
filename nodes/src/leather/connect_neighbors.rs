//! [`ConnectNeighbors`]: which points are neighbours.
//!
//! Source: JP4905282B2 §3, claim 8 (rows A11, A12, A14–A16). Delaunay links are beyond the source; they are the first
//! lever of LEATHER-LOOK. Cost: O(links), Delaunay O(n log n).
use crate::kernel::delaunay::delaunay;
use crate::kernel::lattice::{GridShape, Links, grid_links, wrap};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{Context, In, Node, Output, Outputs};
use shibo_engine::value::{GridLinks, Lattice, Points, Stop, Tiling, Type};
use std::sync::Arc;

/// A rule that says which points are neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Neighbors {
    /// The 4 nearest of a grid.
    Four,
    /// The 8 nearest of a grid.
    Eight,
    /// Those whose cells touch; about 6, for any points.
    #[default]
    Delaunay,
}

/// Links neighbouring points to a lattice. Jittered grid points keep the neighbours of the regular grid.
///
/// On a canvas that tiles, points near an edge are linked across it.
///
/// ```ron
/// "points": PoissonPoints(pitch: 4),
/// "links": ConnectNeighbors(points: "points", neighbors: Delaunay),
/// "wrinkles": PlaceWrinkles(lattice: "links", length_scale: 0.6),
/// "height": DrawWrinkles(segments: "wrinkles", width: 0.7, depth: 0.5),
/// "example": Relief(height: "height"),
/// ```
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ConnectNeighbors {
    /// The points to link.
    pub points: In<Points>,
    /// Which points are neighbours. `Four` and `Eight` need the points of a grid.
    pub neighbors: Neighbors,
}

impl Node for ConnectNeighbors {
    const OUTPUTS: &'static [Output] = &[Output::new("lattice", Type::Lattice, "The points and their links.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let points = cx.get(&self.points)?;
        let periodic = points.periodic == Tiling::BOTH;
        let size = points.size_mm.as_vec2();
        let shape = |order: &shibo_engine::value::GridOrder| GridShape {
            nx: order.columns as usize,
            ny: order.rows as usize,
            eight: self.neighbors == Neighbors::Eight,
            periodic,
        };
        let (points, links, grid) = match (self.neighbors, &points.grid) {
            (Neighbors::Delaunay, _) => {
                let (points, links) = triangulate(points, size, periodic);
                (points, links, None)
            }
            (Neighbors::Four, Some(order)) => (points.clone(), grid_links(shape(order)), Some(GridLinks::Four)),
            (Neighbors::Eight, Some(order)) => (points.clone(), grid_links(shape(order)), Some(GridLinks::Eight)),
            (Neighbors::Four | Neighbors::Eight, None) => {
                let message = format!("neighbors is `{:?}`, which needs the points of a grid", self.neighbors);
                let problem = Problem::new(Code::BadValue, message).at("neighbors");
                return Err(problem.help("use `GridPoints`, or `neighbors: Delaunay`").into());
            }
        };
        cx.check()?;
        Ok(Outputs::one(Lattice {
            points,
            links: Arc::new(links.pairs),
            offsets: Arc::new(links.wraps),
            grid,
            velocities: None,
            broken: Vec::new(),
        }))
    }
}

/// Links by triangulation. Points of a periodic set that have left the canvas come back first.
fn triangulate(points: Arc<Points>, size: glam::Vec2, periodic: bool) -> (Arc<Points>, Links) {
    let inside = |p: &glam::Vec2| p.cmpge(glam::Vec2::ZERO).all() && p.cmplt(size).all();
    let points = if periodic && !points.positions.iter().all(inside) {
        let mut moved = Points::clone(&points);
        wrap(&mut moved.positions, &mut Links::default(), size);
        moved.grid = None;
        moved.regular = None;
        Arc::new(moved)
    } else {
        points
    };
    let links = delaunay(&points.positions, size, periodic);
    (points, links)
}
