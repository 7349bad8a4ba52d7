//! Nearest points on the surface of an atlas, found with a tree of bounding boxes.
use super::{Atlas, Mesh};
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Maximum number of triangles in a leaf.
const FEW: usize = 4;

/// The bounding box of some triangles.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    fn of(mesh: &Mesh, triangles: &[u32]) -> Self {
        let none = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        let corners = triangles.iter().flat_map(|triangle| mesh.corners(*triangle as usize));
        corners.fold(none, |all, corner| Self { low: all.low.min(corner), high: all.high.max(corner) })
    }

    /// Squared distance to a point, a lower bound for the triangles inside.
    fn distance(&self, place: DVec3) -> f64 {
        place.distance_squared(place.clamp(self.low, self.high))
    }
}

/// A node of the tree: its box, its triangles, and the index of its second child (0 for a leaf). The first child
/// follows the node.
struct Node {
    bounds: Bounds,
    triangles: Range<usize>,
    second: usize,
}

/// Finds the nearest points on the surface of an atlas.
pub struct Nearest<'a> {
    atlas: &'a Atlas,
    triangles: Vec<u32>,
    nodes: Vec<Node>,
}

impl<'a> Nearest<'a> {
    /// Builds the tree of an atlas in O(n log n).
    pub fn new(atlas: &'a Atlas) -> Self {
        let mesh = &*atlas.mesh;
        let count = u32::try_from(mesh.triangles.len()).unwrap_or(u32::MAX);
        let mut triangles: Vec<u32> = (0..count).collect();
        let mut nodes: Vec<Node> = Vec::new();
        // Triangles of a node, and the parent for which it is the second child.
        let mut open = vec![(0..triangles.len(), None)];
        while let Some((range, parent)) = open.pop() {
            let own = &mut triangles[range.clone()];
            let bounds = Bounds::of(mesh, own);
            if let Some(parent) = parent {
                let second = nodes.len();
                let parent: &mut Node = &mut nodes[parent];
                parent.second = second;
            }
            let number = nodes.len();
            nodes.push(Node { bounds, triangles: range.clone(), second: 0 });
            if own.len() <= FEW {
                continue;
            }
            let size = bounds.high - bounds.low;
            let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
            let middle = |n: &u32| mesh.corners(*n as usize).iter().map(|corner| corner[axis]).sum::<f64>();
            let half = own.len() / 2;
            own.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
            open.push((range.start + half..range.end, Some(number)));
            open.push((range.start..range.start + half, None));
        }
        Self { atlas, triangles, nodes }
    }

    /// Position on the canvas, in mm, of the surface point nearest to `place`; of equally near points, that of the
    /// lowest triangle. `None` if there are no triangles.
    pub fn at(&self, place: DVec3) -> Option<DVec2> {
        let mesh = &*self.atlas.mesh;
        let mut best: Option<(f64, u32, [f64; 3])> = None;
        let mut open = vec![0];
        while let Some(n) = open.pop() {
            let node = self.nodes.get(n)?;
            if best.is_some_and(|best| node.bounds.distance(place) > best.0) {
                continue;
            }
            if node.second > 0 {
                let (first, second) = (n + 1, node.second);
                let is_nearer = |a: usize, b: usize| {
                    let distance = |n: usize| self.nodes[n].bounds.distance(place);
                    distance(a) <= distance(b)
                };
                open.extend(if is_nearer(first, second) { [second, first] } else { [first, second] });
                continue;
            }
            for &triangle in &self.triangles[node.triangles.clone()] {
                let corners = mesh.corners(triangle as usize);
                let weights = closest(corners, place);
                let point: DVec3 = corners.iter().zip(weights).map(|(corner, weight)| *corner * weight).sum();
                let distance = point.distance_squared(place);
                if best.is_none_or(|best| (distance, triangle) < (best.0, best.1)) {
                    best = Some((distance, triangle, weights));
                }
            }
        }
        let (_, triangle, weights) = best?;
        let uvs = self.atlas.uvs.get(triangle as usize)?;
        let uv: DVec2 = uvs.iter().zip(weights).map(|(uv, weight)| uv.as_dvec2() * weight).sum();
        Some(uv * self.atlas.size_mm)
    }
}

/// The barycentric weights of the point of a triangle that is nearest to `place` (Ericson, *Real-Time Collision
/// Detection*, 5.1.5).
fn closest([a, b, c]: [DVec3; 3], place: DVec3) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let [to_a, to_b, to_c] = [place - a, place - b, place - c];
    let (d1, d2, d3) = (ab.dot(to_a), ac.dot(to_a), ab.dot(to_b));
    let (d4, d5, d6) = (ac.dot(to_b), ab.dot(to_c), ac.dot(to_c));
    let [va, vb, vc] = [d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2];
    let share = |part: f64, rest: f64| if part + rest > 0.0 { part / (part + rest) } else { 0.0 };
    if d1 <= 0.0 && d2 <= 0.0 {
        [1.0, 0.0, 0.0]
    } else if d3 >= 0.0 && d4 <= d3 {
        [0.0, 1.0, 0.0]
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = share(d1, -d3);
        [1.0 - v, v, 0.0]
    } else if d6 >= 0.0 && d5 <= d6 {
        [0.0, 0.0, 1.0]
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = share(d2, -d6);
        [1.0 - w, 0.0, w]
    } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = share(d4 - d3, d5 - d6);
        [0.0, 1.0 - w, w]
    } else {
        let all = va + vb + vc;
        [va / all, vb / all, vc / all]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};
    use std::sync::Arc;

    #[test]
    fn the_nearest_point_of_a_triangle_is_found() {
        let corners = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24) * 12.0 - 4.0
        };
        for _ in 0..300 {
            let place = DVec3::new(random(), random(), random());
            let at = |weights: [f64; 3]| corners.iter().zip(weights).map(|(c, w)| *c * w).sum::<DVec3>();
            let found = at(closest(corners, place)).distance(place);
            // No point of a fine grid over the triangle is nearer.
            let grid = (0..=40).flat_map(|i| (0..=40 - i).map(move |k| [i, k].map(|n| f64::from(n) / 40.0)));
            let best = grid.map(|[v, w]| at([1.0 - v - w, v, w]).distance(place)).fold(f64::MAX, f64::min);
            assert!(found <= best + 1e-9 && found > best - 0.11, "{place}: {found} instead of {best}");
        }
    }

    #[test]
    fn finds_the_triangle_of_a_full_search() {
        let mut state = 11_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let mut corner = |size: f32| Vec3::new(random(), random(), random()) * size;
        // Small triangles, a few large ones, and one duplicate.
        let mut positions: Vec<Vec3> = Vec::new();
        for n in 0..500 {
            let middle = corner(100.0);
            let size = if n % 100 == 0 { 80.0 } else { 3.0 };
            positions.extend([0; 3].map(|_| middle + corner(size)));
        }
        positions.extend_from_within(30..33);
        let triangles: Vec<[u32; 3]> = (0..501).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        let uvs = (0..501).map(|n| [Vec2::new(n as f32 / 512.0, 0.5); 3]).collect();
        let mesh = Arc::new(Mesh { positions, triangles, ..Mesh::default() });
        let atlas = Atlas { mesh, uvs, size_mm: DVec2::splat(512.0), ..Atlas::default() };
        let nearest = Nearest::new(&atlas);
        for _ in 0..300 {
            let place = corner(140.0).as_dvec3() - 20.0;
            let distance = |n: usize| {
                let corners = atlas.mesh.corners(n);
                let point: DVec3 = corners.iter().zip(closest(corners, place)).map(|(c, w)| *c * w).sum();
                point.distance_squared(place)
            };
            let wanted = (0..501).min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap();
            assert!((nearest.at(place).unwrap().x - wanted as f64).abs() < 1e-9, "{place}");
        }
        assert_eq!(Nearest::new(&Atlas::default()).at(DVec3::ONE), None);
    }
}
