//! [`ConnectNeighbors`]: links between neighbouring points.
//!
//! Source: JP4905282B2 §3, claim 8 (rows A11–A16). Delaunay links are beyond the source; they contribute most to a
//! natural look of leather. Cost: O(links), Delaunay O(n log n).
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::stop::Until;
use shibo_kernel::leather::delaunay::delaunay_until;
use shibo_kernel::leather::links::{GridShape, Links, grid_links_until, radius_estimate, radius_links_until, wrap};
use shibo_node::{Context, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{GridLinks, Lattice, Points, Stop, Tiling, Type};
use std::sync::Arc;

/// Rule that decides which points are neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Neighbors {
    /// The 4 nearest points of a grid.
    Four,
    /// The 8 nearest points of a grid.
    Eight,
    /// The 3 points at the other ends of a point's edges in the hexagons of `HexPoints`.
    HexEdges,
    /// All points at most this many mm away; for any points.
    Radius(f64),
    /// Points whose Voronoi cells touch, about 6; for any points.
    #[default]
    Delaunay,
}

/// Links neighbouring points into a lattice. Jittered grid points keep the neighbours of the regular grid.
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
///
/// Elsewhere: Houdini *Connect Adjacent Pieces*.
#[node]
pub struct ConnectNeighbors {
    /// The points to link.
    pub points: In<Points>,
    /// Rule that decides which points are neighbours. `Four` and `Eight` need the points of a grid, `HexEdges` those of
    /// hexagons.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    pub neighbors: Neighbors,
}

/// Maximum number of links.
const MAX_LINKS: usize = 32_000_000;

impl Node for ConnectNeighbors {
    const OUTPUTS: &'static [Output] = &[Output::new("lattice", Type::Lattice, "The points and their links.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let points = cx.get(&self.points)?;
        let periodic = points.periodic == Tiling::BOTH;
        let size = points.size_mm.as_vec2();
        let until = || cx.check().is_err();
        let (points, links, layout) = match self.neighbors {
            Neighbors::Delaunay => {
                let (points, links) = triangulate(points, size, periodic, &until);
                (points, links, None)
            }
            Neighbors::Radius(radius) => {
                let links = self.within(cx, &points, radius)?;
                (points, links, None)
            }
            Neighbors::Four | Neighbors::Eight | Neighbors::HexEdges => {
                let (whole, grid) = self.of_layout(&points, &until)?;
                cx.check()?;
                let links = kept(whole, &points);
                let grid = grid.filter(|_| points.sites.is_none());
                (points, links, Some(grid))
            }
        };
        cx.check()?;
        self.advise(cx, &points, &links);
        Ok(Outputs::one(Lattice {
            points,
            links: Arc::new(links.pairs),
            offsets: Arc::new(links.wraps),
            regular: layout.is_some(),
            grid: layout.flatten(),
            ..Lattice::default()
        }))
    }
}

impl ConnectNeighbors {
    /// The links of the whole grid or tiling, and its grid form if it has one.
    fn of_layout(&self, points: &Points, until: Until<'_>) -> Result<(Links, Option<GridLinks>), Problem> {
        let periodic = points.periodic == Tiling::BOTH;
        let eight = self.neighbors == Neighbors::Eight;
        match (self.neighbors, &points.grid, &points.edges) {
            (Neighbors::HexEdges, _, Some(edges)) => {
                let links = Links { pairs: edges.links.to_vec(), wraps: edges.offsets.to_vec() };
                Ok((links, edges.grid.map(|[columns, rows]| GridLinks { columns, rows, diagonals: false })))
            }
            (Neighbors::Four | Neighbors::Eight, Some(order), _) => {
                let shape = GridShape { nx: order.columns as usize, ny: order.rows as usize, eight, periodic };
                let grid = GridLinks { columns: order.columns, rows: order.rows, diagonals: eight };
                Ok((grid_links_until(shape, until), Some(grid)))
            }
            _ => {
                let (needs, node) = match self.neighbors {
                    Neighbors::HexEdges => ("the corners of hexagons", "HexPoints"),
                    _ => ("the points of a grid", "GridPoints"),
                };
                let message = format!("neighbors is `{:?}`, which needs {needs}", self.neighbors);
                let help = format!("use `{node}`, or `neighbors: Delaunay`");
                Err(Problem::new(Code::BadValue, message).at("neighbors").help(help))
            }
        }
    }

    /// Links to all points within a radius, unless there are too many.
    fn within(&self, cx: &Context<'_>, points: &Points, radius: f64) -> Result<Links, Stop> {
        let periodic = points.periodic == Tiling::BOTH;
        let (size, reach) = (points.size_mm.as_vec2(), narrow(radius));
        let shorter = points.size_mm.min_element();
        if periodic && radius >= 0.5 * shorter {
            let message = format!(
                "neighbors is `Radius({radius})`; on a canvas that tiles the radius must be less than half of it, {} mm",
                0.5 * shorter
            );
            return Err(Problem::new(Code::OutOfRange, message).at("neighbors").into());
        }
        let count = radius_estimate(&points.positions, reach, size, periodic);
        // A stored link takes 10 bytes, and about 40 while links are found and sorted.
        let most = (cx.evaluator.memory() / 50).min(MAX_LINKS as u64) as f64;
        if count > most {
            let message = format!(
                "neighbors is `Radius({radius})`, which would make about {count:.0} links between {} points; at most \
                 {most:.0} are allowed",
                points.len()
            );
            let pitch = points.pitch;
            let help =
                format!("points are about {pitch} mm apart; a radius of {:.3} mm gives about 8 each", 1.6 * pitch);
            return Err(Problem::new(Code::TooLarge, message).at("neighbors").help(help).into());
        }
        cx.check()?;
        let until = || cx.check().is_err();
        Ok(radius_links_until(&points.positions, reach, size, periodic, &until))
    }

    /// Warns of points without any link.
    fn advise(&self, cx: &Context<'_>, points: &Points, links: &Links) {
        let mut linked = vec![false; points.len()];
        links.pairs.iter().flatten().for_each(|&p| linked[p as usize] = true);
        let alone = linked.iter().filter(|l| !**l).count();
        if alone > 0 {
            let message = format!("{alone} of {} points have no neighbour: they stay where they are", points.len());
            let help = match self.neighbors {
                Neighbors::Radius(_) => "a larger radius links more of them",
                _ => "a larger work area leaves fewer of them alone",
            };
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("neighbors").help(help));
        }
    }
}

/// The links between kept points, with the new numbers of the points.
fn kept(whole: Links, points: &Points) -> Links {
    let Some(sites) = &points.sites else { return whole };
    let most = whole.pairs.iter().flatten().copied().chain(sites.iter().copied()).max().unwrap_or(0);
    let mut number = vec![u32::MAX; most as usize + 1];
    (0u32..).zip(sites).for_each(|(n, &site)| number[site as usize] = n);
    let mut left = Links::default();
    for (l, pair) in whole.pairs.iter().enumerate() {
        let ends = pair.map(|p| number[p as usize]);
        if !ends.contains(&u32::MAX) {
            left.pairs.push(ends);
            left.wraps.extend(whole.wraps.get(l));
        }
    }
    left
}

/// Links by triangulation. Points of a periodic set that lie outside the canvas are first moved back by whole canvases.
fn triangulate(points: Arc<Points>, size: glam::Vec2, periodic: bool, until: Until<'_>) -> (Arc<Points>, Links) {
    let inside = |p: &glam::Vec2| p.cmpge(glam::Vec2::ZERO).all() && p.cmplt(size).all();
    let points = if periodic && !points.positions.iter().all(inside) {
        let mut moved = points.alone();
        wrap(&mut moved.positions, &mut Links::default(), size);
        Arc::new(moved)
    } else {
        points
    };
    let links = delaunay_until(&points.positions, size, periodic, until);
    (points, links)
}
