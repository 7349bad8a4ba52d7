//! Light for the lit view, in one format: the environments of `Relief`, and the user's own. For the latter, a page sends
//! a panorama (EXR or HDR) and gets back its light. That light is kept in memory for this run, so a reloaded page can
//! fetch it again; nothing is written to disk.
use super::app::{ApiError, App, Query2, aside};
use axum::body::{Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use shibo_bridge::light::{BuiltIn, MOST, of_file};
use shibo_bridge::scene::lock;

fn answer(bytes: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
}

/// Query: light.
#[derive(Debug, Deserialize)]
pub(super) struct Asked {
    /// Name of a built-in environment; without it, the last panorama.
    scene: Option<BuiltIn>,
}

/// Reads a panorama and returns its light.
pub(super) async fn take(State(app): State<App>, request: Request) -> Result<Response, Response> {
    if request.headers().get(header::CONTENT_TYPE).is_none_or(|kind| kind != "application/octet-stream") {
        return Err(StatusCode::UNSUPPORTED_MEDIA_TYPE.into_response());
    }
    let environment = &app.stage.environment;
    let _turn = environment.turn.try_acquire().map_err(|_| ApiError::Busy.into_response())?;
    let large = format!("the file has more than {} MiB; scale it down", MOST >> 20);
    let large = |_| (StatusCode::PAYLOAD_TOO_LARGE, large).into_response();
    let file = to_bytes(request.into_body(), MOST).await.map_err(large)?;
    // Runs on the engine's threads, like all computations for pages.
    let scene =
        app.stage.scene().ok_or_else(|| ApiError::Failed("no graph is shown yet".to_owned()).into_response())?;
    let made = app.look(&scene, move |_, _, _| Ok(of_file(&file))).await.map_err(IntoResponse::into_response)?;
    let bytes = Bytes::from(made.map_err(|why| ApiError::Failed(why).into_response())?);
    *lock(&environment.bytes) = Some(bytes.clone());
    Ok(answer(bytes))
}

/// Returns a built-in environment, or the last panorama taken in this run.
pub(super) async fn give(State(app): State<App>, query: Query2<Asked>) -> Result<Response, ApiError> {
    if let Some(built_in) = query?.0.scene {
        return aside(move || built_in.light()).await.map(|bytes| answer(bytes.into()));
    }
    let bytes = lock(&app.stage.environment.bytes).clone();
    bytes.map(answer).ok_or(ApiError::Nothing)
}
