//! Paths: lines and curves on the canvas.
use super::{Number, Object, Renders, Segments, Shapes, Sketch, Tiling};
use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A polyline. The node that makes a path cuts curves into short straight pieces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Polyline {
    /// Its corners in mm, at least two, with no two equal in a row. In a closed line the last corner equals the first;
    /// on a periodic canvas it may also be the first corner shifted by whole canvases, so that the line goes around the
    /// canvas.
    pub points: Vec<DVec2>,
    /// True if the end is joined to the beginning.
    pub closed: bool,
}

impl Polyline {
    /// Its length in mm.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }
}

/// Lines and curves on a canvas, as [`Polyline`]s.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// The curves, in order.
    pub curves: Vec<Polyline>,
    /// The canvas in mm.
    pub size_mm: DVec2,
    /// The directions in which the path repeats with the canvas.
    pub periodic: Tiling,
}

impl Path {
    /// The straight pieces of all curves.
    pub fn pieces(&self) -> impl Iterator<Item = [DVec2; 2]> + Clone {
        self.curves.iter().flat_map(|curve| curve.points.windows(2).map(|pair| [pair[0], pair[1]]))
    }

    /// Number of straight pieces.
    pub fn len(&self) -> usize {
        self.curves.iter().map(|curve| curve.points.len().saturating_sub(1)).sum()
    }

    /// True if there is no straight piece.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[derive(Serialize)]
struct CurveData {
    points: Vec<[Number<f64>; 2]>,
    closed: bool,
    length: Number<f64>,
}

#[derive(Serialize)]
struct PathData {
    curves: Vec<CurveData>,
}

impl Object for Path {
    const RENDERS: Option<Renders> = Some(Renders::Lines);

    fn bytes(&self) -> usize {
        let points: usize = self.curves.iter().map(|curve| curve.points.len()).sum();
        size_of::<Self>() + self.curves.len() * size_of::<Polyline>() + points * size_of::<DVec2>()
    }

    fn data(&self) -> impl Serialize {
        let curve = |curve: &Polyline| CurveData {
            points: curve.points.iter().map(|point| point.to_array().map(Number)).collect(),
            closed: curve.closed,
            length: Number(curve.length()),
        };
        PathData { curves: self.curves.iter().map(curve).collect() }
    }

    fn sketch(&self) -> Option<Sketch> {
        let all: Vec<[Vec2; 2]> = self.pieces().map(|ends| ends.map(|end| end.as_vec2())).collect();
        let lines = Shapes::<Vec2>::thinned(all.len()).map(|n| all[n]).collect();
        let counts = vec![(self.curves.len(), "curves"), (all.len(), "pieces")];
        Some(Sketch::Canvas(Shapes { lines, counts, ..Shapes::default() }))
    }

    fn lines(self: &Arc<Self>) -> Option<Arc<Segments>> {
        Some(Arc::new(Segments {
            ends: self.pieces().map(|ends| ends.map(|end| end.as_vec2())).collect(),
            length_ratio: Vec::new(),
            stretch: Vec::new(),
            width: Vec::new(),
            size_mm: self.size_mm,
            periodic: self.periodic,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_lengths_and_draws_lines() {
        let points = vec![DVec2::ZERO, DVec2::new(3.0, 4.0), DVec2::new(3.0, 10.0)];
        let curve = Polyline { points, closed: false };
        assert_eq!(curve.length(), 11.0);
        let path = Path { curves: vec![curve.clone(), curve], size_mm: DVec2::splat(8.0), periodic: Tiling::BOTH };
        assert_eq!((path.len(), path.is_empty(), Path::default().is_empty()), (4, false, true));
        let lines = Arc::new(path).lines().unwrap();
        assert_eq!(lines.ends[1], [Vec2::new(3.0, 4.0), Vec2::new(3.0, 10.0)]);
    }
}
