//! Seams for cutting a mesh before it is unwrapped: converts lines of points to paths along its edges.
//!
//! From each point of a line to the next runs the shortest path along edges (E. Dijkstra, 1959) between the vertices
//! nearest to them. Cost: O(edges · log edges) for each pair of points.
use crate::ground::number::index_u32;
use glam::DVec3;
use shibo_value::Mesh;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};

/// Maximum distance of a point from the nearest vertex, as a share of the mesh's diagonal.
const FAR: f64 = 0.05;

/// Errors of lines; indices start at 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SeamError {
    /// A point is too far from the mesh.
    #[error("point {point} of seam {line} lies {far:.1} mm from the nearest vertex; up to {most:.1} mm are allowed")]
    Far {
        /// Index of the line.
        line: usize,
        /// Index of the point in it.
        point: usize,
        /// Distance in mm.
        far: f64,
        /// Maximum distance in mm.
        most: f64,
    },
    /// No edges connect a point with the next one.
    #[error("no edges lead from point {point} of seam {line} to the next one")]
    Apart {
        /// Index of the line.
        line: usize,
        /// Index of the first of the two points.
        point: usize,
    },
}

/// The edges along which a mesh may be cut, between vertices; vertices at the same position count as one.
struct Edges {
    /// For each vertex the first vertex at its position.
    first: Vec<u32>,
    /// Neighbours of each vertex, in ascending order, with lengths in mm.
    beside: HashMap<u32, Vec<(u32, f64)>>,
}

impl Edges {
    fn of(mesh: &Mesh) -> Self {
        let mut places: HashMap<[u32; 3], u32> = HashMap::new();
        let place = |v: usize| (mesh.positions[v] + glam::Vec3::ZERO).to_array().map(f32::to_bits);
        let first: Vec<u32> =
            (0..mesh.positions.len()).map(|v| *places.entry(place(v)).or_insert(index_u32(v))).collect();
        // Skip edges inside polygons.
        let mut inner: HashSet<(u32, [u32; 2])> = HashSet::new();
        let mut outer: HashSet<[u32; 2]> = HashSet::new();
        let polygons = mesh.polygons.len() == mesh.triangles.len();
        for (n, triangle) in mesh.triangles.iter().enumerate() {
            for k in 0..3 {
                let edge = ends(&first, triangle, k);
                let twice = polygons && !inner.insert((mesh.polygons[n], edge));
                if twice {
                    outer.remove(&edge);
                } else {
                    outer.insert(edge);
                }
            }
        }
        let mut edges: Vec<[u32; 2]> = outer.into_iter().filter(|[a, b]| a != b).collect();
        edges.sort_unstable();
        let mut beside: HashMap<u32, Vec<(u32, f64)>> = HashMap::new();
        for [a, b] in edges {
            let length = (at(mesh, a) - at(mesh, b)).length();
            beside.entry(a).or_default().push((b, length));
            beside.entry(b).or_default().push((a, length));
        }
        Self { first, beside }
    }

    /// The shortest path from one vertex to another; `None` if there is none.
    fn way(&self, from: u32, to: u32) -> Option<Vec<u32>> {
        let mut best: HashMap<u32, (f64, u32)> = HashMap::from([(from, (0.0, from))]);
        // Lengths are not negative, so their bits sort like the numbers.
        let mut open = BinaryHeap::from([Reverse((0.0f64.to_bits(), from))]);
        while let Some(Reverse((bits, vertex))) = open.pop() {
            if vertex == to {
                let mut way = vec![to];
                while way.last() != Some(&from) {
                    way.push(best.get(way.last()?)?.1);
                }
                return Some(way);
            }
            let length = f64::from_bits(bits);
            if best.get(&vertex).is_some_and(|(least, _)| length > *least) {
                continue;
            }
            for (other, step) in self.beside.get(&vertex).into_iter().flatten() {
                let length = length + step;
                if best.get(other).is_none_or(|(least, _)| length < *least) {
                    best.insert(*other, (length, vertex));
                    open.push(Reverse((length.to_bits(), *other)));
                }
            }
        }
        None
    }
}

fn at(mesh: &Mesh, vertex: u32) -> DVec3 {
    mesh.positions[vertex as usize].as_dvec3()
}

/// The ends of the edge from corner `k` of a triangle to the next one, the lower index first.
fn ends(first: &[u32], triangle: &[u32; 3], k: usize) -> [u32; 2] {
    let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|v| first[v as usize]);
    [a.min(b), a.max(b)]
}

/// For each triangle, marks of the edges (from corner k to the next) on lines of points in mm.
///
/// # Errors
/// Returns an error for points that are not on the mesh, or that no edges connect.
pub fn seams(mesh: &Mesh, lines: &[Vec<DVec3>]) -> Result<Vec<[bool; 3]>, SeamError> {
    let edges = Edges::of(mesh);
    let (low, high) = mesh
        .positions
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p.as_dvec3()), high.max(p.as_dvec3())));
    let most = FAR * (high - low).length();
    let mut vertices: Vec<u32> = edges.beside.keys().copied().collect();
    vertices.sort_unstable();
    let mut cut: HashSet<[u32; 2]> = HashSet::new();
    for (line, points) in lines.iter().enumerate() {
        let mut before = None;
        for (point, place) in points.iter().enumerate() {
            let far = |vertex: &u32| (at(mesh, *vertex) - *place).length();
            let nearest = vertices.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            let Some(nearest) = nearest.copied().filter(|vertex| far(vertex) <= most) else {
                return Err(SeamError::Far { line, point, far: nearest.map_or(f64::INFINITY, far), most });
            };
            if let Some(from) = before.replace(nearest) {
                let way = edges.way(from, nearest).ok_or(SeamError::Apart { line, point: point - 1 })?;
                cut.extend(way.windows(2).map(|ends| [ends[0].min(ends[1]), ends[0].max(ends[1])]));
            }
        }
    }
    let marked = |triangle: &[u32; 3]| [0, 1, 2].map(|k| cut.contains(&ends(&edges.first, triangle, k)));
    Ok(mesh.triangles.iter().map(marked).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{samples, shapes};

    #[test]
    fn follows_edges_from_end_to_end() {
        let mesh = shapes::sphere(DVec3::splat(60.0), 32);
        let (top, bottom) = (DVec3::new(0.0, 0.0, 30.0), DVec3::new(0.0, 0.0, -30.0));
        let marked = seams(&mesh, &[vec![top, DVec3::new(30.0, 0.0, 0.0), bottom]]).unwrap();
        let mut length = 0.0;
        for (triangle, marked) in mesh.triangles.iter().zip(&marked) {
            for k in (0..3).filter(|k| marked[*k]) {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|v| at(&mesh, v));
                assert!(a.y.abs() < 3.0 && b.y.abs() < 3.0 && a.x > -3.0, "{a} {b}");
                length += (a - b).length() / 2.0;
            }
        }
        // Half of a great circle; each edge counts from both sides.
        assert!((90.0..98.0).contains(&length), "{length}");
    }

    #[test]
    fn ignores_diagonals_of_polygons() {
        let mut mesh = samples::cube();
        // Its sides are squares of two triangles each.
        mesh.polygons = (0..12).map(|n| n / 2).collect();
        let marked = seams(&mesh, &[vec![at(&mesh, 0), -at(&mesh, 0)]]);
        let corners = mesh.positions.iter().map(|p| p.as_dvec3());
        let side =
            corners.clone().map(|p| p.x).fold(f64::MIN, f64::max) - corners.map(|p| p.x).fold(f64::MAX, f64::min);
        for (triangle, marked) in mesh.triangles.iter().zip(marked.unwrap()) {
            for k in (0..3).filter(|k| marked[*k]) {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|v| at(&mesh, v));
                assert!(((a - b).length() - side).abs() < 1e-3, "{a} {b}");
            }
        }
    }

    #[test]
    fn rejects_points_off_the_mesh_and_unconnected_points() {
        let mesh = shapes::sphere(DVec3::splat(60.0), 16);
        let (top, away) = (DVec3::new(0.0, 0.0, 30.0), DVec3::new(0.0, 0.0, 90.0));
        let found = seams(&mesh, &[vec![top, -top], vec![top, away]]);
        assert!(matches!(found, Err(SeamError::Far { line: 1, point: 1, .. })), "{found:?}");
        let mut two = mesh.clone();
        let moved = index_u32(mesh.positions.len());
        two.positions.extend(mesh.positions.iter().map(|p| *p + glam::Vec3::X * 100.0));
        two.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + moved)));
        let found = seams(&two, &[vec![top, top + DVec3::X * 100.0]]);
        assert_eq!(found, Err(SeamError::Apart { line: 0, point: 0 }));
    }
}
