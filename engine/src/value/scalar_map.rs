//! Scalars over the canvas, as samples.
use glam::UVec2;
use serde::{Deserialize, Serialize};

/// A scalar over the canvas, as samples, and how it is read at a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScalarMap {
    /// Columns and rows of samples over the canvas.
    pub size: UVec2,
    /// The samples by rows.
    pub values: Vec<f32>,
    /// What 0 and 1 of the samples stand for.
    pub range: [f32; 2],
    /// The samples within this distance of a place, in mm, are read; if it is `None`, the one on which the place lies.
    pub radius: Option<f32>,
    /// Whether these samples are summed up rather than averaged.
    pub sum: bool,
}

impl ScalarMap {
    /// The memory it takes.
    pub const fn bytes(&self) -> usize {
        size_of::<Self>() + 4 * self.values.len()
    }
}
