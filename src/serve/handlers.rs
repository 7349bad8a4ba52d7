//! Routes of the server and handlers of its requests.
use super::app::{ApiError, App, Wish, Wishes, png};
use super::assets::asset;
use super::guard::{Guard, guard};
use super::position::Jumps;
use super::stage::Stage;
use super::values::Values;
use super::{
    body, change, data, editor, environment, events, export, folder, follow, map, marks, mesh, photo, thumb, wear,
};
use axum::Router;
use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{DefaultBodyLimit, Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Json, Response};
use axum::routing::{get, post};
use std::sync::Arc;

/// Maximum size of a request body in bytes.
const BODY: usize = 64 << 10;

/// Builds the routes of the server.
pub(super) fn router(stage: Arc<Stage>, (wishes, jumps): (Wishes, Jumps), who: Guard) -> Router {
    Router::new()
        .route("/{token}/", get(|| async { asset("").ok_or(ApiError::Unknown) }))
        .route("/{token}/{file}", get(file))
        .route("/{token}/events", get(events::events))
        .route("/{token}/state", get(state))
        .route("/{token}/picture/{file}", get(picture))
        .route("/{token}/look", get(data::look))
        .route("/{token}/tile", get(data::tile))
        .route("/{token}/thumb", get(thumb::thumb))
        .route("/{token}/vary", get(thumb::vary))
        .route("/{token}/probe", get(data::probe))
        .route("/{token}/object", get(data::object))
        .route("/{token}/map", get(map::map))
        .route("/{token}/wear", get(wear::wear))
        .route("/{token}/mesh", get(mesh::mesh))
        .route("/{token}/body", get(body::body))
        .route("/{token}/marks", get(marks::marks))
        .route("/{token}/graph", get(data::graph))
        .route("/{token}/stats", get(data::stats))
        .route("/{token}/values", post(values))
        .route("/{token}/change", post(change::change))
        .route("/{token}/graphs", get(folder::graphs))
        .route("/{token}/open", post(folder::open))
        .route("/{token}/targets", get(export::targets))
        .route("/{token}/export", post(export::export))
        .route("/{token}/export/{id}", get(export::fetch))
        .route("/{token}/export/{id}/stop", post(export::stop))
        .route("/{token}/environment", get(environment::give).post(environment::take))
        .route("/{token}/photo", post(photo::take))
        .route("/{token}/photo/beside", get(photo::beside))
        .route("/{token}/photo/fit", post(photo::fit))
        .route("/{token}/photo/stop", post(photo::stop))
        .route("/{token}/show", post(editor::show))
        .route("/{token}/jump", post(editor::jump))
        .route("/{token}/follow", post(follow::follow))
        .route("/{token}/follow/text", post(follow::text).layer(DefaultBodyLimit::max(follow::BODY)))
        .route("/{token}/follow/answer", post(follow::answer))
        .layer(DefaultBodyLimit::max(BODY))
        .layer(from_fn_with_state(Arc::new(who), guard))
        .with_state(App::new(stage, wishes, jumps))
}

async fn file(Path((_, name)): Path<(String, String)>) -> Result<Response, ApiError> {
    asset(&name).ok_or(ApiError::Unknown)
}

async fn state(State(app): State<App>) -> Response {
    Json(app.stage.state()).into_response()
}

async fn picture(State(app): State<App>, Path((_, file)): Path<(String, String)>) -> Result<Response, ApiError> {
    let id = file.strip_suffix(".png").ok_or(ApiError::Unknown)?;
    let id =
        Some(id).filter(|id| id.len() == 32 && id.bytes().all(|b| b.is_ascii_hexdigit())).ok_or(ApiError::Unknown)?;
    let stored = app.stage.picture(id).ok_or(ApiError::Nothing)?;
    Ok(png(stored.png.clone()))
}

/// Sets values of parameters.
async fn values(
    State(app): State<App>,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
) -> Result<StatusCode, Response> {
    let body = body.map_err(IntoResponse::into_response)?;
    if headers.get(header::CONTENT_TYPE).is_none_or(|kind| kind != "application/json") {
        return Err(StatusCode::UNSUPPORTED_MEDIA_TYPE.into_response());
    }
    let values: Values = serde_json::from_slice(&body).map_err(|e| ApiError::Bad(e.to_string()).into_response())?;
    if app.wish(Wish::Values(values)) { Ok(StatusCode::ACCEPTED) } else { Err(ApiError::Busy.into_response()) }
}
