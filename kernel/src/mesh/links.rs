//! Links between points of a surface.
//!
//! Around each point the surface is approximated by its tangent plane: neighbours lie in the direction of their chord,
//! at its length. Two points are linked if their Voronoi cells touch; on a plane this is the Delaunay triangulation.
//! Cost: O(points · neighbours).
use super::near::Near;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// Points of a surface with their normals.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Positions in mm.
    pub places: &'a [DVec3],
    /// Normals, of length 1.
    pub normals: &'a [Vec3],
}

impl Points<'_> {
    /// The other points within `radius` of a point whose normals differ by less than a right angle, in ascending order.
    fn around(&self, near: &Near, point: usize, radius: f64) -> Vec<u32> {
        let (place, normal) = (self.places[point], self.normals[point]);
        let fits = |other: &u32| {
            let other = *other as usize;
            other != point && self.places[other].distance(place) <= radius && self.normals[other].dot(normal) > 0.0
        };
        let mut found: Vec<u32> = near.within(place, radius).filter(fits).collect();
        found.sort_unstable();
        found
    }

    /// Links all points that are at most `radius` mm apart. In a link the lower index is first; links are sorted.
    pub fn within(&self, radius: f64) -> Vec<[u32; 2]> {
        let near = Near::of(radius, self.places);
        let of = |point: usize| {
            let number = u32::try_from(point).unwrap_or(u32::MAX);
            let later = self.around(&near, point, radius).into_iter().filter(|other| *other > number);
            later.map(|other| [number, other]).collect::<Vec<_>>()
        };
        (0..self.places.len()).into_par_iter().map(of).collect::<Vec<_>>().concat()
    }

    /// Links Delaunay neighbours, at most `longest` mm apart, in the same order.
    pub fn delaunay(&self, longest: f64) -> Vec<[u32; 2]> {
        let near = Near::of(longest, self.places);
        let star = |point: usize| self.star(point, &self.around(&near, point, longest), longest);
        let stars: Vec<Vec<u32>> = (0..self.places.len()).into_par_iter().map(star).collect();
        let mut links = Vec::new();
        for (point, star) in (0_u32..).zip(&stars) {
            let mutual = |other: &&u32| **other > point && stars[**other as usize].binary_search(&point).is_ok();
            links.extend(star.iter().filter(mutual).map(|other| [point, *other]));
        }
        links
    }

    /// The Delaunay neighbours of a point, in ascending order.
    fn star(&self, point: usize, around: &[u32], longest: f64) -> Vec<u32> {
        let normal = self.normals[point].as_dvec3();
        let [x, y] = <[DVec3; 2]>::from(normal.any_orthonormal_pair());
        let flat = |other: u32| {
            let chord = self.places[other as usize] - self.places[point];
            DVec2::new(chord.dot(x), chord.dot(y)).normalize_or_zero() * chord.length()
        };
        let mut flats: Vec<(f64, u32, DVec2)> =
            around.iter().map(|n| (flat(*n), *n)).map(|(q, n)| (q.length_squared(), n, q)).collect();
        flats.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // The corners of the cell, each with the neighbour beyond the following side.
        let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let mut cell: Vec<(DVec2, Option<u32>)> =
            square.iter().map(|(x, y)| (DVec2::new(*x, *y) * longest, None)).collect();
        for (square, neighbor, at) in flats {
            let reach = cell.iter().map(|(corner, _)| corner.length_squared()).fold(0.0, f64::max);
            // Points farther away than twice the farthest corner cut nothing off.
            if square > 4.0 * reach || square <= 0.0 {
                continue;
            }
            cell = cut(&cell, at, 0.5 * square, neighbor);
        }
        let mut star: Vec<u32> = cell.iter().filter_map(|(_, neighbor)| *neighbor).collect();
        star.sort_unstable();
        star.dedup();
        star
    }
}

/// Clips a polygon to `p · at <= most`; the new side belongs to `neighbor`.
fn cut(polygon: &[(DVec2, Option<u32>)], at: DVec2, most: f64, neighbor: u32) -> Vec<(DVec2, Option<u32>)> {
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (k, (corner, side)) in polygon.iter().enumerate() {
        let next = polygon[(k + 1) % polygon.len()].0;
        let (here, there) = (corner.dot(at) - most, next.dot(at) - most);
        let crossing = || *corner + (next - *corner) * (here / (here - there));
        if here <= 0.0 {
            left.push((*corner, *side));
            if there > 0.0 {
                left.push((crossing(), Some(neighbor)));
            }
        } else if there <= 0.0 {
            left.push((crossing(), *side));
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;

    /// On a plane: an empty circle through three points makes each pair of them neighbours (computed by brute force).
    #[test]
    fn matches_delaunay_on_a_plane() {
        let place = |n: u64| DVec3::new(Hash::new(3).with(n).unit(0) * 10.0, Hash::new(3).with(n).unit(1) * 10.0, 0.0);
        let places: Vec<DVec3> = (0..120).map(place).collect();
        let normals = vec![Vec3::Z; places.len()];
        let links = Points { places: &places, normals: &normals }.delaunay(4.0);
        let mut expected = std::collections::BTreeSet::new();
        for a in 0..places.len() {
            for b in a + 1..places.len() {
                for c in b + 1..places.len() {
                    let [p, q, r] = [a, b, c].map(|n| places[n].truncate());
                    let d = 2.0 * (q - p).perp_dot(r - p);
                    let (u, v) = (q - p, r - p);
                    let center = p + DVec2::new(
                        v.y * u.length_squared() - u.y * v.length_squared(),
                        u.x * v.length_squared() - v.x * u.length_squared(),
                    ) / d;
                    let radius = center.distance(p);
                    let empty = (0..places.len())
                        .all(|n| [a, b, c].contains(&n) || center.distance(places[n].truncate()) > radius);
                    if empty && radius < 1.9 {
                        expected.extend([[a, b], [b, c], [a, c]].map(|pair| pair.map(|n| u32::try_from(n).unwrap())));
                    }
                }
            }
        }
        assert!(expected.len() > 250);
        for pair in expected {
            assert!(links.contains(&pair), "{pair:?}");
        }
        // A triangulation of n points has less than 3n links.
        assert!(links.len() < 3 * places.len() && links.is_sorted());
    }
}
