//! The nearest points of a surface, by a grid of cells in space.
use crate::ground::number::index_u32;
use glam::{DVec3, I64Vec3};
use shibo_value::Mesh;
use std::collections::HashMap;

/// A mesh with a spatial index of its triangles.
pub struct Surface<'a> {
    mesh: &'a Mesh,
    cell: f64,
    cells: HashMap<I64Vec3, Vec<u32>>,
    low: I64Vec3,
    high: I64Vec3,
}

#[expect(clippy::cast_possible_truncation, reason = "places within 10⁷ mm")]
fn cell_of(at: DVec3, size: f64) -> I64Vec3 {
    let cell = (at / size).floor();
    I64Vec3::new(cell.x as i64, cell.y as i64, cell.z as i64)
}

impl<'a> Surface<'a> {
    /// Indexes a mesh, in cells of about `cell` mm.
    pub fn new(mesh: &'a Mesh, cell: f64) -> Self {
        let [low, high] = mesh.bounds();
        let cell = cell.max((high - low).max_element() / 256.0).max(1e-9);
        let mut cells: HashMap<I64Vec3, Vec<u32>> = HashMap::new();
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            let (from, to) = (cell_of(a.min(b).min(c), cell), cell_of(a.max(b).max(c), cell));
            for z in from.z..=to.z {
                for (x, y) in (from.y..=to.y).flat_map(|y| (from.x..=to.x).map(move |x| (x, y))) {
                    cells.entry(I64Vec3::new(x, y, z)).or_default().push(index_u32(triangle));
                }
            }
        }
        Self { mesh, cell, cells, low: cell_of(low, cell), high: cell_of(high, cell) }
    }

    /// The triangle nearest to a point, and its nearest point, if within `most`; of equals the lowest triangle.
    pub fn nearest(&self, point: DVec3, most: f64) -> Option<(usize, DVec3)> {
        let middle = cell_of(point, self.cell);
        let outside = (self.low - middle).max(middle - self.high).max(I64Vec3::ZERO).max_element();
        let last = (self.low - middle).abs().max((self.high - middle).abs()).max_element();
        let mut best: Option<(f64, u32, DVec3)> = None;
        for ring in outside..=last {
            // Minimum distance of the cells of this ring.
            let least = (ring - 1).max(0) as f64 * self.cell;
            if least > most || best.is_some_and(|b| b.0.sqrt() < least) {
                break;
            }
            let (from, to) = ((middle - ring).max(self.low), (middle + ring).min(self.high));
            for z in from.z..=to.z {
                for y in from.y..=to.y {
                    let edge = (z - middle.z).abs() == ring || (y - middle.y).abs() == ring;
                    for x in (from.x..=to.x).filter(|x| edge || (x - middle.x).abs() == ring) {
                        self.nearer(I64Vec3::new(x, y, z), point, &mut best);
                    }
                }
            }
        }
        best.filter(|b| b.0.sqrt() <= most).map(|(_, triangle, at)| (triangle as usize, at))
    }

    fn nearer(&self, cell: I64Vec3, point: DVec3, best: &mut Option<(f64, u32, DVec3)>) {
        for &triangle in self.cells.get(&cell).into_iter().flatten() {
            let at = nearest_of(self.mesh.corners(triangle as usize), point);
            let distance = at.distance_squared(point);
            if best.is_none_or(|b| distance < b.0 || (distance == b.0 && triangle < b.1)) {
                *best = Some((distance, triangle, at));
            }
        }
    }
}

/// The point of a triangle nearest to `point`.
pub fn nearest_of([a, b, c]: [DVec3; 3], point: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let inside = |from: DVec3, to: DVec3| normal.dot((to - from).cross(point - from)) >= 0.0;
    if normal.length_squared() > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return point - normal * (normal.dot(point - a) / normal.length_squared());
    }
    let on = |from: DVec3, to: DVec3| {
        let along = to - from;
        let share = (point - from).dot(along) / along.length_squared().max(1e-300);
        from + along * share.clamp(0.0, 1.0)
    };
    let sides = [on(a, b), on(b, c), on(c, a)];
    sides
        .into_iter()
        .fold(a, |best, at| if at.distance_squared(point) < best.distance_squared(point) { at } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::mesh::fixture::{cube, torus};

    #[test]
    fn matches_full_search_for_nearest_triangle() {
        for atlas in [cube(), torus(24, 12)] {
            let surface = Surface::new(&atlas.mesh, 6.0);
            for k in 0..200u64 {
                let hash = Hash::new(k);
                let point = DVec3::from_array([0, 1, 2].map(|d| hash.unit(d) * 200.0 - 100.0));
                let all = (0..atlas.uvs.len()).map(|t| nearest_of(atlas.mesh.corners(t), point).distance(point));
                let least = all.fold(f64::INFINITY, f64::min);
                let found = surface.nearest(point, f64::INFINITY).expect("a triangle");
                assert!((found.1.distance(point) - least).abs() < 1e-9, "{point}");
                assert_eq!(surface.nearest(point, 10.0).is_some(), least <= 10.0);
            }
        }
    }
}
