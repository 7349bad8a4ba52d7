//! Paths: lines and curves on the canvas.
use super::{Number, Object, Renders, Segments, Shapes, Sketch, Tiling};
use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A line of straight pieces. Curves are cut into pieces that are short enough where the path is made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Polyline {
    /// Its corners in mm, at least two, none equal to the one before. Where it is closed, the last one is the first one
    /// again; on a periodic canvas it may also be the first one moved by whole canvases, so that the line goes round
    /// the canvas.
    pub points: Vec<DVec2>,
    /// Whether the line goes on where it begins.
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

    /// How many straight pieces there are.
    pub fn len(&self) -> usize {
        self.curves.iter().map(|curve| curve.points.len().saturating_sub(1)).sum()
    }

    /// Whether there is none.
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
    fn lengths_and_lines() {
        let points = vec![DVec2::ZERO, DVec2::new(3.0, 4.0), DVec2::new(3.0, 10.0)];
        let curve = Polyline { points, closed: false };
        assert_eq!(curve.length(), 11.0);
        let path = Path { curves: vec![curve.clone(), curve], size_mm: DVec2::splat(8.0), periodic: Tiling::BOTH };
        assert_eq!((path.len(), path.is_empty(), Path::default().is_empty()), (4, false, true));
        let lines = Arc::new(path).lines().unwrap();
        assert_eq!(lines.ends[1], [Vec2::new(3.0, 4.0), Vec2::new(3.0, 10.0)]);
    }
}
