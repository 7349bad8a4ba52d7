//! Sets of positions.
use super::{Area, Number, Object, Shapes, Sketch, Tiling, data};
use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Order of points of a grid: point `(i, j)` has index `j · columns + i`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridOrder {
    /// Points per row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
    /// The distances between columns and between rows in mm, before jitter.
    pub pitch: Vec2,
    /// Shift of odd rows, as a fraction of the pitch.
    pub stagger: f32,
}

/// The edges of a tessellation whose corners are points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edges {
    /// Pairs of points, by their indices in the whole tessellation.
    pub links: Arc<Vec<[u32; 2]>>,
    /// The shift of the second end of each edge in canvases; empty if no end is shifted.
    pub offsets: Arc<Vec<[i8; 2]>>,
    /// Columns and rows, if the points form a grid, row by row, and the edges connect each point to the next one and to
    /// the one below.
    pub grid: Option<[u32; 2]>,
}

/// Positions in mm on a canvas.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Points {
    /// Positions. A point of a periodic set may lie outside the canvas; it stands for its copy inside.
    pub positions: Vec<Vec2>,
    /// Positions without jitter, if the points come from a jittered regular layout.
    pub regular: Option<Vec<Vec2>>,
    /// The canvas in mm.
    pub size_mm: DVec2,
    /// The directions in which the set repeats with the canvas.
    pub periodic: Tiling,
    /// The mean distance between neighbours in mm, as asked for.
    pub pitch: f32,
    /// Present if the points are in grid order.
    pub grid: Option<GridOrder>,
    /// Present if the points are the corners of a tessellation.
    pub edges: Option<Edges>,
    /// Present if the points are only a part of a grid or tessellation: the index of each point in the whole.
    pub sites: Option<Vec<u32>>,
    /// The part of the canvas that contains the points, if it is not the whole.
    pub area: Option<Arc<Area>>,
}

impl Points {
    /// The number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True if there are no points.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The positions before jitter.
    pub fn regular(&self) -> &[Vec2] {
        self.regular.as_deref().unwrap_or(&self.positions)
    }

    /// Positions without their layout.
    #[must_use]
    pub fn alone(&self) -> Self {
        Self { regular: None, grid: None, edges: None, sites: None, ..self.clone() }
    }
}

#[derive(Serialize)]
struct PointsData {
    points: Vec<[Number; 2]>,
}

impl Object for Points {
    fn bytes(&self) -> usize {
        let regular = self.regular.as_ref().map_or(0, Vec::len);
        let sites = self.sites.as_ref().map_or(0, Vec::len);
        let area = self.area.as_ref().map_or(0, |area| area.bytes());
        let edges = self.edges.as_ref().map_or(0, |edges| 8 * edges.links.len() + 2 * edges.offsets.len());
        size_of::<Self>() + size_of::<Vec2>() * (self.positions.len() + regular) + 4 * sites + area + edges
    }

    fn data(&self) -> impl Serialize {
        PointsData { points: data::pairs(&self.positions) }
    }

    fn sketch(&self) -> Option<Sketch> {
        let points = Shapes::<Vec2>::thinned(self.len()).map(|n| self.positions[n]).collect();
        Some(Sketch::Canvas(Shapes { points, counts: vec![(self.len(), "points")], ..Shapes::default() }))
    }
}
