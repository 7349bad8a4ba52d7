//! Makes curves smooth, and removes points that they do not need.
use super::pen::Pen;
use glam::DVec2;
use shibo_value::{Path, Polyline};

/// Points for one standard deviation of the smoothing.
const STEPS: f64 = 3.0;

/// Range of the smoothing, in points.
const RANGE: i64 = 9;

/// Maximum number of points that a straight piece replaces.
const MOST: usize = 32;

/// A curve as points at equal distances.
struct Even {
    points: Vec<DVec2>,
    /// The way around a closed curve: zero, or whole canvases.
    around: Option<DVec2>,
}

impl Even {
    fn new(curve: &Polyline, step: f64) -> Self {
        let length = curve.length();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a small number")]
        let count = (length / step).round().clamp(8.0, 4e6) as usize;
        let mut points = Vec::with_capacity(count + 1);
        let (mut piece, mut before) = (0, 0.0);
        for n in 0..=count {
            let along = length * n as f64 / count as f64;
            let long = |piece: usize| curve.points[piece].distance(curve.points[piece + 1]);
            while piece + 2 < curve.points.len() && before + long(piece) < along {
                before += long(piece);
                piece += 1;
            }
            let share = ((along - before) / long(piece).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            points.push(curve.points[piece].lerp(curve.points[piece + 1], share));
        }
        let around = curve.closed.then(|| curve.points[curve.points.len() - 1] - curve.points[0]);
        if around.is_some() {
            points.pop();
        }
        Self { points, around }
    }

    /// Point n. A closed curve continues around; an open one is mirrored at its ends.
    fn at(&self, n: i64) -> DVec2 {
        let count = i64::try_from(self.points.len()).unwrap_or(i64::MAX);
        let point = |n: i64| self.points[usize::try_from(n.clamp(0, count - 1)).unwrap_or(0)];
        match self.around {
            Some(around) => point(n.rem_euclid(count)) + around * n.div_euclid(count) as f64,
            None if n < 0 => 2.0 * point(0) - point(-n),
            None if n >= count => 2.0 * point(count - 1) - point(2 * (count - 1) - n),
            None => point(n),
        }
    }

    /// The curve blurred along itself.
    fn blurred(&self) -> Self {
        let weight = |k: i64| libm::exp(-0.5 * (k as f64 / STEPS) * (k as f64 / STEPS));
        let weights: Vec<(i64, f64)> = (-RANGE..=RANGE).map(|k| (k, weight(k))).collect();
        let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
        let point = |n| weights.iter().fold(DVec2::ZERO, |all, (k, weight)| all + self.at(n + k) * (weight / sum));
        Self { points: (0..).take(self.points.len()).map(point).collect(), around: self.around }
    }

    fn polyline(mut self) -> Polyline {
        if let (Some(around), Some(first)) = (self.around, self.points.first()) {
            self.points.push(*first + around);
        }
        Polyline { points: self.points, closed: self.around.is_some() }
    }
}

/// Smooths a curve along its length; `sigma` is the standard deviation in mm. Adding back half of what a second blur
/// removes keeps the size of round shapes: a circle of radius r keeps 1 - (σ / r)⁴ / 4 of its radius, not
/// 1 - (σ / r)² / 2. The ends of an open curve stay. O(points).
pub fn smooth(curve: &Polyline, sigma: f64) -> Polyline {
    if curve.points.len() < 3 || sigma <= 0.0 {
        return curve.clone();
    }
    let even = Even::new(curve, sigma / STEPS);
    let mut once = even.blurred();
    let twice = once.blurred();
    once.points.iter_mut().zip(&twice.points).for_each(|(once, twice)| *once = 2.0 * *once - *twice);
    once.polyline()
}

/// Removes points, so that no removed point lies farther than `tolerance` mm from the curve. O(points).
pub fn thin(curve: &Polyline, tolerance: f64) -> Polyline {
    let all = &curve.points;
    let mut points = Vec::with_capacity(all.len() / 4 + 2);
    points.extend(all.first());
    let mut from = 0;
    while from + 1 < all.len() {
        let last = (from + MOST).min(all.len() - 1);
        let fits = |to: &usize| all[from + 1..*to].iter().all(|p| beside(*p, [all[from], all[*to]]) <= tolerance);
        let to = (from + 2..=last).take_while(fits).last().unwrap_or(from + 1);
        points.push(all[to]);
        from = to;
    }
    let whole = points.len() > 3 || !curve.closed || all.first() != all.last();
    Polyline { points: if whole { points } else { all.clone() }, closed: curve.closed }
}

/// Distance of a point from a straight piece.
fn beside(p: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let way = b - a;
    let share = ((p - a).dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + way * share)
}

/// Makes all curves of a path smooth and thin, and drops those shorter than `shortest` mm.
pub fn ease(path: &Path, sigma: f64, tolerance: f64, shortest: f64) -> Path {
    let mut pen = Pen::default();
    for curve in path.curves.iter().filter(|curve| curve.length() >= shortest) {
        let curve = thin(&smooth(curve, sigma), tolerance);
        let Some((first, rest)) = curve.points.split_first() else { continue };
        pen.move_to(*first);
        rest.iter().for_each(|p| pen.line_to(*p));
    }
    pen.finish(path.size_mm, path.periodic)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(radius: f64, count: u32, wobble: f64) -> Polyline {
        let point = |k: u32| {
            let angle = std::f64::consts::TAU * f64::from(k % count) / f64::from(count);
            DVec2::from_angle(angle) * (radius + if k.is_multiple_of(2) { wobble } else { -wobble })
        };
        Polyline { points: (0..=count).map(point).collect(), closed: true }
    }

    #[test]
    fn smoothing_removes_noise_and_keeps_the_size() {
        let smoothed = smooth(&circle(5.0, 400, 0.05), 0.5);
        assert!(smoothed.closed && smoothed.points.first() == smoothed.points.last());
        for p in &smoothed.points {
            assert!((p.length() - 5.0).abs() < 0.01, "{}", p.length());
        }
        // A circle whose radius is twice σ.
        let small = smooth(&circle(1.0, 100, 0.0), 0.5);
        assert!(small.points.iter().all(|p| (p.length() - 1.0).abs() < 0.03));
    }

    #[test]
    fn ends_of_open_curves_stay_and_closed_ones_go_around() {
        let points: Vec<DVec2> = (0..50).map(|k| DVec2::new(f64::from(k), f64::from(k % 2))).collect();
        let open = smooth(&Polyline { points: points.clone(), closed: false }, 2.0);
        let last = open.points.len() - 1;
        assert!(open.points[0].distance(points[0]) < 1e-9 && open.points[last].distance(points[49]) < 1e-9);
        let around = smooth(&Polyline { points: points[..49].to_vec(), closed: true }, 2.0);
        let way = *around.points.last().unwrap() - around.points[0];
        assert!(way.distance(DVec2::new(48.0, 0.0)) < 1e-12, "{way}");
        assert!(around.points.iter().all(|p| (p.y - 0.5).abs() < 0.2));
    }

    #[test]
    fn thinning_keeps_the_curve_within_the_tolerance() {
        let all = circle(5.0, 1000, 0.0);
        let few = thin(&all, 0.002);
        assert!(few.points.len() < 120 && few.points.first() == few.points.last(), "{}", few.points.len());
        for p in &all.points {
            let near = few.points.windows(2).map(|pair| beside(*p, [pair[0], pair[1]])).fold(f64::INFINITY, f64::min);
            assert!(near <= 0.002 + 1e-12);
        }
        // A loop smaller than the tolerance keeps its points.
        assert_eq!(thin(&circle(0.001, 12, 0.0), 0.01).points.len(), 13);
        let line = Polyline { points: vec![DVec2::ZERO, DVec2::X], closed: false };
        assert_eq!(thin(&line, 1.0), line);
        assert_eq!(smooth(&line, 1.0), line);
    }
}
