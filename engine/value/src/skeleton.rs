//! Skeletons of trees.
use super::{Number, Object, Shapes, Sketch, data};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A branch: a straight axis that starts on the trunk's skeleton.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Branch {
    /// Its start in mm.
    pub start: DVec3,
    /// The unit vector of its growth.
    pub direction: DVec3,
    /// Its thickening in mm per year.
    pub thickening: f64,
    /// Its length in mm; may be infinite.
    pub length: f64,
    /// The year of the tree in which it died; infinite for a living branch.
    pub dead_from: f64,
    /// Its lifetime in years, where that is known instead; infinite for a living branch.
    pub lifetime: f64,
}

/// The axis of a trunk, as cubic Bézier segments, and its branches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skeleton {
    /// The control points of each segment in mm; a segment ends where the next one starts.
    pub trunk: Vec<[DVec3; 4]>,
    /// True if the control points of every segment are evenly spaced in z.
    pub even: bool,
    /// The branches.
    pub branches: Vec<Branch>,
}

#[derive(Serialize)]
struct SkeletonData {
    trunk: Vec<[[Number<f64>; 3]; 4]>,
    branches: Vec<BranchData>,
}

#[derive(Serialize)]
struct BranchData {
    start: [Number<f64>; 3],
    direction: [Number<f64>; 3],
    thickening_speed: Number<f64>,
    length: Number<f64>,
    dead_from: Number<f64>,
    lifetime: Number<f64>,
}

/// The maximum drawn length of a branch, in mm.
const LONGEST: f64 = 3000.0;
/// Number of lines that draw a cubic segment of a trunk.
const PIECES: usize = 12;

impl Object for Skeleton {
    fn bytes(&self) -> usize {
        size_of::<Self>() + self.trunk.len() * size_of::<[DVec3; 4]>() + self.branches.len() * size_of::<Branch>()
    }

    fn data(&self) -> impl Serialize {
        let branch = |branch: &Branch| BranchData {
            start: data::triple(&branch.start),
            direction: data::triple(&branch.direction),
            thickening_speed: Number(branch.thickening),
            length: Number(branch.length),
            dead_from: Number(branch.dead_from),
            lifetime: Number(branch.lifetime),
        };
        SkeletonData {
            trunk: self.trunk.iter().map(|controls| controls.each_ref().map(data::triple)).collect(),
            branches: self.branches.iter().map(branch).collect(),
        }
    }

    /// The trunk with the ends of its segments, and the branches.
    fn sketch(&self) -> Option<Sketch> {
        let mut lines = Vec::new();
        for cubic in &self.trunk {
            let points: Vec<DVec3> = (0..=PIECES).map(|i| at(cubic, i as f64 / PIECES as f64)).collect();
            lines.extend(points.windows(2).map(|pair| [pair[0], pair[1]]));
        }
        let tall = Shapes { lines: lines.clone(), ..Shapes::default() }
            .extent()
            .map_or(1.0, |(low, high)| (high - low).max_element());
        let reach = LONGEST.min(0.3 * tall);
        lines.extend(self.branches.iter().map(|b| [b.start, b.start + b.direction * b.length.min(reach)]));
        Some(Sketch::Space(Shapes {
            points: self.trunk.iter().map(|cubic| cubic[0]).collect(),
            lines,
            counts: vec![(self.trunk.len(), "pieces"), (self.branches.len(), "branches")],
            ..Shapes::default()
        }))
    }
}

fn at([a, b, c, d]: &[DVec3; 4], t: f64) -> DVec3 {
    let s = 1.0 - t;
    *a * (s * s * s) + *b * (3.0 * s * s * t) + *c * (3.0 * s * t * t) + *d * (t * t * t)
}
