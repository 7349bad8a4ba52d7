//! The mesh of the lit view, which shows the material.
use super::app::{ApiError, App, Of};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::{HeaderName, header};
use axum::response::{IntoResponse, Response};
use shibo_bridge::page::PageMesh;
use shibo_value::{Atlas, Carried};

/// Returns the mesh of a scene: 11 floats per vertex (position, normal, direction of +u, texture coordinates), then the
/// vertex indices of all triangles. The header `x-mesh` says `VERTICES INDICES SCALE X Y Z`: the mesh is centred on the
/// origin, y up, its farthest point at distance 1; SCALE is the length of one mm, and X Y Z the position of the origin
/// in mm, z up.
pub(super) async fn mesh(
    State(app): State<App>,
    query: Result<Query<Of>, QueryRejection>,
) -> Result<Response, ApiError> {
    let scene = app.scene(query?.g)?;
    let (node, output) = scene.mesh().ok_or(ApiError::Unknown)?;
    let atlas = app.look(&scene, move |look, _, _| Ok(look.value(node, output)?.and_then(Atlas::unwrap))).await?;
    let atlas = atlas.ok_or(ApiError::Unknown)?;
    Ok(sent(&PageMesh::of(&atlas), &[]))
}

/// The response with a mesh, and bytes after it.
pub(super) fn sent(mesh: &PageMesh, rest: &[u8]) -> Response {
    let PageMesh { vertices, indices, per_mm, middle: [x, y, z], .. } = mesh;
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (HeaderName::from_static("x-mesh"), format!("{} {} {per_mm} {x} {y} {z}", vertices.len(), indices.len())),
    ];
    (head, [mesh.bytes().as_slice(), rest].concat()).into_response()
}
