//! Bodies of outputs such as `Plate` for the lit view, with few triangles.
use super::app::{ApiError, App, Query2};
use super::export::{files, load};
use super::mesh::sent;
use axum::extract::{Query, State};
use axum::response::Response;
use serde::Deserialize;
use shibo_bridge::page::{preview_body, shown_body};
use shibo_engine::eval::Silent;
use shibo_engine::session::{Failure, RenderRequest};

/// Query: an output.
#[derive(Debug, Deserialize)]
pub(super) struct Which {
    g: u64,
    o: String,
}

/// Returns the body of an output in the format of `mesh`, and after it its report as JSON.
pub(super) async fn body(State(app): State<App>, query: Query2<Which>) -> Result<Response, ApiError> {
    let Query(Which { g, o }) = query?;
    let scene = app.scene(g)?;
    let values = app.stage.values();
    let text = app.stage.texts.get(&scene.sha256).ok_or(ApiError::Nothing)?;
    let made = app.apart(&scene, move |stage, cancel| {
        let mut graph = load(stage, &text, values, None)?;
        if !preview_body(&mut graph, &o) {
            return Ok(None);
        }
        let request = RenderRequest { outputs: vec![o], ..RenderRequest::default() };
        let files = files(stage, &graph, request, cancel, &Silent)?;
        shown_body(&files).map(Some).map_err(Failure::File)
    });
    let (mesh, report) = made.await?.ok_or(ApiError::Unknown)?;
    Ok(sent(&mesh, &report))
}
