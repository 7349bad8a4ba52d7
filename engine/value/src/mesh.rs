//! Triangle meshes.
use super::{Number, Object, Shapes, Sketch};
use glam::{DVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// A triangle mesh in space, in mm, z up: the content of a mesh file.
///
/// Triangles are counter-clockwise seen from outside. Corners at the same position are one vertex; UVs and normals can
/// differ between triangles, so they are stored per corner.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Positions of the vertices.
    pub positions: Vec<Vec3>,
    /// The vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the corners of each triangle, v down; empty if there are none.
    pub uvs: Vec<[Vec2; 3]>,
    /// Unit normals of the corners of each triangle; empty if there are none.
    pub normals: Vec<[Vec3; 3]>,
    /// Index of each triangle's part.
    pub parts: Vec<u16>,
    /// The names of the parts.
    pub part_names: Vec<String>,
    /// Index of the polygon in the file that each triangle was cut from; empty if all polygons are triangles.
    pub polygons: Vec<u32>,
}

impl Mesh {
    /// Positions of a triangle's corners.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize].as_dvec3())
    }

    /// The normal of a triangle, with twice its area in mm² as its length.
    pub fn cross(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// The area of the surface in mm².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|triangle| 0.5 * self.cross(triangle).length()).sum()
    }

    /// The bounding box; at the origin if there are no vertices.
    pub fn bounds(&self) -> [DVec3; 2] {
        let ends = self.positions.iter().map(|p| [p.as_dvec3(); 2]);
        ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or_default()
    }

    /// Number of triangles at each edge; 1 at the border of the surface. In no order.
    fn edges(&self) -> HashMap<[u32; 2], u32> {
        let mut edges = HashMap::with_capacity(self.triangles.len() * 3 / 2);
        for triangle in &self.triangles {
            for k in 0..3 {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
                *edges.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            }
        }
        edges
    }

    /// Index of the connected component of each triangle, and the number of components. Components are numbered in the
    /// order of their lowest triangles. Triangles that share a vertex are connected.
    pub fn pieces(&self) -> (Vec<u32>, usize) {
        let mut parent: Vec<u32> = (0..).take(self.positions.len()).collect();
        let find = |parent: &mut Vec<u32>, mut v: u32| {
            while parent[v as usize] != v {
                parent[v as usize] = parent[parent[v as usize] as usize];
                v = parent[v as usize];
            }
            v
        };
        for &[a, b, c] in &self.triangles {
            for other in [b, c] {
                let (x, y) = (find(&mut parent, a), find(&mut parent, other));
                parent[x.max(y) as usize] = x.min(y);
            }
        }
        let mut numbers = HashMap::new();
        let piece = |triangle: &[u32; 3]| {
            let next = u32::try_from(numbers.len()).unwrap_or(u32::MAX);
            *numbers.entry(find(&mut parent, triangle[0])).or_insert(next)
        };
        let pieces = self.triangles.iter().map(piece).collect();
        (pieces, numbers.len())
    }
}

#[derive(Serialize)]
struct PartData {
    name: String,
    triangles: usize,
}

#[derive(Serialize)]
struct MeshData {
    positions: Vec<[Number; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Per corner, v down.
    uvs: Option<Vec<[[Number; 2]; 3]>>,
    normals: Option<Vec<[[Number; 3]; 3]>>,
    parts: Vec<PartData>,
    bounds: [[Number<f64>; 3]; 2],
    /// In mm².
    area: Number<f64>,
    /// Number of connected components.
    pieces: usize,
    /// Length of the edges with only one triangle, in mm.
    ends: Number<f64>,
    /// Vertices - edges + triangles.
    euler: i64,
}

impl Object for Mesh {
    fn bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(&*self.positions)
            + size_of_val(&*self.triangles)
            + size_of_val(&*self.uvs)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.parts)
            + size_of_val(&*self.polygons)
            + self.part_names.iter().map(|name| name.len() + size_of::<String>()).sum::<usize>()
    }

    fn data(&self) -> impl Serialize {
        let edges = self.edges();
        let mut ends: Vec<[u32; 2]> = edges.iter().filter(|(_, count)| **count == 1).map(|(edge, _)| *edge).collect();
        ends.sort_unstable();
        let length =
            |&[a, b]: &[u32; 2]| self.positions[a as usize].as_dvec3().distance(self.positions[b as usize].as_dvec3());
        let used = self.triangles.iter().flatten().collect::<std::collections::HashSet<_>>().len();
        let count = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        let of_part = |part: usize| self.parts.iter().filter(|p| usize::from(**p) == part).count();
        let part = |(n, name): (usize, &String)| PartData { name: name.clone(), triangles: of_part(n) };
        MeshData {
            positions: self.positions.iter().map(|p| p.to_array().map(Number)).collect(),
            triangles: self.triangles.clone(),
            uvs: (!self.uvs.is_empty())
                .then(|| self.uvs.iter().map(|uvs| uvs.map(|uv| uv.to_array().map(Number))).collect()),
            normals: (!self.normals.is_empty())
                .then(|| self.normals.iter().map(|n| n.map(|n| n.to_array().map(Number))).collect()),
            parts: self.part_names.iter().enumerate().map(part).collect(),
            bounds: self.bounds().map(|corner| corner.to_array().map(Number)),
            area: Number(self.area()),
            pieces: self.pieces().1,
            ends: Number(ends.iter().map(length).sum()),
            euler: count(used) - count(edges.len()) + count(self.triangles.len()),
        }
    }

    fn sketch(&self) -> Option<Sketch> {
        let all = self.triangles.len() * 3;
        let line = |n: usize| {
            let corners = self.corners(n / 3);
            [corners[n % 3], corners[(n + 1) % 3]]
        };
        let counts = vec![(self.positions.len(), "vertices"), (self.triangles.len(), "triangles")];
        Some(Sketch::Space(Shapes {
            lines: Shapes::<DVec3>::thinned(all).map(line).collect(),
            counts,
            ..Shapes::default()
        }))
    }
}
