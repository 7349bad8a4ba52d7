//! The meshes of exported files: vertices in metres, y up.
use crate::value::Atlas;
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// A part of a mesh: some of its triangles.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeshPart {
    pub(super) name: String,
    /// Indices of vertices, three for each triangle.
    pub(super) indices: Vec<u32>,
}

/// A mesh with one normal, tangent and texture coordinate per vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    /// Direction in which u grows, and the handedness: 1, or -1 where textures are mirrored.
    pub(super) tangents: Vec<Vec4>,
    /// Texture coordinates with v down.
    pub(super) uvs: Vec<Vec2>,
    pub(super) parts: Vec<MeshPart>,
    /// Number of repeats of a texture from 0 to 1 of the coordinates; `None` if it covers them once and ends there.
    pub(super) repeats: Option<DVec2>,
}

/// From mm, z up, to metres, y up.
fn turned(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, -v.y)
}

/// The key by which corners are merged into one vertex: bits of position, normal, tangent and coordinates.
type Corner = [u32; 12];

impl Shape {
    pub(super) fn plane(size_mm: DVec2) -> Self {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        Self {
            positions: corners.iter().map(|(u, v)| Vec3::new(u - 0.5, 0.0, v - 0.5)).collect(),
            normals: vec![Vec3::Y; 4],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4],
            uvs: corners.iter().map(|(u, v)| Vec2::new(*u, *v)).collect(),
            parts: vec![MeshPart { name: "plane".into(), indices: vec![0, 3, 2, 0, 2, 1] }],
            repeats: Some(1000.0 / size_mm),
        }
    }

    /// The mesh of an atlas. Corners with equal position, normal, tangent and coordinates become one vertex.
    pub fn atlas(atlas: &Atlas) -> Self {
        let mesh = &*atlas.mesh;
        let mut shape = Self::default();
        let mut known: HashMap<Corner, u32> = HashMap::new();
        let tangents = tangents(atlas);
        shape.parts = mesh.part_names.iter().map(|name| MeshPart { name: name.clone(), indices: Vec::new() }).collect();
        if shape.parts.is_empty() {
            shape.parts.push(MeshPart { name: "mesh".into(), indices: Vec::new() });
        }
        for (n, triangle) in mesh.triangles.iter().enumerate() {
            let part = mesh.parts.get(n).map_or(0, |part| usize::from(*part)).min(shape.parts.len() - 1);
            for k in 0..3 {
                let vertex = triangle[k] as usize;
                let normal = mesh.normals.get(n).map_or(atlas.smooth[vertex], |normals| normals[k]);
                let normal = turned(normal.as_dvec3()).normalize_or(DVec3::Y).as_vec3();
                let along = turned(tangents[&(triangle[k], atlas.charts[n])]);
                let along = along.reject_from_normalized(normal.as_dvec3());
                let along = along.try_normalize().unwrap_or_else(|| normal.as_dvec3().any_orthonormal_vector());
                let hand = handedness(atlas, n);
                let at = (turned(mesh.positions[vertex].as_dvec3()) * 1e-3).as_vec3();
                let tangent = along.as_vec3().extend(hand);
                let uv = atlas.uvs[n][k];
                let index =
                    *known.entry(corner(at, normal, tangent, uv)).or_insert_with(|| shape.add(at, normal, tangent, uv));
                shape.parts[part].indices.push(index);
            }
        }
        shape.parts.retain(|part| !part.indices.is_empty());
        shape
    }

    /// The mesh moved to the origin and scaled so that the farthest vertex lies at distance 1. Returns vertices
    /// (position, normal, tangent, coordinates), the vertex indices of all triangles, the length of a mm, and the
    /// position of the origin in mm, z up.
    pub fn around_the_origin(&self) -> (Vec<[f32; 11]>, Vec<u32>, f32, [f32; 3]) {
        let bounds = self.positions.iter().map(|p| [*p, *p]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let middle = bounds.map_or(Vec3::ZERO, |[low, high]| 0.5 * (low + high));
        let reach = self.positions.iter().map(|p| p.distance(middle)).fold(f32::MIN_POSITIVE, f32::max);
        let vertex = |n: usize| {
            let [x, y, z] = ((self.positions[n] - middle) / reach).to_array();
            let ([a, b, c], [u, v]) = (self.normals[n].to_array(), self.uvs[n].to_array());
            let [d, e, f] = self.tangents[n].truncate().to_array();
            [x, y, z, a, b, c, d, e, f, u, v]
        };
        let indices = self.parts.iter().flat_map(|part| part.indices.iter().copied()).collect();
        let from = 1e3 * middle;
        ((0..self.positions.len()).map(vertex).collect(), indices, 1e-3 / reach, [from.x, -from.z, from.y])
    }

    pub(super) fn add(&mut self, at: Vec3, normal: Vec3, tangent: Vec4, uv: Vec2) -> u32 {
        let index = u32::try_from(self.positions.len()).unwrap_or(u32::MAX);
        self.positions.push(at);
        self.normals.push(normal);
        self.tangents.push(tangent);
        self.uvs.push(uv);
        index
    }
}

fn corner(at: Vec3, normal: Vec3, tangent: Vec4, uv: Vec2) -> Corner {
    // Adding 0 turns -0 into 0, so that equal numbers have equal bits.
    let bits = |v: f32| (v + 0.0).to_bits();
    let [x, y, z] = at.to_array().map(bits);
    let [nx, ny, nz] = normal.to_array().map(bits);
    let [tx, ty, tz, tw] = tangent.to_array().map(bits);
    let [u, v] = uv.to_array().map(bits);
    [x, y, z, nx, ny, nz, tx, ty, tz, tw, u, v]
}

/// Direction in space in which u grows, per vertex and chart: the sum over the triangles there.
fn tangents(atlas: &Atlas) -> HashMap<(u32, u16), DVec3> {
    let mut sums: HashMap<(u32, u16), DVec3> = HashMap::new();
    for (n, triangle) in atlas.mesh.triangles.iter().enumerate() {
        // Weighted by the area of the triangle.
        let along = atlas.jacobians[n][0].as_dvec3().normalize_or_zero() * atlas.mesh.cross(n).length();
        for vertex in triangle {
            *sums.entry((*vertex, atlas.charts[n])).or_default() += along;
        }
    }
    sums
}

/// The handedness of a triangle: 1 if the atlas shows it as seen from outside, -1 if mirrored.
fn handedness(atlas: &Atlas, triangle: usize) -> f32 {
    let [a, b, c] = atlas.uvs[triangle].map(|uv| uv.as_dvec2());
    // v points down, so triangles that are counter-clockwise in space are clockwise in texture coordinates.
    if (b - a).perp_dot(c - a) <= 0.0 { 1.0 } else { -1.0 }
}
