//! Points on a surface and the links between them.
use super::{Mesh, Number, Object, Shapes, Sketch};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Points on a mesh, and links between them. Independent of any layout of the mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceNet {
    /// The surface.
    pub mesh: Arc<Mesh>,
    /// Positions of the points in mm.
    pub positions: Vec<DVec3>,
    /// The triangle on which each point lies.
    pub triangles: Vec<u32>,
    /// The unit normal of the surface at each point.
    pub normals: Vec<Vec3>,
    /// Mean distance between neighbours for which they were made, in mm.
    pub pitch: f64,
    /// The two ends of each link.
    pub links: Vec<[u32; 2]>,
    /// The length of each link when it was made, in mm.
    pub lengths: Vec<f32>,
    /// For each link, true if its spring broke; empty if none did.
    pub broken: Vec<bool>,
}

impl SurfaceNet {
    /// The vector from one end of a link to the other.
    pub fn span(&self, link: usize) -> DVec3 {
        let [a, b] = self.links[link].map(|point| self.positions[point as usize]);
        b - a
    }

    /// True if the spring of a link broke.
    pub fn is_broken(&self, link: usize) -> bool {
        self.broken.get(link).is_some_and(|broken| *broken)
    }
}

#[derive(Serialize)]
struct SurfaceNetData {
    points: Vec<[Number<f64>; 3]>,
    triangles: Vec<u32>,
    links: Vec<[u32; 2]>,
    /// Per link.
    broken: Vec<bool>,
}

impl Object for SurfaceNet {
    fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.mesh.bytes()
            + size_of_val(&*self.positions)
            + size_of_val(&*self.triangles)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.links)
            + size_of_val(&*self.lengths)
            + self.broken.len()
    }

    fn data(&self) -> impl Serialize {
        SurfaceNetData {
            points: self.positions.iter().map(|p| p.to_array().map(Number)).collect(),
            triangles: self.triangles.clone(),
            links: self.links.clone(),
            broken: (0..self.links.len()).map(|link| self.is_broken(link)).collect(),
        }
    }

    fn sketch(&self) -> Option<Sketch> {
        let points = Shapes::<DVec3>::thinned(self.positions.len()).map(|n| self.positions[n]).collect();
        let links = Shapes::<DVec3>::thinned(self.links.len());
        let lines = links.clone().map(|n| self.links[n].map(|point| self.positions[point as usize])).collect();
        let broken = if self.broken.is_empty() { Vec::new() } else { links.map(|n| self.is_broken(n)).collect() };
        let counts = vec![(self.positions.len(), "points"), (self.links.len(), "links")];
        Some(Sketch::Space(Shapes { points, lines, broken, counts }))
    }
}
