//! A mesh as a body.
use super::builder::{Builder, Figures, Receiver, Vertex};
use crate::ground::stop::{Until, unwind_when};
use crate::mesh::topology;
use glam::DVec3;
use shibo_value::{Atlas, Mesh};
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

/// Hands a mesh out, z up, or y up if `y_up`.
///
/// # Errors
/// Those of the receiver.
pub fn model(mesh: &Mesh, y_up: bool, receiver: &mut dyn Receiver) -> io::Result<Figures> {
    // A mesh has no limit of slopes.
    let mut builder = Builder::new(receiver, 90.0);
    let place = |[x, y, z]: [f32; 3]| if y_up { [x, z, -y] } else { [x, y, z] };
    let vertex = |position: &glam::Vec3| builder.vertex(place(position.to_array()));
    let vertices: Vec<Vertex> = mesh.positions.iter().map(vertex).collect::<io::Result<_>>()?;
    for triangle in &mesh.triangles {
        builder.triangle(triangle.map(|corner| vertices[corner as usize]))?;
    }
    Ok(builder.finish())
}
