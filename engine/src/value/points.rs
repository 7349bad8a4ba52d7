//! Sets of positions.
use super::Tiling;
use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};

/// The order of points that were laid out as a grid: point `(i, j)` has index `j · columns + i`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridOrder {
    /// Points per row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
    /// The distances between columns and between rows in mm, before jitter.
    pub pitch: Vec2,
    /// How far odd rows are shifted, as a share of the pitch.
    pub stagger: f32,
}

/// Positions in mm on a canvas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Points {
    /// Where they are. A point of a periodic set may lie outside the canvas; it stands for the one inside.
    pub positions: Vec<Vec2>,
    /// Where they would be without jitter, if they come from a regular layout that was jittered.
    pub regular: Option<Vec<Vec2>>,
    /// The canvas in mm.
    pub size_mm: DVec2,
    /// The directions in which the set repeats with the canvas.
    pub periodic: Tiling,
    /// The mean distance between neighbours in mm, as wished.
    pub pitch: f32,
    /// Present when the points are in grid order.
    pub grid: Option<GridOrder>,
}

impl Points {
    /// The number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The positions before jitter.
    pub fn regular(&self) -> &[Vec2] {
        self.regular.as_deref().unwrap_or(&self.positions)
    }

    /// The memory they take.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + size_of::<Vec2>() * (self.positions.len() + self.regular.as_ref().map_or(0, Vec::len))
    }
}
