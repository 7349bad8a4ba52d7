//! Parallel lines within closed curves.
use super::pen::Pen;
use glam::DVec2;
use shibo_value::Path;

/// Lines that fill closed curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hatch {
    /// Distance between lines, mm.
    pub pitch: f64,
    /// Unit direction of the lines.
    pub way: DVec2,
    /// Length of the shortest line, mm.
    pub shortest: f64,
    /// True if every second line runs backwards.
    pub turns: bool,
}

impl Hatch {
    /// Upper bound of the number of lines, if each row has one.
    pub fn rows(&self, path: &Path) -> f64 {
        let across = |p: &DVec2| self.way.perp_dot(*p);
        let points = || closed(path).flat_map(|points| points.iter().map(across));
        let (low, high) = (points().fold(f64::INFINITY, f64::min), points().fold(f64::NEG_INFINITY, f64::max));
        ((high - low) / self.pitch).ceil().max(0.0) + 1.0
    }

    /// The parts of the lines that lie within curves, row by row. A point is inside if the curves wind around it. Open
    /// curves, and those that go around the canvas, enclose nothing. Lines lie at odd multiples of half the pitch from
    /// the origin, for any path. `None` if stopped. O((pieces + crossings) · log).
    pub fn lines(&self, path: &Path, stop: &dyn Fn() -> bool) -> Option<Path> {
        // Crossings: the row, the place along it, and by how much the winding number changes.
        let mut crossings: Vec<(f64, f64, i32)> = Vec::new();
        let turned = |p: DVec2| DVec2::new(self.way.dot(p), self.way.perp_dot(p) / self.pitch);
        for points in closed(path) {
            if stop() {
                return None;
            }
            for pair in points.windows(2) {
                let [a, b] = [turned(pair[0]), turned(pair[1])];
                let (low, high, turn) = if a.y < b.y { (a, b, 1) } else { (b, a, -1) };
                let mut row = (low.y + 0.5).floor();
                while row + 0.5 <= high.y {
                    if row + 0.5 > low.y {
                        let share = (row + 0.5 - low.y) / (high.y - low.y);
                        crossings.push((row, low.x + share * (high.x - low.x), turn));
                    }
                    row += 1.0;
                }
            }
        }
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut pen = Pen::default();
        let (mut winding, mut from) = (0, 0.0);
        for (row, at, turn) in crossings {
            if winding == 0 {
                from = at;
            }
            winding += turn;
            if winding == 0 && at - from >= self.shortest && at > from {
                let place = |along: f64| self.way * along + self.way.perp() * ((row + 0.5) * self.pitch);
                let back = self.turns && row.rem_euclid(2.0) == 1.0;
                let (from, to) = if back { (at, from) } else { (from, at) };
                pen.move_to(place(from));
                pen.line_to(place(to));
            }
        }
        Some(pen.finish(path.size_mm, path.periodic))
    }
}

/// The curves that end where they begin.
pub fn closed(path: &Path) -> impl Iterator<Item = &[DVec2]> {
    let ends = |points: &[DVec2]| points.first() == points.last();
    path.curves.iter().filter(move |curve| curve.closed && ends(&curve.points)).map(|curve| &curve.points[..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::Tiling;

    fn path(curves: &[&[(f64, f64)]]) -> Path {
        let mut pen = Pen::default();
        for points in curves {
            let mut points = points.iter().map(|(x, y)| DVec2::new(*x, *y));
            pen.move_to(points.next().unwrap());
            points.for_each(|p| pen.line_to(p));
            pen.close();
        }
        pen.finish(DVec2::splat(20.0), Tiling::BOTH)
    }

    const HATCH: Hatch = Hatch { pitch: 1.0, way: DVec2::X, shortest: 0.0, turns: false };

    /// A frame: a square with a hole that winds the other way.
    fn frame() -> Path {
        path(&[
            &[(2.0, 2.0), (12.0, 2.0), (12.0, 9.0), (2.0, 9.0)],
            &[(4.0, 4.0), (4.0, 7.0), (10.0, 7.0), (10.0, 4.0)],
        ])
    }

    #[test]
    fn lines_leave_holes_out() {
        let lines = HATCH.lines(&frame(), &|| false).unwrap();
        // Seven rows, three of them in two parts.
        assert_eq!(lines.curves.len(), 10);
        assert_eq!(lines.curves[0].points, [DVec2::new(2.0, 2.5), DVec2::new(12.0, 2.5)]);
        assert_eq!(lines.curves[3].points, [DVec2::new(10.0, 4.5), DVec2::new(12.0, 4.5)]);
        let length: f64 = lines.curves.iter().map(shibo_value::Polyline::length).sum();
        assert!((length - (7.0 * 10.0 - 3.0 * 6.0)).abs() < 1e-9);
        let back = Hatch { turns: true, shortest: 3.0, ..HATCH }.lines(&frame(), &|| false).unwrap();
        assert_eq!(back.curves.len(), 4);
        assert!(back.curves[0].points[0].x < back.curves[0].points[1].x);
        assert!(back.curves[1].points[0].x > back.curves[1].points[1].x);
        assert!(HATCH.rows(&frame()) >= 7.0 && HATCH.lines(&frame(), &|| true).is_none());
    }

    #[test]
    fn turned_lines_cover_the_same_area() {
        for k in 0..12 {
            let way = DVec2::from_angle(f64::from(k) * 0.4);
            let fine = Hatch { pitch: 0.01, way, ..HATCH }.lines(&frame(), &|| false).unwrap();
            let area: f64 = fine.curves.iter().map(|c| c.length() * 0.01).sum();
            assert!((area - 52.0).abs() < 0.1, "{k}: {area}");
        }
    }

    #[test]
    fn open_curves_enclose_nothing() {
        let mut pen = Pen::default();
        pen.move_to(DVec2::new(1.0, 1.0));
        pen.line_to(DVec2::new(9.0, 9.0));
        pen.move_to(DVec2::new(0.0, 4.0));
        pen.line_to(DVec2::new(20.0, 4.0));
        let open = pen.finish(DVec2::splat(20.0), Tiling::BOTH);
        assert!(HATCH.lines(&open, &|| false).unwrap().is_empty());
    }
}
