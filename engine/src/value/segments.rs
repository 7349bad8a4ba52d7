//! Sets of line segments.
use super::Tiling;
use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};

/// Line segments on a canvas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segments {
    /// The two ends of each, in mm.
    pub ends: Vec<[Vec2; 2]>,
    /// The length of the link that each was made from, as a multiple of the median length; empty if there is none.
    pub length_ratio: Vec<f32>,
    /// How far that link is stretched: its length over its length before the motion; empty if unknown.
    pub stretch: Vec<f32>,
    /// The full width of each in mm; empty if it has none of its own.
    pub width: Vec<f32>,
    /// The canvas in mm.
    pub size_mm: DVec2,
    /// The directions in which the set repeats with the canvas.
    pub periodic: Tiling,
}

impl Segments {
    /// The number of segments.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The memory they take.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.ends.len() * 16 + 4 * (self.length_ratio.len() + self.stretch.len() + self.width.len())
    }
}
