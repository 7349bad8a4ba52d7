//! Connects the editor and the page: the editor can show a node on the page, and a click on the page shows the node's
//! line in the editor.
use super::app::{ApiError, App};
use super::position::SourcePosition;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Json;
use serde::Deserialize;
use serde_json::{Value as Data, json};

/// Query that marks a listener as an editor rather than a page.
pub(super) const EDITOR: &str = "editor=yes";

#[derive(Debug, Deserialize)]
struct Show {
    target: Option<String>,
}

#[derive(Debug, Deserialize)]
struct Click {
    node: String,
}

fn read<'b, T: Deserialize<'b>>(body: &'b Bytes) -> Result<T, ApiError> {
    serde_json::from_slice(body).map_err(|error| ApiError::Bad(error.to_string()))
}

/// Shows a target that the editor chose, or nothing without one; returns the number of open pages.
pub(super) async fn show(State(app): State<App>, body: Bytes) -> Result<Json<Data>, ApiError> {
    let Show { target } = read(&body)?;
    if let Some(target) = target.filter(|target| !target.is_empty()) {
        app.stage.set_focus(&target);
        app.stage.tell("look", &json!({ "target": target }));
    }
    Ok(Json(json!({ "pages": app.pages.load(std::sync::atomic::Ordering::Relaxed) })))
}

/// Handles a click on a node of the page.
pub(super) async fn jump(State(app): State<App>, body: Bytes) -> Result<StatusCode, ApiError> {
    let Click { node } = read(&body)?;
    let scene = app.stage.scene().ok_or(ApiError::Unknown)?;
    let target = scene.target(&format!("@{node}")).ok_or(ApiError::Unknown)?;
    let Some(place) = SourcePosition::of(&scene.graph, target.node) else { return Ok(StatusCode::NO_CONTENT) };
    app.stage.tell("jump", &json!(place));
    (app.jumps)(&place);
    Ok(StatusCode::ACCEPTED)
}
