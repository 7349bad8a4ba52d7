//! The mesh that wears the material, for the lit view.
use super::coarse::Sent;
use super::handlers::{App, No, Of};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::{HeaderName, header};
use axum::response::{IntoResponse, Response};
use shibo_engine::value::{Atlas, Carried};

/// The mesh of a scene: for each vertex place, normal, direction of +u and coordinates, as 11 floats, and then the numbers of the
/// vertices of all triangles. The header `x-mesh` says `VERTICES INDICES SCALE X Y Z`: it lies around the origin, y up, its
/// farthest point at a distance of 1; a mm is as long as the scale, and the origin lies there in mm, z up.
pub(super) async fn mesh(State(app): State<App>, query: Result<Query<Of>, QueryRejection>) -> Result<Response, No> {
    let scene = app.scene(query?.g)?;
    let (node, output) = scene.mesh().ok_or(No::Unknown)?;
    let atlas = app.look(&scene, move |look, _, _| Ok(look.value(node, output)?.and_then(Atlas::unwrap))).await?;
    let atlas = atlas.ok_or(No::Unknown)?;
    let Sent { vertices, indices, per_mm, middle: [x, y, z], .. } = Sent::of(&atlas);
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (HeaderName::from_static("x-mesh"), format!("{} {} {per_mm} {x} {y} {z}", vertices.len(), indices.len())),
    ];
    let floats = vertices.into_iter().flatten().flat_map(f32::to_le_bytes);
    let bytes: Vec<u8> = floats.chain(indices.into_iter().flat_map(u32::to_le_bytes)).collect();
    Ok((head, bytes).into_response())
}
