//! What trees are made of: curves, skeletons and the colours of a year.
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Points of a line in space, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The points in mm; z points up.
    pub points: Vec<DVec3>,
}

impl Curve {
    /// The memory it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.points.len() * size_of::<DVec3>()
    }
}

/// A branch: a straight axis that starts on the trunk's skeleton.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Branch {
    /// Where it starts, in mm.
    pub start: DVec3,
    /// The direction in which it grows, of length 1.
    pub direction: DVec3,
    /// How fast it thickens, in mm a year.
    pub thickening: f64,
    /// Its length in mm; may be infinite.
    pub length: f64,
    /// The year of the tree after which it grew no more; infinite for a living one.
    pub dead_from: f64,
    /// How many years it lived, where that is known instead; infinite for a living one.
    pub lifetime: f64,
}

/// The line along which a trunk grew, as cubic Bézier segments, and its branches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skeleton {
    /// The control points of each segment in mm; a segment ends where the next one starts.
    pub trunk: Vec<[DVec3; 4]>,
    /// Whether the control points of every segment are evenly spaced in z.
    pub even: bool,
    /// The branches.
    pub branches: Vec<Branch>,
}

impl Skeleton {
    /// The memory it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.trunk.len() * size_of::<[DVec3; 4]>() + self.branches.len() * size_of::<Branch>()
    }
}

/// The colours of wood through the year, from early to late, for one or several years.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColorPattern {
    /// Scene-linear colours, [`entries`](Self::entries) for each year.
    pub table: Vec<[f32; 3]>,
    /// The number of entries of a year.
    pub entries: usize,
    /// The relative widths of the years that it was sampled from, if it was.
    pub widths: Vec<f32>,
}

impl ColorPattern {
    /// The memory it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.table.len() * 12 + self.widths.len() * 4
    }
}
