//! Polygons cut into triangles.
use glam::{DVec2, DVec3};

/// Polygons with more corners are not cut.
pub(super) const MOST_CORNERS: usize = 1000;

/// The normal of a polygon that need not be flat, by Newell; of any length.
fn newell(corners: &[DVec3]) -> DVec3 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (*a - corners[0]).cross(*b - corners[0])).sum()
}

/// Calls `add` with the triangles of a polygon, as numbers of its corners. Quads are cut along the shorter diagonal, of equal
/// ones along the first, unless it lies outside; larger ones by cutting ears off in the plane of their normal.
pub(super) fn triangles(corners: &[DVec3], mut add: impl FnMut([usize; 3])) {
    match corners.len() {
        0..3 => {}
        3 => add([0, 1, 2]),
        4 => {
            let normal = newell(corners);
            let up = |[a, b, c]: [usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(normal) > 0.0;
            let cuts = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
            let fits = cuts.map(|cut| cut.iter().all(|triangle| up(*triangle)));
            let shorter = corners[0].distance_squared(corners[2]) <= corners[1].distance_squared(corners[3]);
            let first = if fits[0] == fits[1] { shorter } else { fits[0] };
            cuts[usize::from(!first)].into_iter().for_each(add);
        }
        _ => ears(&flat(corners), add),
    }
}

/// The corners in the plane across the polygon's normal, in which it turns to the left.
fn flat(corners: &[DVec3]) -> Vec<DVec2> {
    let normal = newell(corners).try_normalize().unwrap_or(DVec3::Z);
    let (x, y) = normal.any_orthonormal_pair();
    corners.iter().map(|p| DVec2::new((*p - corners[0]).dot(x), (*p - corners[0]).dot(y))).collect()
}

/// Cuts off one ear after another; what is left of a polygon that crosses itself is cut like a fan.
fn ears(at: &[DVec2], mut add: impl FnMut([usize; 3])) {
    let turn = |a: usize, b: usize, c: usize| (at[b] - at[a]).perp_dot(at[c] - at[b]);
    let mut left: Vec<usize> = (0..at.len()).collect();
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).find(|k| {
            let [a, b, c] = [left[(k + n - 1) % n], left[*k], left[(k + 1) % n]];
            let inside = |p: &usize| {
                let p = *p;
                ![a, b, c].contains(&p)
                    && [(a, b), (b, c), (c, a)]
                        .iter()
                        .all(|(from, to)| (at[*to] - at[*from]).perp_dot(at[p] - at[*from]) >= 0.0)
            };
            turn(a, b, c) > 0.0 && !left.iter().any(inside)
        });
        let k = ear.unwrap_or(1);
        add([left[(k + n - 1) % n], left[k], left[(k + 1) % n]]);
        left.remove(k);
    }
    if let [a, b, c] = left[..] {
        add([a, b, c]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(corners: &[[f64; 3]]) -> Vec<[usize; 3]> {
        let corners: Vec<DVec3> = corners.iter().map(|p| DVec3::from_array(*p)).collect();
        let mut all = Vec::new();
        triangles(&corners, |triangle| all.push(triangle));
        let area = |[a, b, c]: [usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]);
        let sum: DVec3 = all.iter().map(|t| area(*t)).sum();
        let normal = newell(&corners);
        assert!(sum.distance(normal) < 1e-9 * (1.0 + normal.length()));
        assert!(all.iter().all(|t| area(*t).dot(normal) > 0.0), "{all:?}");
        all
    }

    #[test]
    fn quads_are_cut_along_the_shorter_diagonal() {
        assert_eq!(cut(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(cut(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 2.0, 0.0], [0.0, 1.0, 0.0]]), [[0, 1, 3], [1, 2, 3]]);
        // The shorter one lies outside.
        assert_eq!(cut(&[[0.0, 0.0, 0.0], [5.0, -1.0, 0.0], [1.0, 0.0, 0.0], [5.0, 1.0, 0.0]]), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn hollow_polygons_are_cut_inside() {
        let star: Vec<[f64; 3]> = (0..14)
            .map(|k| {
                let (angle, radius) = (f64::from(k) * std::f64::consts::TAU / 14.0, if k % 2 == 0 { 3.0 } else { 1.0 });
                [radius * angle.cos(), radius * angle.sin(), 0.5 * radius * angle.sin()]
            })
            .collect();
        assert_eq!(cut(&star).len(), 12);
        let comb = [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [4.0, 1.0], [3.0, 3.0], [2.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        assert_eq!(cut(&comb.map(|[x, y]| [7.0, x, y])).len(), 6);
    }

    #[test]
    fn anything_is_cut_into_as_many_triangles() {
        for corners in [vec![DVec3::ZERO; 9], (0..9).map(|k| DVec3::splat(f64::from(k * k % 5))).collect()] {
            let mut count = 0;
            triangles(&corners, |_| count += 1);
            assert_eq!(count, 7);
        }
        triangles(&[DVec3::ZERO; 2], |_| panic!("no triangle"));
    }
}
