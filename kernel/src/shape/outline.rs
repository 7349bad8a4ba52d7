//! Signed distances of outlines: closed polygons with any number of parts and holes.
//!
//! A point is inside if the outlines wind around it (the non-zero rule of fonts), or by the even-odd rule if they do so an
//! odd number of times. Distances are exact: a window is divided into small blocks, and each block uses only the edges
//! that can be nearest to one of its pixels. O(edges · blocks + pixels · edges near).
use crate::ground::number::narrow;
use crate::ground::window::{Frame, WindowExt as _, index};
use glam::DVec2;
use shibo_value::{Tiling, Window};

/// Side of a block in pixels.
const BLOCK: usize = 16;

/// A straight segment of an outline, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Start.
    pub from: DVec2,
    /// End.
    pub to: DVec2,
}

impl Edge {
    #[inline(always)]
    fn distance_squared(&self, p: DVec2) -> f64 {
        let (way, to) = (self.to - self.from, p - self.from);
        let t = (to.dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (to - way * t).length_squared()
    }

    fn moved(&self, by: DVec2) -> Self {
        Self { from: self.from + by, to: self.to + by }
    }
}

/// Winding numbers of points inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Winding {
    /// All but 0.
    #[default]
    NonZero,
    /// Odd numbers.
    Odd,
}

impl Winding {
    const fn is_inside(self, number: i32) -> bool {
        match self {
            Self::NonZero => number != 0,
            Self::Odd => number % 2 != 0,
        }
    }
}

/// Outlines on the canvas.
#[derive(Clone, Debug)]
pub struct Outline {
    edges: Vec<Edge>,
    rule: Winding,
    low: DVec2,
    high: DVec2,
    /// Distance of two copies; 0 without copies.
    period: DVec2,
}

impl Outline {
    /// Closed outlines, by their edges, on a canvas of `size` mm that repeats by `tiling`. Edges that are not finite
    /// are skipped.
    pub fn new(mut edges: Vec<Edge>, (size, tiling): (DVec2, Tiling)) -> Self {
        edges.retain(|e| e.from.is_finite() && e.to.is_finite() && e.from != e.to);
        let low = edges.iter().map(|e| e.from).fold(DVec2::INFINITY, DVec2::min);
        let high = edges.iter().map(|e| e.from).fold(DVec2::NEG_INFINITY, DVec2::max);
        let period = DVec2::new(if tiling.x { size.x } else { 0.0 }, if tiling.y { size.y } else { 0.0 });
        Self { edges, rule: Winding::NonZero, low, high, period }
    }

    /// The same outlines with another inside.
    #[must_use]
    pub fn with_rule(self, rule: Winding) -> Self {
        Self { rule, ..self }
    }

    /// The edges.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The copies that can be nearest to, or surround, points between `first` and `last`.
    fn copies(&self, first: DVec2, last: DVec2) -> Vec<DVec2> {
        let (middle, radius) = (0.5 * (self.low + self.high), 0.5 * (self.high - self.low).length());
        let (at, around) = (0.5 * (first + last), 0.5 * (last - first).length());
        let nearest = DVec2::select(
            self.period.cmpgt(DVec2::ZERO),
            ((at - middle) / self.period.max(DVec2::splat(1e-9))).round(),
            DVec2::ZERO,
        );
        let away = (at - middle - nearest * self.period).length();
        // Upper bound of the distance to the nearest copy; others may come as close.
        let reach = away + 2.0 * (radius + around);
        let count = |period: f64| if period > 0.0 { ((reach + radius) / period).ceil() } else { 0.0 };
        let (nx, ny) = (count(self.period.x), count(self.period.y));
        let steps = |n: f64| std::iter::successors(Some(-n), move |i| (*i < n).then_some(i + 1.0));
        let all = steps(ny).flat_map(|j| steps(nx).map(move |i| DVec2::new(i, j)));
        let shifts = all.map(|step| (nearest + step) * self.period);
        let near = |shift: &DVec2| {
            let outside = (at - (self.high + *shift)).max(self.low + *shift - at).max(DVec2::ZERO);
            outside.length() <= reach
        };
        shifts.filter(near).collect()
    }

    /// Fills a window with distances, negative inside; `far` where there is no outline.
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn fill(&self, stop: &dyn Fn() -> bool, frame: &Frame, far: f32, out: &mut [f32]) {
        self.fill_within(stop, frame, (f64::INFINITY, far), out);
    }

    /// Like [`fill`](Self::fill), but exact only up to `reach` mm from the outline. Beyond, the distance may be `far`,
    /// which must be more than `reach`. Points far from all edges then cost nothing.
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn fill_within(&self, stop: &dyn Fn() -> bool, frame: &Frame, (reach, far): (f64, f32), out: &mut [f32]) {
        let rect = frame.window;
        if self.edges.is_empty() {
            out.fill(far);
            return;
        }
        let corner = |x: i32, y: i32| DVec2::from(frame.center(x, y));
        let (first, last) = (
            corner(rect.x, rect.y),
            corner(rect.x + rect.width.cast_signed() - 1, rect.y + rect.height.cast_signed() - 1),
        );
        let mut copies = self.copies(first, last);
        copies.retain(|shift| {
            let apart = (first - (self.high + *shift)).max(self.low + *shift - last);
            apart.max_element() <= reach
        });
        if copies.is_empty() {
            out.fill(far);
            return;
        }
        let all: Vec<Edge> = copies.iter().flat_map(|shift| self.edges.iter().map(|e| e.moved(*shift))).collect();
        let near = nearest(&all, first, last);
        for y in (0..rect.rows()).step_by(BLOCK) {
            if stop() {
                return;
            }
            for x in (0..rect.columns()).step_by(BLOCK) {
                let block = Window::of(
                    rect.x + index(x),
                    rect.y + index(y),
                    BLOCK.min(rect.columns() - x),
                    BLOCK.min(rect.rows() - y),
                );
                let (low, high) = (
                    corner(block.x, block.y),
                    corner(block.x + block.width.cast_signed() - 1, block.y + block.height.cast_signed() - 1),
                );
                let edges = nearest(&near, low, high);
                let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
                if edges.iter().all(|e| e.distance_squared(middle).sqrt() - radius > reach) {
                    for j in 0..block.rows() {
                        out[(y + j) * rect.columns() + x..][..block.columns()].fill(far);
                    }
                    continue;
                }
                for (j, at_y) in (0..block.rows()).zip(block.y..) {
                    let row = &mut out[(y + j) * rect.columns() + x..][..block.columns()];
                    for (out, at_x) in row.iter_mut().zip(block.x..) {
                        let p = corner(at_x, at_y);
                        let d = edges.iter().map(|e| e.distance_squared(p)).fold(f64::INFINITY, f64::min);
                        *out = narrow(d.sqrt());
                    }
                }
            }
        }
        inside(&all, self.rule, frame, out);
    }
}

/// The edges that can be nearest to a point between `low` and `high`.
fn nearest(edges: &[Edge], low: DVec2, high: DVec2) -> Vec<Edge> {
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let away: Vec<f64> = edges.iter().map(|e| e.distance_squared(middle)).collect();
    let least = away.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
    let most = (least + 2.0 * radius) * (1.0 + 1e-9) + 1e-12;
    edges.iter().zip(&away).filter(|(_, away)| **away <= most * most).map(|(e, _)| *e).collect()
}

/// Negates the distances of pixels that lie inside.
fn inside(edges: &[Edge], rule: Winding, frame: &Frame, out: &mut [f32]) {
    let rect = frame.window;
    let mut crossings: Vec<(f64, i32)> = Vec::new();
    let (top, bottom) = (frame.center(0, rect.y)[1], frame.center(0, rect.y + rect.height.cast_signed() - 1)[1]);
    let around = |e: &&Edge| e.from.y.min(e.to.y) <= bottom && e.from.y.max(e.to.y) > top;
    let edges: Vec<&Edge> = edges.iter().filter(around).collect();
    for (row, y) in out.chunks_exact_mut(rect.columns().max(1)).zip(rect.y..) {
        let at = frame.center(0, y)[1];
        crossings.clear();
        for e in &edges {
            let turns = i32::from(e.from.y <= at) - i32::from(e.to.y <= at);
            if turns != 0 {
                crossings.push((e.from.x + (at - e.from.y) / (e.to.y - e.from.y) * (e.to.x - e.from.x), turns));
            }
        }
        crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (mut next, mut winding) = (crossings.iter().peekable(), 0);
        for (out, x) in row.iter_mut().zip(rect.x..) {
            let at = frame.center(x, 0)[0];
            while let Some((_, turns)) = next.next_if(|(place, _)| *place <= at) {
                winding += turns;
            }
            if rule.is_inside(winding) {
                *out = -*out;
            }
        }
    }
}

/// Cuts a curve with two to four control points into straight segments, each no farther from it than `tolerance`.
pub fn flatten(points: &[DVec2], tolerance: f64, out: &mut Vec<Edge>) {
    let bend = points.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).length()).fold(0.0, f64::max);
    let degree = points.len().saturating_sub(1) as f64;
    let pieces = (degree * (degree - 1.0) * bend / (8.0 * tolerance)).sqrt().ceil().clamp(1.0, 256.0);
    let at = |t: f64| {
        let mut points = points.to_vec();
        while points.len() > 1 {
            points = points.windows(2).map(|w| w[0].lerp(w[1], t)).collect();
        }
        points.first().copied().unwrap_or_default()
    };
    let mut from = at(0.0);
    let mut k = 1.0;
    while k <= pieces {
        let to = if k == pieces { points.last().copied().unwrap_or_default() } else { at(k / pieces) };
        out.push(Edge { from, to });
        (from, k) = (to, k + 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_sign_of_far_distances() {
        let edges = polygon(&[(2.0, 2.0), (18.0, 2.0), (18.0, 13.0), (2.0, 13.0)]);
        for tiling in [Tiling::NONE, Tiling::BOTH] {
            let outline = Outline::new(edges.clone(), (DVec2::new(20.0, 15.0), tiling));
            for (x, y) in [(-40, -30), (0, 0), (300, 0), (40, 50)] {
                let frame = Frame::new(Window::of(x, y, 130, 111), [0.1, 0.1]);
                let [mut exact, mut near] = [(); 2].map(|()| vec![0.0; 130 * 111]);
                outline.fill(&|| false, &frame, 1e6, &mut exact);
                outline.fill_within(&|| false, &frame, (0.5, 7.0), &mut near);
                for (exact, near) in exact.iter().zip(&near) {
                    let same =
                        exact == near || (exact.abs() > 0.5 && near.abs() > 0.5 && (*near < 0.0) == (*exact < 0.0));
                    assert!(same, "{exact} {near}");
                }
            }
        }
    }

    fn polygon(corners: &[(f64, f64)]) -> Vec<Edge> {
        let corners: Vec<DVec2> = corners.iter().map(|(x, y)| DVec2::new(*x, *y)).collect();
        corners.iter().zip(corners.iter().cycle().skip(1)).map(|(a, b)| Edge { from: *a, to: *b }).collect()
    }

    #[test]
    fn a_frame_has_the_distances_of_two_boxes() {
        // The hole winds the other way.
        let mut edges = polygon(&[(2.0, 2.0), (12.0, 2.0), (12.0, 9.0), (2.0, 9.0)]);
        edges.extend(polygon(&[(4.0, 4.0), (4.0, 7.0), (10.0, 7.0), (10.0, 4.0)]));
        let size = DVec2::new(20.0, 15.0);
        for tiling in [Tiling::NONE, Tiling::BOTH] {
            let outline = Outline::new(edges.clone(), (size, tiling));
            let frame = Frame::new(Window::of(-30, -20, 130, 111), [0.17, 0.19]);
            let mut out = vec![0.0; 130 * 111];
            outline.fill(&|| false, &frame, 1e6, &mut out);
            for (k, got) in (0..).zip(&out) {
                let p = DVec2::from(frame.center(-30 + k % 130, -20 + k / 130));
                let rectangle = |p: DVec2, low: DVec2, high: DVec2| {
                    let q = (p - 0.5 * (low + high)).abs() - 0.5 * (high - low);
                    q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
                };
                let mut want = f64::INFINITY;
                for i in -2..=2 {
                    for j in -2..=2 {
                        if tiling == Tiling::NONE && (i, j) != (0, 0) {
                            continue;
                        }
                        let p = p + DVec2::new(f64::from(i), f64::from(j)) * size;
                        let outer = rectangle(p, DVec2::new(2.0, 2.0), DVec2::new(12.0, 9.0));
                        let hole = rectangle(p, DVec2::new(4.0, 4.0), DVec2::new(10.0, 7.0));
                        want = want.min(outer.max(-hole));
                    }
                }
                assert!((f64::from(*got) - want).abs() < 1e-5, "{p}: {got} {want}");
            }
        }
    }

    #[test]
    fn windows_are_crops() {
        let mut edges = Vec::new();
        let arc = [DVec2::new(3.0, 3.0), DVec2::new(9.0, 1.0), DVec2::new(8.0, 9.0), DVec2::new(3.0, 8.0)];
        flatten(&arc, 1e-3, &mut edges);
        flatten(&[arc[3], arc[0]], 1e-3, &mut edges);
        let outline = Outline::new(edges, (DVec2::splat(10.0), Tiling::BOTH));
        let fill = |rect: Window| {
            let mut out = vec![0.0; rect.len()];
            outline.fill(&|| false, &Frame::new(rect, [0.1, 0.1]), 0.0, &mut out);
            out
        };
        let (whole, part) = (fill(Window::of(-5, -9, 120, 119)), fill(Window::of(31, 20, 40, 37)));
        for (k, v) in part.iter().enumerate() {
            assert_eq!(v.to_bits(), whole[(20 + 9 + k / 40) * 120 + 31 + 5 + k % 40].to_bits());
        }
    }

    #[test]
    fn curves_are_followed() {
        let mut edges = Vec::new();
        // A quarter of a circle, up to 3·10⁻⁴ of its radius.
        let c = 0.552_284_75 * 10.0;
        let arc = [DVec2::new(10.0, 0.0), DVec2::new(10.0, c), DVec2::new(c, 10.0), DVec2::new(0.0, 10.0)];
        flatten(&arc, 1e-3, &mut edges);
        assert!(edges.len() > 20 && edges.len() < 120, "{}", edges.len());
        let off = |p: DVec2| (p.length() - 10.0).abs();
        assert!(edges.iter().all(|e| off(e.from.lerp(e.to, 0.5)) < 4.1e-3));
        assert_eq!(edges.last().unwrap().to, arc[3]);
    }
}
