//! A mesh with an atlas as the shape of a view.
use super::shapes::Hit;
use crate::mesh::rays::{Rays, directions, turned};
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use shibo_value::{Atlas, Mesh};
use std::sync::Arc;

/// Angle of the camera round the vertical axis, and above the ground, in degrees.
const TURN: f64 = 28.0;
const ABOVE: f64 = 24.0;
/// Half the longer side of the body as it is seen.
const HALF: f32 = 0.98;
/// Directions in which light may reach a vertex: at most, at least, and all together.
const MOST: usize = 64;
const LEAST: usize = 8;
const BUDGET: usize = 4_000_000;
/// Distance of the start of a ray from the surface.
const BIAS: f32 = 1e-3;

/// A mesh before the camera. Its vectors have x to the right, y down and z to the viewer; its size is about 2.
pub struct Body {
    atlas: Arc<Atlas>,
    mesh: Mesh,
    rays: Rays,
    /// The normal of each vertex.
    smooth: Vec<Vec3>,
    /// The share of the sky that each vertex sees.
    open: Vec<f32>,
    /// The directions to the right, down and to the viewer, in the space of the mesh.
    axes: [Vec3; 3],
    /// The lowest point of the body as it is seen, and half its width there.
    ground: [f32; 2],
}

impl std::fmt::Debug for Body {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Body").field("triangles", &self.mesh.triangles.len()).finish_non_exhaustive()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "directions and sizes of about 1")]
impl Body {
    /// Turns the mesh to the camera and prepares it for rays. O(n log n), and up to four million rays for its shade.
    pub fn new(atlas: &Arc<Atlas>) -> Self {
        let sine_cosine = |degrees: f64| (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()));
        let ((st, ct), (sa, ca)) = (sine_cosine(TURN), sine_cosine(ABOVE));
        let right = DVec3::new(ct, st, 0.0);
        let front = DVec3::new(st, -ct, 0.0);
        let viewer = front * ca + DVec3::Z * sa;
        let down = front * sa - DVec3::Z * ca;
        let seen = |p: DVec3| DVec3::new(p.dot(right), p.dot(down), p.dot(viewer));
        let all: Vec<DVec3> = atlas.mesh.positions.iter().map(|p| seen(p.as_dvec3())).collect();
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = all.iter().fold(start, |(low, high), p| (low.min(*p), high.max(*p)));
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let scale = f64::from(HALF) / half.x.max(half.y).max(1e-12);
        let mut mesh = Mesh { positions: Vec::new(), ..(*atlas.mesh).clone() };
        mesh.positions = all.iter().map(|p| ((*p - middle) * scale).as_vec3()).collect();
        let smooth: Vec<Vec3> = atlas.smooth.iter().map(|n| seen(n.as_dvec3()).as_vec3()).collect();
        let rays = Rays::new(&mesh);
        let count = (BUDGET / mesh.positions.len().max(1)).clamp(LEAST, MOST);
        let around = directions(count as u32, 1.0);
        let open = |(at, normal): (&Vec3, &Vec3)| {
            let turn = turned(*normal);
            let free = around.iter().filter(|way| rays.escapes(*at + *normal * BIAS, turn(**way), 1.0)).count();
            free as f32 / count as f32
        };
        let open = mesh.positions.par_iter().zip(&smooth).map(open).collect();
        let ground = [half.y * scale, half.x * scale].map(|side| side as f32);
        let axes = [right, down, viewer].map(|axis| axis.as_vec3());
        Self { atlas: atlas.clone(), mesh, rays, smooth, open, axes, ground }
    }

    /// The lowest point of the body as it is seen, and half its width.
    pub(super) const fn ground(&self) -> [f32; 2] {
        self.ground
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        28 * self.mesh.positions.len() + 112 * self.mesh.triangles.len()
    }

    /// The place on the material that a ray meets.
    pub(super) fn meet(&self, eye: [f32; 3], ray: [f32; 3], view: [f32; 3]) -> Option<Hit> {
        let (eye, ray) = (Vec3::from(eye), Vec3::from(ray));
        let (t, n) = self.rays.nearest(eye, ray, f32::MAX)?;
        let corners = self.mesh.triangles[n].map(|vertex| vertex as usize);
        let [a, b, c] = corners.map(|vertex| self.mesh.positions[vertex]);
        let (flat, at) = ((b - a).cross(c - a), eye + ray * t);
        let size = flat.length_squared().max(1e-30);
        let share = |p: Vec3, q: Vec3| ((p - at).cross(q - at).dot(flat) / size).clamp(0.0, 1.0);
        let shares = [share(b, c), share(c, a), share(a, b)];
        let mut normal: Vec3 = (0..3).map(|k| self.smooth[corners[k]] * shares[k]).sum();
        // The inner side of an open surface is seen from behind.
        let outward = if flat.dot(normal) < 0.0 { -flat } else { flat };
        if outward.dot(ray) > 0.0 {
            normal = -normal;
        }
        let normal = normal.normalize_or(Vec3::Z);
        let uvs = self.atlas.uvs[n];
        let uv: Vec2 = (0..3).map(|k| uvs[k] * shares[k]).sum();
        let [u, v] = self.atlas.jacobians[n].map(|way| Vec3::from(self.axes.map(|axis| axis.dot(way))));
        let x = (u - normal * normal.dot(u)).normalize_or(Vec3::X);
        let y = (v - normal * normal.dot(v) - x * x.dot(v)).normalize_or(Vec3::Y);
        let size = self.atlas.size_mm.as_vec2();
        Some(Hit {
            place: (uv * size).to_array(),
            normal: normal.to_array(),
            axes: [x.to_array(), y.to_array()],
            view,
            open: (0..3).map(|k| self.open[corners[k]] * shares[k]).sum(),
        })
    }
}
