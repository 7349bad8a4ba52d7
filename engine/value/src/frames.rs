//! Frames: two directions at each point of a surface.
use super::{Mesh, Number, Object, Shapes, Sketch};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Directions of features on a mesh, at its vertices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frames {
    /// The surface.
    pub mesh: Arc<Mesh>,
    /// Direction at each vertex, perpendicular to the vertex' normal; its length is the size of features, 1 by default.
    pub t: Vec<Vec3>,
    /// The second direction; empty if it is t × n everywhere, with the length of t.
    pub b: Vec<Vec3>,
    /// Number of equivalent directions at each point, evenly spaced around it: 1, 2 or 4.
    pub symmetry: u8,
    /// The turn of the field along each edge of each triangle, from corner `k + 1` to corner `k + 2`, in steps between
    /// equivalent directions; empty if all are 0. Within a triangle, directions match that of the first corner.
    pub turns: Vec<[u8; 3]>,
    /// The singular triangles, in which the field has no direction at some point, and their index in `symmetry`ths of a
    /// turn.
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
    /// The length in mm of the lines where directions do not match.
    ends_mm: Number<f64>,
}

impl Frames {
    /// The edges, as triangle and `k`, at which the directions of two triangles do not match: the lines where a combed
    /// field ends. Both sides are listed, in ascending order.
    pub fn ends(&self) -> Vec<(usize, usize)> {
        let n = i32::from(self.symmetry.max(1));
        // The turn of a corner, in steps, that makes it match the first corner.
        let turned = |triangle: usize, corner: usize| {
            let [_, from_last, to_next] = self.turns[triangle].map(i32::from);
            [0, -to_next, from_last][corner].rem_euclid(n)
        };
        let edge = |triangle: usize, k: usize| {
            let mut ends = [(k + 1) % 3, (k + 2) % 3].map(|c| (self.mesh.triangles[triangle][c], turned(triangle, c)));
            ends.sort_unstable();
            (ends.map(|end| end.0), triangle, k, ends.map(|end| end.1))
        };
        let all = 0..self.turns.len();
        let mut edges: Vec<_> = all.flat_map(|triangle| (0..3).map(move |k| edge(triangle, k))).collect();
        edges.sort_unstable();
        let apart = edges.chunk_by(|a, b| a.0 == b.0).filter(|sides| sides.iter().any(|side| side.3 != sides[0].3));
        let mut found: Vec<(usize, usize)> = apart.flatten().map(|&(_, triangle, k, _)| (triangle, k)).collect();
        found.sort_unstable();
        found
    }

    /// Length of those lines in mm.
    pub fn ends_mm(&self) -> f64 {
        let length = |(triangle, k): (usize, usize)| {
            let corners = self.mesh.corners(triangle);
            corners[(k + 1) % 3].distance(corners[(k + 2) % 3])
        };
        // An edge is listed from both sides.
        self.ends().into_iter().map(length).sum::<f64>() / 2.0
    }
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
        FramesData {
            t: self.t.iter().map(|t| t.to_array().map(Number)).collect(),
            symmetry: self.symmetry,
            singular: self.singular.iter().map(singular).collect(),
            ends_mm: Number(self.ends_mm()),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that share the edge from vertex 1 to 2, of 5 mm, with directions that match up to half a turn.
    fn frames(turns: Vec<[u8; 3]>) -> Frames {
        let positions = vec![Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0), Vec3::new(3.0, 4.0, 0.0)];
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [2, 1, 3]], parts: vec![0; 2], ..Mesh::default() };
        Frames { mesh: Arc::new(mesh), t: vec![Vec3::X; 4], b: Vec::new(), symmetry: 2, turns, singular: Vec::new() }
    }

    #[test]
    fn combed_directions_end_where_triangles_do_not_fit() {
        assert!(frames(Vec::new()).ends().is_empty());
        // The direction at vertex 0 is turned, and the first triangle matches it.
        let turned = frames(vec![[0, 1, 1], [0; 3]]);
        assert_eq!((turned.ends(), turned.ends_mm()), (vec![(0, 0), (1, 2)], 5.0));
        // The direction at vertex 3 is turned, but the second triangle starts at another corner.
        assert_eq!(frames(vec![[0; 3], [1, 1, 0]]).ends(), []);
    }
}
