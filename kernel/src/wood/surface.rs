//! Surfaces to cut along: cylinders, Bézier patches and grids of points (Momoi & Takatera 2014, §4.1).
use glam::DVec3;

/// The point of a bicubic Bézier patch, its control points by rows of u.
pub fn patch(controls: &[DVec3; 16], u: f64, v: f64) -> DVec3 {
    let weights = |t: f64| {
        let s = 1.0 - t;
        [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
    };
    let (a, b) = (weights(u), weights(v));
    let row = |j: usize| (0..4).fold(DVec3::ZERO, |sum, i| sum + controls[4 * j + i] * a[i]);
    (0..4).fold(DVec3::ZERO, |sum, j| sum + row(j) * b[j])
}

/// A grid of points, `columns` in a row, as a surface: bicubic between them (Catmull–Rom), straight beyond its border.
pub fn grid(points: &[DVec3], columns: usize, u: f64, v: f64) -> DVec3 {
    let rows = points.len() / columns;
    let weights = |t: f64| {
        let (t2, t3) = (t * t, t * t * t);
        [0.5 * (2.0 * t2 - t - t3), 0.5 * (2.0 - 5.0 * t2 + 3.0 * t3), 0.5 * (t + 4.0 * t2 - 3.0 * t3), 0.5 * (t3 - t2)]
    };
    let place = |t: f64, n: usize| {
        let at = t * (n - 1) as f64;
        let cell = at.floor().clamp(0.0, (n.max(2) - 2) as f64);
        (cell, weights(at - cell))
    };
    let ((i, a), (j, b)) = (place(u, columns), place(v, rows));
    let line = |row: usize| {
        let get = |k: i64| -> DVec3 {
            let last = columns - 1;
            let at = |c: usize| points[row * columns + c.min(last)];
            match k {
                // One point beyond the border, in a straight line.
                k if k < 0 => 2.0 * at(0) - at(1),
                k => {
                    let k = usize::try_from(k).unwrap_or(0);
                    if k > last { 2.0 * at(last) - at(last.saturating_sub(1)) } else { at(k) }
                }
            }
        };
        #[expect(clippy::cast_possible_truncation, reason = "a column")]
        let first = i as i64 - 1;
        (0..4).fold(DVec3::ZERO, |sum, k| sum + get(first + k) * a[usize::try_from(k).unwrap_or(0)])
    };
    let get = |k: i64| -> DVec3 {
        let last = rows - 1;
        match k {
            k if k < 0 => 2.0 * line(0) - line(1.min(last)),
            k => {
                let k = usize::try_from(k).unwrap_or(0);
                if k > last { 2.0 * line(last) - line(last.saturating_sub(1)) } else { line(k) }
            }
        }
    };
    #[expect(clippy::cast_possible_truncation, reason = "a row")]
    let first = j as i64 - 1;
    (0..4).fold(DVec3::ZERO, |sum, k| sum + get(first + k) * b[usize::try_from(k).unwrap_or(0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_go_through_their_points() {
        let point = |i: usize, j: usize| DVec3::new(i as f64, j as f64 * 2.0, (i * j) as f64 * 0.1);
        let points: Vec<DVec3> = (0..12).map(|k| point(k % 4, k / 4)).collect();
        for j in 0..3 {
            for i in 0..4 {
                let at = grid(&points, 4, i as f64 / 3.0, j as f64 / 2.0);
                assert!(at.distance(point(i, j)) < 1e-12, "{at}");
            }
        }
        let controls: [DVec3; 16] = std::array::from_fn(|k| point(k % 4, k / 4));
        assert!(patch(&controls, 1.0, 0.0).distance(point(3, 0)) < 1e-12);
        assert!(patch(&controls, 0.0, 1.0).distance(point(0, 3)) < 1e-12);
        assert!(patch(&controls, 0.5, 0.5).distance(DVec3::new(1.5, 3.0, 0.225)) < 1e-12);
    }
}
