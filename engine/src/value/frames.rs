//! Frames: two directions at each point of a surface.
use super::{Mesh, Number, Object, Shapes, Sketch};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Directions on a mesh along which features lie, at its vertices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frames {
    /// The surface.
    pub mesh: Arc<Mesh>,
    /// The direction at each vertex, across the vertex' normal; as long as features are large, 1 by default.
    pub t: Vec<Vec3>,
    /// The second direction; empty if it is t × n everywhere, as long as t.
    pub b: Vec<Vec3>,
    /// How many directions are equally good at each point, evenly spaced round it: 1, 2 or 4.
    pub symmetry: u8,
    /// For each edge of each triangle, from corner `k + 1` to corner `k + 2`, by how many of those directions the field turns
    /// across it; empty if it nowhere does.
    pub turns: Vec<[u8; 3]>,
    /// The triangles in which the field has no direction somewhere, and how often it turns round there, in `symmetry`ths.
    pub singular: Vec<(u32, i8)>,
}

#[derive(Serialize)]
struct SingularData {
    triangle: u32,
    at: [Number<f64>; 3],
    index: Number<f64>,
}

#[derive(Serialize)]
struct FramesData {
    /// Per vertex.
    t: Vec<[Number; 3]>,
    symmetry: u8,
    singular: Vec<SingularData>,
    /// The length in mm of the edges across which the field turns.
    ends_mm: Number<f64>,
}

impl Object for Frames {
    fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.mesh.bytes()
            + size_of_val(&*self.t)
            + size_of_val(&*self.b)
            + size_of_val(&*self.turns)
            + size_of_val(&*self.singular)
    }

    fn data(&self) -> impl Serialize {
        let middle = |triangle: u32| self.mesh.corners(triangle as usize).iter().sum::<DVec3>() / 3.0;
        let singular = |&(triangle, index): &(u32, i8)| SingularData {
            triangle,
            at: middle(triangle).to_array().map(Number),
            index: Number(f64::from(index) / f64::from(self.symmetry.max(1))),
        };
        let edge = |triangle: usize, k: usize| {
            let corners = self.mesh.corners(triangle);
            corners[(k + 1) % 3].distance(corners[(k + 2) % 3])
        };
        let turned = self.turns.iter().enumerate();
        let ends = turned.flat_map(|(n, turns)| (0..3).filter(|k| turns[*k] != 0).map(move |k| edge(n, k)));
        FramesData {
            t: self.t.iter().map(|t| t.to_array().map(Number)).collect(),
            symmetry: self.symmetry,
            singular: self.singular.iter().map(singular).collect(),
            // Both sides list an edge.
            ends_mm: Number(0.5 * ends.sum::<f64>()),
        }
    }

    fn sketch(&self) -> Option<Sketch> {
        let reach = 0.5 * (self.mesh.area() / self.t.len().max(1) as f64).sqrt();
        let line = |n: usize| {
            let (at, t) = (self.mesh.positions[n].as_dvec3(), self.t[n].as_dvec3().normalize_or_zero());
            [at - t * reach, at + t * reach]
        };
        let lines = Shapes::<DVec3>::thinned(self.t.len()).map(line).collect();
        let counts = vec![(self.t.len(), "directions"), (self.singular.len(), "singular points")];
        Some(Sketch::Space(Shapes { lines, counts, ..Shapes::default() }))
    }
}
