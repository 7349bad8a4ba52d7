//! Comparison of directions at neighbouring vertices of a mesh: tangent planes, transport along edges, and the matrix
//! of the differences.
//!
//! The tangent plane of a vertex is perpendicular to its smooth normal; a direction is transported to a neighbour by
//! the smallest rotation between the two normals. Directions are angles in the planes. For a field with N-fold symmetry
//! they are complex numbers of N times that angle (Knöppel et al. 2013, with other planes).
use crate::ground::number::index_u32;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use shibo_value::Mesh;

use super::frame::least_turned;
use super::topology::smooth_normals;

/// The product of two complex numbers.
#[inline(always)]
pub fn times(a: DVec2, b: DVec2) -> DVec2 {
    DVec2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

/// The complex number of length 1 at an angle.
pub fn unit(angle: f64) -> DVec2 {
    let (s, c) = libm::sincos(angle);
    DVec2::new(c, s)
}

/// The angle of a complex number.
pub fn angle(of: DVec2) -> f64 {
    libm::atan2(of.y, of.x)
}

/// Wraps an angle to within half a turn.
pub fn wrapped(angle: f64) -> f64 {
    angle - (angle / std::f64::consts::TAU).round() * std::f64::consts::TAU
}

/// The tangent plane of a vertex.
#[derive(Clone, Copy)]
pub struct TangentPlane {
    /// The directions of the angles 0 and a quarter of a turn, and the normal.
    pub axes: [DVec3; 3],
}

impl TangentPlane {
    /// Projects a direction to the plane, in coordinates along the axes.
    pub fn flat(&self, direction: DVec3) -> DVec2 {
        DVec2::new(self.axes[0].dot(direction), self.axes[1].dot(direction))
    }

    /// The direction at an angle.
    pub fn direction(&self, angle: f64) -> DVec3 {
        let at = unit(angle);
        self.axes[0] * at.x + self.axes[1] * at.y
    }
}

/// A neighbour of a vertex.
#[derive(Clone, Copy)]
pub struct Beside {
    /// Its vertex index.
    pub vertex: u32,
    /// Weight of the difference.
    pub weight: f64,
    /// The angle by which transport from there to here rotates directions.
    pub carried: f64,
}

/// The tangent planes of a mesh's vertices, and the neighbours of each vertex.
pub struct Connection {
    /// Tangent plane of each vertex.
    pub planes: Vec<TangentPlane>,
    /// Offset of each vertex' neighbours in `beside`, plus the end.
    pub starts: Vec<u32>,
    /// The neighbours of each vertex, in ascending order.
    pub beside: Vec<Beside>,
    /// The area of each vertex, in mm².
    pub areas: Vec<f64>,
    /// The mean length of edges in mm.
    pub edge: f64,
}

/// Half the cotangent of the angle at corner `k`.
fn half_cotangent(corners: [DVec3; 3], k: usize) -> f64 {
    let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
    0.5 * a.dot(b) / a.cross(b).length().max(1e-300)
}

impl Connection {
    /// Builds the connection of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let normals = smooth_normals(mesh);
        let planes: Vec<TangentPlane> = normals
            .iter()
            .map(|n| {
                let n = n.as_dvec3().normalize_or(DVec3::Z);
                let x = n.any_orthonormal_vector();
                TangentPlane { axes: [x, n.cross(x), n] }
            })
            .collect();
        let mut areas = vec![0.0; planes.len()];
        let mut ways: Vec<([u32; 2], f64)> = Vec::with_capacity(6 * mesh.triangles.len());
        for (n, triangle) in mesh.triangles.iter().enumerate() {
            let corners = mesh.corners(n);
            let area = mesh.cross(n).length() / 6.0;
            for k in 0..3 {
                areas[triangle[k] as usize] += area;
                let [a, b] = [triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
                let weight = half_cotangent(corners, k);
                ways.push(([a, b], weight));
                ways.push(([b, a], weight));
            }
        }
        // A stable sort, so that sums have a fixed order.
        ways.par_sort_by_key(|way| way.0);
        let mut edges: Vec<([u32; 2], f64)> =
            ways.chunk_by(|a, b| a.0 == b.0).map(|same| (same[0].0, same.iter().map(|way| way.1).sum())).collect();
        let mean = edges.iter().map(|edge| edge.1.max(0.0)).sum::<f64>() / edges.len().max(1) as f64;
        edges.iter_mut().for_each(|edge| edge.1 = edge.1.max(1e-3 * mean));
        let place = |v: u32| mesh.positions[v as usize].as_dvec3();
        let length: f64 = edges.iter().map(|([a, b], _)| place(*a).distance(place(*b))).sum();
        let mut starts = vec![0u32; planes.len() + 1];
        edges.iter().for_each(|edge| starts[edge.0[0] as usize + 1] += 1);
        for v in 0..planes.len() {
            starts[v + 1] += starts[v];
        }
        let carried = |&([to, from], weight): &([u32; 2], f64)| {
            let [to, source] = [to, from].map(|v| planes[v as usize]);
            let turned = least_turned(source.axes[0], source.axes[2], to.axes[2]);
            Beside { vertex: from, weight, carried: angle(to.flat(turned)) }
        };
        let beside = edges.par_iter().with_min_len(1024).map(carried).collect();
        Self { planes, starts, beside, areas, edge: length / edges.len().max(1) as f64 }
    }

    /// The neighbours of a vertex.
    #[inline]
    pub fn beside(&self, vertex: usize) -> &[Beside] {
        &self.beside[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }

    /// The angle by which transport from one vertex to a neighbour rotates directions.
    pub fn carried(&self, from: u32, to: u32) -> f64 {
        let beside = self.beside(to as usize);
        beside.binary_search_by_key(&from, |b| b.vertex).map_or(0.0, |at| beside[at].carried)
    }

    /// For each vertex the lowest vertex of its connected component.
    pub fn pieces(&self) -> Vec<u32> {
        let mut piece = vec![u32::MAX; self.planes.len()];
        let mut open = Vec::new();
        for first in 0..piece.len() {
            if piece[first] != u32::MAX {
                continue;
            }
            let name = index_u32(first);
            piece[first] = name;
            open.push(first);
            while let Some(vertex) = open.pop() {
                for beside in self.beside(vertex) {
                    let next = beside.vertex as usize;
                    if piece[next] == u32::MAX {
                        piece[next] = name;
                        open.push(next);
                    }
                }
            }
        }
        piece
    }
}
