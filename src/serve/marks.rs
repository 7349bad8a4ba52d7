//! Overlays for the mesh of the lit view: see [`shibo_bridge::page::marks`].
use super::app::{ApiError, App, Of};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::response::{IntoResponse, Json, Response};
use shibo_bridge::page;

/// Returns the overlays of the scene's mesh, or null if it has none, since the page may ask just as another graph
/// replaces this one.
pub(super) async fn marks(
    State(app): State<App>,
    query: Result<Query<Of>, QueryRejection>,
) -> Result<Response, ApiError> {
    let scene = app.scene(query?.g)?;
    let found = app.look(&scene, move |look, _, scene| page::marks(look, scene)).await?;
    Ok(Json(found).into_response())
}
