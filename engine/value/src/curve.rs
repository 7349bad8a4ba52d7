//! Lines in space.
use super::{Number, Object, Shapes, Sketch, data};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Points of a line in space, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The points in mm; z points up.
    pub points: Vec<DVec3>,
}

#[derive(Serialize)]
struct CurveData {
    points: Vec<[Number<f64>; 3]>,
}

impl Object for Curve {
    fn bytes(&self) -> usize {
        size_of::<Self>() + self.points.len() * size_of::<DVec3>()
    }

    fn data(&self) -> impl Serialize {
        CurveData { points: self.points.iter().map(data::triple).collect() }
    }

    /// Its points, joined by lines.
    fn sketch(&self) -> Option<Sketch> {
        Some(Sketch::Space(Shapes {
            points: self.points.clone(),
            lines: self.points.windows(2).map(|pair| [pair[0], pair[1]]).collect(),
            counts: vec![(self.points.len(), "nodes")],
            ..Shapes::default()
        }))
    }
}
