//! The earlier method with straight skeletons (Momoi & Takatera 2014, §2.2, eqs 1–3), kept for comparison (figs 12 and
//! 14).
//!
//! The nearest node selects the two segments that are evaluated. A segment's area of influence lies between the planes
//! through its ends; where two overlap, their times are blended by the distance to the planes that bound the overlap
//! (the source only cites its blend function; here it is linear); outside both, the growth path goes through the node.
//! Cost: O(nodes) a point.
use crate::ground::real::Real;
use glam::DVec3;

/// A skeleton of straight segments.
#[derive(Clone, Debug)]
pub struct Straight<R> {
    nodes: Vec<[R; 3]>,
    /// For each segment: its direction, its length, and the total length before it.
    segments: Vec<([R; 3], R, R)>,
    inverse: [R; 2],
}

#[inline(always)]
fn sub<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl<R: Real> Straight<R> {
    /// Through `nodes`, growing along the axis with `elongation` and across with `thickening` mm a year.
    pub fn new(nodes: &[DVec3], elongation: f64, thickening: f64) -> Self {
        let mut before = 0.0;
        let segment = |pair: &[DVec3]| {
            let length = pair[0].distance(pair[1]);
            let start = before;
            before += length;
            (((pair[1] - pair[0]) / length).to_array().map(R::of), R::of(length), R::of(start))
        };
        Self {
            segments: nodes.windows(2).map(segment).collect(),
            nodes: nodes.iter().map(|n| n.to_array().map(R::of)).collect(),
            inverse: [R::of(1.0 / elongation), R::of(1.0 / thickening)],
        }
    }

    /// The node nearest to a point.
    #[inline(always)]
    fn nearest(&self, p: [R; 3]) -> usize {
        let mut best = (R::INFINITY, 0);
        for (i, node) in self.nodes.iter().enumerate() {
            let d = sub(p, *node);
            let d = dot(d, d);
            if d < best.0 {
                best = (d, i);
            }
        }
        best.1
    }

    /// The time through segment `i` and the position along it, if the point lies in its area.
    #[inline(always)]
    fn by_segment(&self, p: [R; 3], i: usize) -> Option<(R, R)> {
        let (direction, length, before) = *self.segments.get(i)?;
        let v = sub(p, self.nodes[i]);
        let along = dot(v, direction);
        if !(along >= R::ZERO && along <= length) {
            return None;
        }
        let away = sub(v, direction.map(|c| c * along));
        let time = (before + along) * self.inverse[0] + dot(away, away).sqrt() * self.inverse[1];
        Some((time, along))
    }

    /// The time at a point in years.
    #[inline]
    pub fn time_at(&self, p: [R; 3]) -> R {
        let k = self.nearest(p);
        let first = if k > 0 { self.by_segment(p, k - 1) } else { None };
        match (first, self.by_segment(p, k)) {
            (Some((a, along)), Some((b, beyond))) => {
                let (wa, wb) = (self.segments[k - 1].1 - along, beyond);
                let sum = wa + wb;
                if sum > R::ZERO { (a * wa + b * wb) / sum } else { a }
            }
            (Some((time, _)), None) | (None, Some((time, _))) => time,
            (None, None) => {
                let v = sub(p, self.nodes[k]);
                let way = match k {
                    0 => R::ZERO,
                    k => self.segments[k - 1].2 + self.segments[k - 1].1,
                };
                way * self.inverse[0] + dot(v, v).sqrt() * self.inverse[1]
            }
        }
    }
}

impl<R: Real> Straight<R> {
    /// The times at many points in years.
    pub fn times(&self, at: &super::trunk::Places<'_, R>, out: &mut [R]) {
        for (((x, y), z), out) in at.x.iter().zip(at.y).zip(at.z).zip(out) {
            *out = self.time_at([*x, *y, *z]);
        }
    }
}
