//! A mesh as a body.
use super::builder::{Builder, Figures, Receiver, Sum, Vertex};
use crate::ground::number::index_u32;
use crate::ground::stop::{Until, unwind_when};
use crate::mesh::topology;
use glam::DVec3;
use shibo_value::{Atlas, Mesh};
use std::collections::BTreeMap;
use std::io;

/// An edge of a mesh at which not exactly two triangles of the same orientation meet: its middle, in mm. `None` for a
/// closed mesh.
///
/// # Errors
/// `until` returned true: an interrupted system call.
pub fn open_edge(mesh: &Mesh, until: Until<'_>) -> io::Result<Option<DVec3>> {
    let across = unwind_when(until, |watch| topology::watched(&mesh.triangles, watch).across);
    let across = across.ok_or(io::ErrorKind::Interrupted)?;
    let edge = |(n, across): (usize, &[u32; 3])| Some((n, across.iter().position(|beyond| *beyond == Atlas::END)?));
    Ok(across.iter().enumerate().find_map(edge).map(|(n, k)| {
        let corners = mesh.corners(n);
        0.5 * (corners[(k + 1) % 3] + corners[(k + 2) % 3])
    }))
}

/// The side to which the triangles of a closed mesh face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facing {
    /// All of its pieces face outwards, apart from the walls of hollows.
    Outwards,
    /// All of its pieces face inwards: the mesh is inside out.
    Inwards,
    /// A piece faces inwards, and others do not: a corner of that piece, in mm.
    Mixed(DVec3),
}

/// A piece of a mesh: triangles that are connected by vertices.
#[derive(Clone, Copy)]
struct Piece {
    first: DVec3,
    volume: Sum,
    bounds: [DVec3; 2],
}

impl Piece {
    /// True for a piece with the volume of a body that is inside out. Rounding does not count.
    fn faces_inwards(&self) -> bool {
        self.volume.total() < -1e-9 * (self.bounds[1] - self.bounds[0]).max_element().powi(3)
    }

    /// True if this box lies within that of another piece.
    fn is_within(&self, other: &Self) -> bool {
        self.bounds[0].cmpge(other.bounds[0]).all() && self.bounds[1].cmple(other.bounds[1]).all()
    }
}

/// The side to which a closed mesh faces. A piece that faces inwards in the box of another one that faces outwards is the
/// wall of a hollow. O(triangles + pieces that face inwards · pieces).
pub fn facing(mesh: &Mesh) -> Facing {
    let mut parent: Vec<u32> = (0..index_u32(mesh.positions.len())).collect();
    for [a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (a, b) = (root(&mut parent, *a), root(&mut parent, *other));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    // The piece of each first vertex.
    let mut pieces: BTreeMap<u32, Piece> = BTreeMap::new();
    for (n, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(n);
        let new = Piece { first: corners[0], volume: Sum::default(), bounds: [corners[0]; 2] };
        let piece = pieces.entry(root(&mut parent, triangle[0])).or_insert(new);
        let [a, b, c] = corners.map(|corner| corner - piece.first);
        piece.volume.add(a.dot(b.cross(c)) / 6.0);
        for corner in corners {
            piece.bounds = [piece.bounds[0].min(corner), piece.bounds[1].max(corner)];
        }
    }
    let (inwards, outwards): (Vec<Piece>, Vec<Piece>) = pieces.into_values().partition(Piece::faces_inwards);
    if outwards.is_empty() && !inwards.is_empty() {
        return Facing::Inwards;
    }
    let wrong = inwards.iter().find(|piece| !outwards.iter().any(|other| piece.is_within(other)));
    wrong.map_or(Facing::Outwards, |piece| Facing::Mixed(piece.first))
}

/// The first vertex of the piece of a vertex. Shortens the way to it.
fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        parent[vertex as usize] = parent[parent[vertex as usize] as usize];
        vertex = parent[vertex as usize];
    }
    vertex
}

/// Hands a mesh out, z up, or y up if `y_up`; with its triangles turned round if `turned`.
///
/// # Errors
/// Those of the receiver.
pub fn model(mesh: &Mesh, (y_up, turned): (bool, bool), receiver: &mut dyn Receiver) -> io::Result<Figures> {
    // A mesh has no limit of slopes.
    let mut builder = Builder::new(receiver, 90.0);
    let place = |[x, y, z]: [f32; 3]| if y_up { [x, z, -y] } else { [x, y, z] };
    let vertex = |position: &glam::Vec3| builder.vertex(place(position.to_array()));
    let vertices: Vec<Vertex> = mesh.positions.iter().map(vertex).collect::<io::Result<_>>()?;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| vertices[corner as usize]);
        builder.triangle(if turned { [a, c, b] } else { [a, b, c] })?;
    }
    Ok(builder.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Boxes from a corner to the opposite one; turned round if the last value is true.
    fn boxes(list: &[(f32, f32, bool)]) -> Mesh {
        const QUADS: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut mesh = Mesh::default();
        for (low, high, turned) in list {
            let first = index_u32(mesh.positions.len());
            let side = |n: u32, axis: u32| if n >> axis & 1 == 1 { *high } else { *low };
            mesh.positions.extend((0..8).map(|n| Vec3::new(side(n, 0), side(n, 1), side(n, 2))));
            for [a, b, c, d] in QUADS.map(|quad| quad.map(|corner| first + corner)) {
                mesh.triangles.extend(if *turned { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
            }
        }
        mesh
    }

    #[test]
    fn meshes_inside_out_are_found_piece_by_piece() {
        let (body, apart) = ((0.0, 10.0, false), (20.0, 24.0, true));
        assert_eq!(open_edge(&boxes(&[body]), &|| false).unwrap(), None);
        assert_eq!(facing(&boxes(&[body])), Facing::Outwards);
        assert_eq!(facing(&boxes(&[(0.0, 10.0, true), apart])), Facing::Inwards);
        assert_eq!(facing(&boxes(&[body, (3.0, 7.0, true)])), Facing::Outwards, "a hollow");
        assert_eq!(facing(&boxes(&[body, apart])), Facing::Mixed(DVec3::new(20.0, 20.0, 20.0)));
        assert_eq!(facing(&Mesh::default()), Facing::Outwards);
    }

    struct Nothing;

    impl Receiver for Nothing {
        fn vertex(&mut self, _: [f32; 3]) -> io::Result<()> {
            Ok(())
        }

        fn triangle(&mut self, _: [Vertex; 3]) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_mesh_that_is_turned_round_has_its_volume() {
        let mesh = boxes(&[(-1.0, 2.0, true)]);
        let volume = |turned| model(&mesh, (true, turned), &mut Nothing).unwrap().volume;
        assert!((volume(false) + 27.0).abs() < 1e-9 && (volume(true) - 27.0).abs() < 1e-9);
    }
}
