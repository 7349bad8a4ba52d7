//! Draws paths: lines and Bézier curves, cut into straight pieces.
use crate::shape::outline::{Edge, flatten};
use glam::DVec2;
use shibo_value::{Path, Polyline, Tiling};

/// Maximum distance in mm between straight pieces and the curve they replace.
pub const TOLERANCE: f64 = 5e-4;

/// Maximum number of straight pieces of a path.
pub const MOST_PIECES: usize = 4_000_000;

/// Maximum distance in mm of ends that count as the same point.
const SAME: f64 = 1e-6;

/// Draws curves one after another, in mm.
#[derive(Clone, Debug, Default)]
pub struct Pen {
    curves: Vec<Polyline>,
    open: Vec<DVec2>,
    pieces: usize,
    scratch: Vec<Edge>,
}

impl Pen {
    /// Begins a curve.
    pub fn move_to(&mut self, to: DVec2) {
        self.lift(false);
        self.open.push(to);
    }

    /// The current point.
    pub fn at(&self) -> DVec2 {
        self.open.last().copied().unwrap_or_default()
    }

    /// Number of straight pieces drawn.
    pub fn pieces(&self) -> usize {
        self.pieces
    }

    fn add(&mut self, to: DVec2) {
        if to.is_finite() && self.open.last() != Some(&to) {
            self.open.push(to);
            self.pieces += 1;
        }
    }

    /// A line.
    pub fn line_to(&mut self, to: DVec2) {
        self.add(to);
    }

    /// A Bézier curve from the current point; `points` are the control points and the end.
    pub fn curve_to(&mut self, points: &[DVec2]) {
        let mut all = vec![self.at()];
        all.extend_from_slice(points);
        self.scratch.clear();
        let mut edges = std::mem::take(&mut self.scratch);
        flatten(&all, TOLERANCE, &mut edges);
        edges.iter().for_each(|edge| self.add(edge.to));
        self.scratch = edges;
    }

    /// A smooth curve through points (Catmull-Rom): from the first one around to itself if `closed`, else from the
    /// first to the last. With `around`, the curve continues after its end like its beginning, shifted by this vector.
    pub fn through(&mut self, points: &[DVec2], closed: bool, around: Option<DVec2>) {
        let Some((first, n)) = points.first().zip(i32::try_from(points.len()).ok()) else { return };
        // Points before the first and after the last one.
        let at = |i: i32| {
            let wrapped = |i: i32, n: i32| usize::try_from(i.rem_euclid(n)).unwrap_or(0);
            match around {
                Some(shift) => points[wrapped(i, n - 1)] + shift * f64::from(i.div_euclid(n - 1)),
                None if closed => points[wrapped(i, n)],
                None => points[usize::try_from(i.clamp(0, n - 1)).unwrap_or(0)],
            }
        };
        self.move_to(*first);
        for i in 0..if closed && around.is_none() { n } else { n - 1 } {
            let [before, from, to, after] = [i - 1, i, i + 1, i + 2].map(at);
            self.curve_to(&[from + (to - before) / 6.0, to - (after - from) / 6.0, to]);
        }
        if closed && around.is_none() {
            self.close();
        }
    }

    /// Ends the curve at its beginning.
    pub fn close(&mut self) {
        if let Some(first) = self.open.first().copied() {
            if let Some(last) = self.open.last_mut().filter(|last| last.distance(first) < SAME) {
                *last = first;
            } else {
                self.add(first);
            }
            self.lift(true);
            // A following segment without `move_to` begins here.
            self.open.push(first);
        }
    }

    fn lift(&mut self, closed: bool) {
        let points = std::mem::take(&mut self.open);
        if points.len() > 1 {
            self.curves.push(Polyline { points, closed });
        }
    }

    /// The path, on a canvas of `size` mm. Curves that end where they begin are closed. In directions in which the
    /// canvas repeats, so are curves that end a whole number of canvases away.
    pub fn finish(mut self, size: DVec2, tiling: Tiling) -> Path {
        self.lift(false);
        for curve in &mut self.curves {
            let (Some(first), Some(last)) = (curve.points.first().copied(), curve.points.last_mut()) else { continue };
            if let Some(shift) = around(first, *last, size, tiling) {
                *last = first + shift;
                curve.closed = true;
            }
        }
        // Removes curves that are too short to have a direction.
        self.curves.retain(|curve| curve.points.len() > 2 || curve.points[0].distance(curve.points[1]) > SAME);
        Path { curves: self.curves, size_mm: size, periodic: tiling }
    }
}

/// Shift from `first` to `last` in mm, if it is zero or whole canvases in directions in which the canvas repeats.
pub fn around(first: DVec2, last: DVec2, size: DVec2, tiling: Tiling) -> Option<DVec2> {
    let way = last - first;
    let steps = (way / size).round();
    let whole = DVec2::new(if tiling.x { steps.x } else { 0.0 }, if tiling.y { steps.y } else { 0.0 }) * size;
    ((way - whole).length() < SAME.max(1e-9 * way.length())).then_some(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: DVec2 = DVec2::new(20.0, 10.0);

    #[test]
    fn curves_are_open_closed_or_go_round() {
        let mut pen = Pen::default();
        pen.move_to(DVec2::new(1.0, 1.0));
        pen.line_to(DVec2::new(5.0, 1.0));
        pen.line_to(DVec2::new(5.0, 1.0));
        pen.line_to(DVec2::new(5.0, 4.0));
        pen.close();
        pen.line_to(DVec2::new(0.0, 0.0));
        pen.move_to(DVec2::new(3.0, 2.0));
        pen.line_to(DVec2::new(13.0, 6.0));
        pen.line_to(DVec2::new(23.0, -8.0));
        pen.move_to(DVec2::new(9.0, 9.0));
        let both = pen.clone().finish(SIZE, Tiling::BOTH);
        let points = |path: &Path| path.curves.iter().map(|c| (c.points.len(), c.closed)).collect::<Vec<_>>();
        assert_eq!(points(&both), [(4, true), (2, false), (3, true)]);
        assert_eq!(points(&pen.finish(SIZE, Tiling { x: true, y: false })), [(4, true), (2, false), (3, false)]);
    }

    #[test]
    fn smooth_curves_go_through_their_places() {
        // An approximate circle, and a wave that goes around the canvas: both are smooth at the joint too.
        let circle: Vec<DVec2> = (0..12).map(|k| DVec2::from_angle(f64::from(k) * 30f64.to_radians())).collect();
        let mut pen = Pen::default();
        pen.through(&circle, true, None);
        let path = pen.finish(SIZE, Tiling::NONE);
        let round = &path.curves[0];
        assert!(round.closed && round.points.iter().all(|p| (p.length() - 1.0).abs() < 2e-3));
        assert!((round.length() - std::f64::consts::TAU).abs() < 0.01);
        let wave = [(0.0, 5.0), (5.0, 6.0), (10.0, 5.0), (15.0, 4.0), (20.0, 5.0)].map(|(x, y)| DVec2::new(x, y));
        let mut pen = Pen::default();
        pen.through(&wave, false, Some(DVec2::new(20.0, 0.0)));
        let path = pen.finish(SIZE, Tiling::BOTH);
        let points = &path.curves[0].points;
        assert!(path.curves[0].closed && wave.iter().all(|p| points.iter().any(|q| p.distance(*q) < 1e-9)));
        let slope = |a: DVec2, b: DVec2| (b.y - a.y) / (b.x - a.x);
        let n = points.len();
        assert!((slope(points[0], points[1]) - slope(points[n - 2], points[n - 1])).abs() < 0.02);
    }
}
