//! Sets of line segments.
use super::{Number, Object, Renders, Shapes, Sketch, Tiling, data};
use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Line segments on a canvas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segments {
    /// The two ends of each, in mm.
    pub ends: Vec<[Vec2; 2]>,
    /// Length of the link that each segment was made from, as a multiple of the median length; empty if there are no
    /// links.
    pub length_ratio: Vec<f32>,
    /// The stretch of that link: its length divided by its length before the motion; empty if unknown.
    pub stretch: Vec<f32>,
    /// The full width of each segment in mm; empty if segments have no width.
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

    /// True if there are no segments.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The segments within the rectangle from `low` to `high`, in order and clipped, with their widths (0 if they have
    /// none). If the set repeats, copies that reach into the rectangle are included.
    pub fn within(&self, low: Vec2, high: Vec2) -> Vec<([Vec2; 2], f32)> {
        let size = self.size_mm.as_vec2();
        let mut pieces = Vec::with_capacity(self.ends.len());
        for (n, &ends) in self.ends.iter().enumerate() {
            let width = self.width.get(n).copied().unwrap_or(0.0);
            let (from, to) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            // Range of shifts, in canvases, for which a copy reaches the rectangle.
            let first = ((low - to) / size).ceil();
            let last = ((high - from) / size).floor();
            let range = |repeats: bool, axis: usize| {
                let whole = |v: f32| if v.abs() < 1e6 { v } else { 0.0 };
                if repeats { (whole(first[axis]), whole(last[axis])) } else { (0.0, 0.0) }
            };
            let (x, y) = (range(self.periodic.x, 0), range(self.periodic.y, 1));
            let mut row = y.0;
            while row <= y.1 {
                let mut column = x.0;
                while column <= x.1 {
                    let shift = Vec2::new(column, row) * size;
                    pieces.extend(clip_line(ends.map(|e| e + shift), low, high).map(|ends| (ends, width)));
                    column += 1.0;
                }
                row += 1.0;
            }
        }
        pieces
    }
}

#[derive(Serialize)]
struct SegmentsData {
    segments: Vec<[Number; 4]>,
    width: Vec<Number>,
}

impl Object for Segments {
    const RENDERS: Option<Renders> = Some(Renders::Lines);

    fn bytes(&self) -> usize {
        size_of::<Self>() + self.ends.len() * 16 + 4 * (self.length_ratio.len() + self.stretch.len() + self.width.len())
    }

    fn data(&self) -> impl Serialize {
        let ends = |[a, b]: &[Vec2; 2]| [a.x, a.y, b.x, b.y].map(Number);
        SegmentsData { segments: self.ends.iter().map(ends).collect(), width: data::numbers(&self.width) }
    }

    fn sketch(&self) -> Option<Sketch> {
        let lines = Shapes::<Vec2>::thinned(self.len()).map(|n| self.ends[n]).collect();
        Some(Sketch::Canvas(Shapes { lines, counts: vec![(self.len(), "segments")], ..Shapes::default() }))
    }

    fn lines(self: &Arc<Self>) -> Option<Arc<Segments>> {
        Some(self.clone())
    }
}

/// The part of a line segment inside a rectangle (Liang and Barsky); `None` if the segment only touches it.
pub fn clip_line([a, b]: [Vec2; 2], low: Vec2, high: Vec2) -> Option<[Vec2; 2]> {
    let d = b - a;
    let (mut from, mut to) = (0.0f32, 1.0f32);
    for axis in 0..2 {
        for (step, room) in [(-d[axis], a[axis] - low[axis]), (d[axis], high[axis] - a[axis])] {
            if step == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if step < 0.0 {
                from = from.max(room / step);
            } else {
                to = to.min(room / step);
            }
        }
    }
    let at = |t: f32| (a + d * t).clamp(low, high);
    (from < to).then(|| [if from > 0.0 { at(from) } else { a }, if to < 1.0 { at(to) } else { b }])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(periodic: Tiling) -> Segments {
        Segments {
            ends: vec![[Vec2::new(-1.0, 4.0), Vec2::new(3.0, 4.0)]],
            length_ratio: Vec::new(),
            stretch: Vec::new(),
            width: vec![0.5],
            size_mm: DVec2::splat(8.0),
            periodic,
        }
    }

    #[test]
    fn lines_are_cut_at_the_edges() {
        let cut = one(Tiling::NONE).within(Vec2::ZERO, Vec2::splat(8.0));
        assert_eq!(cut, [([Vec2::new(0.0, 4.0), Vec2::new(3.0, 4.0)], 0.5)]);
    }

    #[test]
    fn includes_copies_at_the_opposite_edge() {
        let cut = one(Tiling::BOTH).within(Vec2::ZERO, Vec2::splat(8.0));
        let pieces: Vec<_> = cut.iter().map(|c| c.0).collect();
        let line = |x0, x1| [Vec2::new(x0, 4.0), Vec2::new(x1, 4.0)];
        assert_eq!(pieces, [line(0.0, 3.0), line(7.0, 8.0)]);
    }
}
