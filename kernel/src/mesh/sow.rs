//! Points strewn evenly over a surface.
//!
//! Candidates are hashed by triangle and index, so they do not depend on the layout of the mesh. They are accepted in
//! the order of a hashed priority, unless an accepted point is too close. Cost: O(points), about 12 candidates each.
use super::near::Near;
use crate::ground::hash::Hash;
use crate::ground::stop::Until;
use glam::{DVec3, Vec3};
use shibo_value::Mesh;

/// Maximum number of points.
pub const MOST: f64 = 1e6;

/// Number of candidates per wanted point.
const CANDIDATES: f64 = 12.0;

/// Minimum distance of two points, in pitches; neighbours are then one pitch away on average.
const LEAST: f64 = 0.8;

/// Lower bound of the density: points there are four times as far apart.
const LEAST_DENSITY: f64 = 1.0 / 16.0;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sown {
    /// Position in mm.
    pub place: DVec3,
    /// The triangle of the point.
    pub triangle: u32,
    /// Weights of the triangle's corners at the point.
    pub weights: [f64; 3],
}

/// Number of points that fit on a surface.
pub fn wanted(area: f64, pitch: f64) -> f64 {
    // The area of a triangle of three neighbours; there are twice as many triangles as points.
    area / (pitch * pitch * 0.866_025)
}

/// Strews points about `pitch` mm apart; farther where `density`, 0..1, is less than 1 at a triangle and the weights of
/// its corners. `smooth` holds a normal for each vertex: points whose normals differ by more than 60° ignore each
/// other. Incomplete if `until` said to stop.
pub fn sow(
    (mesh, smooth): (&Mesh, &[Vec3]),
    pitch: f64,
    density: &dyn Fn(usize, [f64; 3]) -> f64,
    hash: Hash,
    until: Until<'_>,
) -> Vec<Sown> {
    let mut candidates: Vec<(f64, u32, u64)> = Vec::new();
    for triangle in 0..mesh.triangles.len() {
        let own = hash.with(triangle as u64);
        let expected = CANDIDATES * wanted(0.5 * mesh.cross(triangle).length(), pitch);
        let number = u32::try_from(triangle).unwrap_or(u32::MAX);
        let count = (0_u64..).take_while(|j| *j as f64 + 1.0 <= expected + own.unit(0)).count() as u64;
        candidates.extend((0..count).map(|j| (own.with(j).unit(2), number, j)));
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let least = LEAST * pitch;
    let (mut near, mut taken, mut largest) = (Near::new(least), Vec::<(Sown, f64, Vec3)>::new(), least);
    for (i, (_, triangle, j)) in candidates.into_iter().enumerate() {
        if i % 1024 == 0 && until() {
            break;
        }
        let sown = candidate(mesh, triangle, hash.with(u64::from(triangle)).with(j));
        let share = density(triangle as usize, sown.weights).clamp(0.0, 1.0);
        if share <= 0.0 {
            continue;
        }
        let radius = least / share.max(LEAST_DENSITY).sqrt();
        let normal = normal(mesh, smooth, &sown);
        largest = largest.max(radius);
        let close = |other: u32| {
            let (other, theirs, their_normal) = &taken[other as usize];
            other.place.distance(sown.place) < 0.5 * (radius + theirs) && their_normal.dot(normal) > 0.5
        };
        if !near.within(sown.place, 0.5 * (radius + largest)).any(close) {
            near.add(u32::try_from(taken.len()).unwrap_or(u32::MAX), sown.place);
            taken.push((sown, radius, normal));
        }
    }
    taken.into_iter().map(|(sown, ..)| sown).collect()
}

fn candidate(mesh: &Mesh, triangle: u32, hash: Hash) -> Sown {
    let (mut v, mut w) = (hash.unit(0), hash.unit(1));
    if v + w > 1.0 {
        (v, w) = (1.0 - v, 1.0 - w);
    }
    let weights = [1.0 - v - w, v, w];
    let [a, b, c] = mesh.corners(triangle as usize);
    Sown { place: a * weights[0] + b * weights[1] + c * weights[2], triangle, weights }
}

/// The normal interpolated between a triangle's corners; the triangle's own if they cancel out.
pub fn normal(mesh: &Mesh, smooth: &[Vec3], sown: &Sown) -> Vec3 {
    let corners = mesh.triangles[sown.triangle as usize].map(|vertex| smooth[vertex as usize].as_dvec3());
    let sum: DVec3 = corners.iter().zip(sown.weights).map(|(normal, weight)| *normal * weight).sum();
    let own = mesh.cross(sown.triangle as usize).normalize_or(DVec3::Z);
    sum.normalize_or(own).as_vec3()
}
