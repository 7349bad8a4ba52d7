//! Mirrored paths.
use super::pen::Pen;
use glam::DVec2;
use shibo_value::{Path, Polyline};

/// Maximum distance of an end from the axis that counts as on it, mm.
const ON_AXIS: f64 = 1e-3;

/// A straight line that mirrors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// A point of the line, mm.
    pub through: DVec2,
    /// Its unit direction.
    pub way: DVec2,
}

impl Axis {
    /// The mirror image of a point.
    pub fn mirror(&self, p: DVec2) -> DVec2 {
        let to = p - self.through;
        self.through + 2.0 * to.dot(self.way) * self.way - to
    }

    fn is_on(&self, p: DVec2) -> bool {
        self.way.perp_dot(p - self.through).abs() < ON_AXIS
    }

    /// The image of a curve. It runs backwards, so the same things lie on its right.
    fn image(&self, curve: &Polyline) -> Polyline {
        let points = curve.points.iter().rev().map(|p| self.mirror(*p)).collect();
        Polyline { points, closed: curve.closed }
    }
}

/// The image of a path; with `both`, after the path itself. An open curve that ends on the axis is then joined to its
/// image, and closed if both ends are there. O(points).
pub fn mirror(path: &Path, axis: &Axis, both: bool) -> Path {
    let mut pen = Pen::default();
    let mut draw = |curve: &Polyline| {
        let Some((first, rest)) = curve.points.split_first() else { return };
        pen.move_to(*first);
        rest.iter().for_each(|p| pen.line_to(*p));
    };
    let mut images = Vec::new();
    for curve in &path.curves {
        let image = axis.image(curve);
        let on_axis = [curve.points.first(), curve.points.last()].map(|end| end.is_some_and(|end| axis.is_on(*end)));
        match on_axis {
            _ if !both => images.push(image),
            [begins, ends] if !curve.closed && (begins || ends) => {
                let parts = if ends { [curve, &image] } else { [&image, curve] };
                let mut points = parts[0].points.clone();
                points.extend(&parts[1].points[1..]);
                if let (true, true, Some(last)) = (begins, ends, points.len().checked_sub(1)) {
                    points[last] = points[0];
                }
                draw(&Polyline { points, closed: false });
            }
            _ => {
                draw(curve);
                images.push(image);
            }
        }
    }
    images.iter().for_each(&mut draw);
    pen.finish(path.size_mm, path.periodic)
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
        }
        pen.finish(DVec2::splat(20.0), Tiling::BOTH)
    }

    const UPRIGHT: Axis = Axis { through: DVec2::new(10.0, 3.0), way: DVec2::Y };

    fn area(curve: &Polyline) -> f64 {
        curve.points.windows(2).map(|pair| 0.5 * pair[0].perp_dot(pair[1])).sum()
    }

    #[test]
    fn images_have_the_same_side() {
        let square: &[(f64, f64)] = &[(2.0, 2.0), (6.0, 2.0), (6.0, 5.0), (2.0, 2.0)];
        let image = mirror(&path(&[square]), &UPRIGHT, false);
        assert_eq!(image.curves.len(), 1);
        assert_eq!(image.curves[0].points[1], DVec2::new(14.0, 5.0));
        assert!((area(&image.curves[0]) - 6.0).abs() < 1e-9, "{}", area(&image.curves[0]));
        let both = mirror(&path(&[square]), &UPRIGHT, true);
        assert_eq!(both.curves.iter().map(|c| c.closed).collect::<Vec<_>>(), [true, true]);
        assert_eq!(both.curves[1], image.curves[0]);
    }

    #[test]
    fn halves_that_end_on_the_axis_are_joined() {
        let half: &[(f64, f64)] = &[(10.0, 2.0), (15.0, 4.0), (10.0, 9.0)];
        let whole = mirror(&path(&[half]), &UPRIGHT, true);
        assert_eq!((whole.curves.len(), whole.curves[0].closed, whole.curves[0].points.len()), (1, true, 5));
        assert!((area(&whole.curves[0]) - 35.0).abs() < 1e-9);
        for half in [[(10.0, 2.0), (15.0, 4.0)], [(15.0, 4.0), (10.0, 2.0)]] {
            let roof = mirror(&path(&[&half]), &UPRIGHT, true);
            assert_eq!((roof.curves.len(), roof.curves[0].closed, roof.curves[0].points.len()), (1, false, 3));
            assert_eq!(roof.curves[0].points[1], DVec2::new(10.0, 2.0));
        }
    }

    #[test]
    fn lines_around_the_canvas_stay_closed() {
        let around = mirror(&path(&[&[(0.0, 5.0), (20.0, 25.0)]]), &UPRIGHT, true);
        assert_eq!(around.curves.iter().map(|c| c.closed).collect::<Vec<_>>(), [true, true]);
    }
}
