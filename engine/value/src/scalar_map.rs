//! Sampled scalars over the canvas.
use glam::UVec2;
use serde::{Deserialize, Serialize};

/// A sampled scalar over the canvas, with the rule for reading it at a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScalarMap {
    /// Columns and rows of samples over the canvas.
    pub size: UVec2,
    /// The samples, row by row.
    pub values: Vec<f32>,
    /// Values that samples of 0 and 1 stand for.
    pub range: [f32; 2],
    /// Radius in mm of the disk whose samples are read; `None` reads only the sample at the point.
    pub radius: Option<f32>,
    /// True to sum these samples instead of averaging them.
    pub sum: bool,
}

impl ScalarMap {
    /// The memory it takes.
    pub const fn bytes(&self) -> usize {
        size_of::<Self>() + 4 * self.values.len()
    }
}
