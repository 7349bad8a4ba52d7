//! Positions relative to a path: along it and across it, and the direction of the path there.
//!
//! A window is cut into small blocks. Each block uses only the pieces that can be nearest to one of its pixels.
//! O(pieces near the window · blocks + pixels · pieces near each).
use super::index::{Index, Near, corners};
use crate::ground::number::index_u32;
use crate::ground::window::{Frame, WindowExt as _, index};
use glam::DVec2;
use shibo_value::{Path, Polyline, Window};

/// Side of a block in pixels.
const BLOCK: usize = 16;

/// The maximum search distance in mm; on a repeating canvas, in canvases.
const FARTHEST: f64 = 1e9;
const MOST_CANVASES: f64 = 8.0;

/// The cosine of the largest turn at a joint of two pieces that still counts as smooth: 12°.
const SMOOTH: f64 = 0.978;

/// Position of a point relative to the nearest curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beside {
    /// mm along the curve from its beginning. Beyond an open end the curve is extended straight: values are below 0, or
    /// above the curve's length.
    pub along: f64,
    /// mm to the side: positive to the right in the direction of the curve, in a picture whose y points down.
    pub across: f64,
    /// mm to the nearest point of the curve.
    pub distance: f64,
    /// The unit tangent of the curve.
    pub tangent: DVec2,
    /// Index of the curve, from 0.
    pub curve: u32,
}

/// A straight piece of a curve.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: DVec2,
    /// Its unit direction.
    way: DVec2,
    length: f64,
    /// Position of its beginning along the curve, mm.
    along: f64,
    /// The direction of the curve at its two ends, midway between those of the pieces that meet there.
    joints: [DVec2; 2],
    /// The same where the curve is smooth; elsewhere the piece's own direction.
    tangents: [DVec2; 2],
    /// Whether the curve ends at the piece's beginning and at its end.
    ends: [bool; 2],
    curve: u32,
}

impl Piece {
    #[inline(always)]
    fn distance_squared(&self, p: DVec2) -> f64 {
        let to = p - self.from;
        let t = to.dot(self.way).clamp(0.0, self.length);
        (to - self.way * t).length_squared()
    }

    fn beside(&self, p: DVec2) -> Beside {
        let to = p - self.from;
        let (t, side) = (to.dot(self.way), self.way.perp_dot(to));
        let clamped = t.clamp(0.0, self.length);
        let distance = (to - self.way * clamped).length();
        let beyond = if t < 0.0 { Some(0) } else { (t > self.length).then_some(1) };
        let (along, across) = match beyond {
            Some(end) if self.ends[end] => (t, side),
            // Around a joint, the side is determined for both pieces together.
            Some(end) => {
                let corner = self.from + self.way * clamped;
                (clamped, distance.copysign(self.joints[end].perp_dot(p - corner)))
            }
            None => (t, side),
        };
        let share = if self.length > 0.0 { clamped / self.length } else { 0.0 };
        let tangent = self.tangents[0].lerp(self.tangents[1], share).normalize_or(self.way);
        Beside { along: self.along + along, across, distance, tangent, curve: self.curve }
    }
}

/// The pieces of a path, sorted into bins.
#[derive(Clone, Debug)]
pub struct Nearest {
    pieces: Vec<Piece>,
    index: Index,
}

impl Nearest {
    /// Sorts the pieces of a path. O(pieces).
    pub fn new(path: &Path) -> Self {
        let mut pieces = Vec::with_capacity(path.len());
        for (n, curve) in path.curves.iter().enumerate() {
            add(curve, index_u32(n), &mut pieces);
        }
        let boxes: Vec<[DVec2; 2]> = pieces.iter().map(|p| [p.from, p.from + p.way * p.length]).collect();
        Self { index: Index::new(&boxes, (path.size_mm, path.periodic)), pieces }
    }

    /// Approximate memory in bytes.
    pub fn bytes(&self) -> usize {
        self.pieces.len() * (size_of::<Piece>() + 24)
    }

    /// Calls `put` for each pixel of a window, row by row, with its index and its position; `None` if no curve is
    /// within `reach` mm.
    pub fn fill(
        &self,
        stop: &dyn Fn() -> bool,
        frame: &Frame,
        reach: f64,
        put: &mut dyn FnMut(usize, Option<&Beside>),
    ) {
        let rect = frame.window;
        if rect.is_empty() {
            return;
        }
        let all: Vec<Near> = self.index.near_window(frame, reach);
        let near = self.nearest(&all, corners(frame), reach);
        for y in (0..rect.rows()).step_by(BLOCK) {
            if stop() {
                return;
            }
            for x in (0..rect.columns()).step_by(BLOCK) {
                let (columns, rows) = (BLOCK.min(rect.columns() - x), BLOCK.min(rect.rows() - y));
                let block = Frame { window: Window::of(rect.x + index(x), rect.y + index(y), columns, rows), ..*frame };
                let near = self.nearest(&near, corners(&block), reach);
                for k in 0..columns * rows {
                    let (i, j) = (k % columns, k / columns);
                    let p = DVec2::from(frame.center(block.window.x + index(i), block.window.y + index(j)));
                    let beside = self.beside(&near, p).filter(|beside| beside.distance <= reach);
                    put((y + j) * rect.columns() + x + i, beside.as_ref());
                }
            }
        }
    }

    /// True if a curve is within `reach` mm of a point.
    pub(super) fn is_within(&self, p: DVec2, reach: f64) -> bool {
        let mut found = false;
        self.index.visit(p - reach, p + reach, |Near { id, shift }| {
            found = found || self.pieces[id as usize].distance_squared(p - shift) <= reach * reach;
        });
        found
    }

    /// Position of one point, if a curve is within `reach` mm.
    pub fn at(&self, p: DVec2, reach: f64) -> Option<Beside> {
        let near = self.index.near(p - reach, p + reach);
        self.beside(&near, p).filter(|beside| beside.distance <= reach)
    }

    /// A distance in mm within which every pixel of a window has a curve; 0 if there is no curve, or none within many
    /// canvases on a repeating canvas.
    pub fn farthest(&self, frame: &Frame) -> f64 {
        let [low, high] = corners(frame);
        let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        let period = self.index.period().max_element();
        let most = if period > 0.0 { MOST_CANVASES * period + 2.0 * radius } else { FARTHEST };
        let mut reach = 2.0 * radius + 1.0;
        while !self.pieces.is_empty() && reach < 2.0 * most {
            if let Some(beside) = self.at(middle, reach) {
                return beside.distance + radius;
            }
            reach *= 2.0;
        }
        0.0
    }

    /// Position relative to the nearest piece, the first one of several.
    fn beside(&self, near: &[Near], p: DVec2) -> Option<Beside> {
        let (mut least, mut found) = (f64::INFINITY, None);
        for near in near {
            let distance = self.pieces[near.id as usize].distance_squared(p - near.shift);
            if distance < least {
                (least, found) = (distance, Some(near));
            }
        }
        found.map(|near| self.pieces[near.id as usize].beside(p - near.shift))
    }

    /// The pieces within `reach` that can be nearest to a point of a rectangle, in the same order.
    fn nearest(&self, near: &[Near], [low, high]: [DVec2; 2], reach: f64) -> Vec<Near> {
        let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        let away = |near: &Near| self.pieces[near.id as usize].distance_squared(middle - near.shift);
        let away: Vec<f64> = near.iter().map(away).collect();
        let least = away.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
        let most = (least + 2.0 * radius).min(reach + radius) * (1.0 + 1e-9) + 1e-9;
        near.iter().zip(&away).filter(|(_, away)| **away <= most * most).map(|(near, _)| *near).collect()
    }
}

/// The pieces of a curve.
fn add(curve: &Polyline, number: u32, out: &mut Vec<Piece>) {
    let first = out.len();
    let mut along = 0.0;
    for pair in curve.points.windows(2) {
        let length = pair[0].distance(pair[1]);
        let way = (pair[1] - pair[0]).normalize_or_zero();
        if way == DVec2::ZERO {
            continue;
        }
        let both = [way; 2];
        out.push(Piece {
            from: pair[0],
            way,
            length,
            along,
            joints: both,
            tangents: both,
            ends: [false; 2],
            curve: number,
        });
        along += length;
    }
    let count = out.len() - first;
    let pieces = &mut out[first..];
    if count == 0 {
        return;
    }
    let joints = if curve.closed { count } else { count - 1 };
    for k in 0..joints {
        let next = (k + 1) % count;
        let (a, b) = (pieces[k].way, pieces[next].way);
        let joint = (a + b).normalize_or(b);
        let smooth = a.dot(b) > SMOOTH;
        pieces[k].joints[1] = joint;
        pieces[next].joints[0] = joint;
        if smooth {
            pieces[k].tangents[1] = joint;
            pieces[next].tangents[0] = joint;
        }
    }
    if !curve.closed {
        pieces[0].ends[0] = true;
        pieces[count - 1].ends[1] = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::pen::Pen;
    use shibo_value::Tiling;

    fn path(curves: &[(&[(f64, f64)], bool)], tiling: Tiling) -> Path {
        let mut pen = Pen::default();
        for (points, closed) in curves {
            let mut points = points.iter().map(|(x, y)| DVec2::new(*x, *y));
            pen.move_to(points.next().unwrap());
            points.for_each(|p| pen.line_to(p));
            if *closed {
                pen.close();
            }
        }
        pen.finish(DVec2::new(20.0, 15.0), tiling)
    }

    #[test]
    fn extends_open_lines_beyond_their_ends() {
        let path = path(&[(&[(3.0, 5.0), (10.0, 5.0)], false)], Tiling::NONE);
        let nearest = Nearest::new(&path);
        let at = |x, y| nearest.at(DVec2::new(x, y), 50.0).map(|b| (b.along, b.across, b.distance));
        assert_eq!(at(5.0, 7.0), Some((2.0, 2.0, 2.0)));
        assert_eq!(at(5.0, 4.0), Some((2.0, -1.0, 1.0)));
        assert_eq!(at(0.0, 9.0), Some((-3.0, 4.0, 5.0)));
        assert_eq!(at(16.0, -3.0), Some((13.0, -8.0, 10.0)));
        assert_eq!(nearest.at(DVec2::new(0.0, 9.0), 4.9), None);
    }

    #[test]
    fn windows_agree_with_a_search_through_all_pieces() {
        let zigzag: &[(f64, f64)] = &[(1.0, 2.0), (6.0, 12.0), (8.0, 3.0), (15.0, 9.0), (21.0, 2.0)];
        let ring: &[(f64, f64)] = &[(12.0, 10.0), (17.0, 10.0), (17.0, 13.0), (12.0, 14.0)];
        for tiling in [Tiling::NONE, Tiling::BOTH] {
            let path = path(&[(zigzag, false), (ring, true)], tiling);
            let nearest = Nearest::new(&path);
            let frame = Frame::new(Window::of(-20, -13, 101, 77), [0.31, 0.29]);
            for reach in [1.5, 40.0] {
                let mut out = vec![None; 101 * 77];
                nearest.fill(&|| false, &frame, reach, &mut |k, beside| out[k] = beside.copied());
                for (k, got) in (0..).zip(&out) {
                    let p = DVec2::from(frame.center(-20 + k % 101, -13 + k / 101));
                    let mut want = (f64::INFINITY, 0);
                    for (i, j) in (-4..=4).flat_map(|i| (-4..=4).map(move |j| (f64::from(i), f64::from(j)))) {
                        if tiling == Tiling::NONE && (i, j) != (0.0, 0.0) {
                            continue;
                        }
                        for (n, curve) in path.curves.iter().enumerate() {
                            for pair in curve.points.windows(2) {
                                let a = pair[0] + DVec2::new(i * 20.0, j * 15.0);
                                let way = pair[1] - pair[0];
                                let t = ((p - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                                let d = p.distance(a + way * t);
                                want = if d < want.0 { (d, n) } else { want };
                            }
                        }
                    }
                    assert_eq!(got.is_some(), want.0 <= reach, "{p}");
                    let Some(got) = got else { continue };
                    assert!((got.distance - want.0).abs() < 1e-9, "{p} {got:?} {want:?}");
                    let inside = got.curve == 1 || got.across.abs() < got.distance + 1e-9;
                    assert!(inside && (got.tangent.length() - 1.0).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn every_pixel_has_a_curve_within_the_farthest_distance() {
        let corner: &[(f64, f64)] = &[(90.0, 80.0), (95.0, 80.0), (95.0, 84.0)];
        for (tiling, window) in [(Tiling::NONE, Window::of(-40, 9, 50, 30)), (Tiling::BOTH, Window::of(3, 4, 1, 1))] {
            let nearest = Nearest::new(&path(&[(corner, false)], tiling));
            let frame = Frame::new(window, [0.31, 0.29]);
            let reach = nearest.farthest(&frame);
            let mut count = 0;
            nearest
                .fill(&|| false, &frame, reach * (1.0 + 1e-9), &mut |_, beside| count += usize::from(beside.is_some()));
            assert_eq!(count, window.len(), "{reach}");
        }
        assert_eq!(Nearest::new(&path(&[], Tiling::BOTH)).farthest(&Frame::new(Window::of(0, 0, 9, 9), [1.0; 2])), 0.0);
    }

    #[test]
    fn sides_of_a_closed_curve_are_inside_and_outside() {
        // A star with sharp corners, clockwise in the picture, so the inside is on the right.
        let corner = |k: u32| {
            let radius = if k.is_multiple_of(2) { 6.0 } else { 1.5 };
            DVec2::new(10.0, 7.0) + DVec2::from_angle(f64::from(k) * 36f64.to_radians()) * radius
        };
        let corners: Vec<(f64, f64)> = (0..10).map(|k| corner(k).into()).collect();
        let path = path(&[(&corners, true)], Tiling::NONE);
        let nearest = Nearest::new(&path);
        for k in 0..3600 {
            let p = DVec2::new(10.0, 7.0) + DVec2::from_angle(f64::from(k) * 0.37) * (f64::from(k) * 0.003);
            let crossings = (0..10).filter(|n| {
                let (a, b) = (corner(*n), corner((n + 1) % 10));
                (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
            });
            let inside = crossings.count() % 2 == 1;
            let got = nearest.at(p, 30.0).unwrap();
            assert_eq!(got.across > 0.0, inside, "{p} {got:?}");
        }
    }

    #[test]
    fn tangents_turn_smoothly_along_a_curve() {
        let mut pen = Pen::default();
        let c = 0.552_284_75 * 5.0;
        pen.move_to(DVec2::new(5.0, 0.0));
        pen.curve_to(&[DVec2::new(5.0, c), DVec2::new(c, 5.0), DVec2::new(0.0, 5.0)]);
        let nearest = Nearest::new(&pen.finish(DVec2::splat(20.0), Tiling::NONE));
        for k in 1..90 {
            let at = DVec2::from_angle(f64::from(k).to_radians());
            let beside = nearest.at(at * 4.0, 2.0).unwrap();
            assert!(beside.tangent.dot(at).abs() < 5e-3 && (beside.across - 1.0).abs() < 2e-3);
            assert!((beside.along - 5.0 * f64::from(k).to_radians()).abs() < 0.02);
        }
    }
}
