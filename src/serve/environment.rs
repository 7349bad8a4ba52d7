//! The user's own environment for the lit view: a page sends an EXR panorama and gets back its light. The light is kept
//! in memory for this run, so a reloaded page can fetch it again; nothing is written to disk.
use super::app::{ApiError, App};
use super::scene::lock;
use super::sky::Sky;
use axum::body::{Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use shibo_picture::{Conversion, ReadLimits, header_bytes, read_bytes};

/// Maximum file size in bytes: 8192 × 4096 pixels with 16 bits per channel fit.
const MOST: usize = 256 << 20;
/// Limits for decoding.
const LIMITS: ReadLimits =
    ReadLimits { max_file_bytes: MOST as u64, max_pixels: 1 << 26, max_bytes_decoded: 768 << 20 };

fn answer(bytes: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
}

/// Reads a panorama and returns its light in the format of [`Sky::bytes`].
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
    let made = app.look(&scene, move |_, _, _| Ok(light(&file))).await.map_err(IntoResponse::into_response)?;
    let bytes = made.map_err(|why| ApiError::Failed(why).into_response())?;
    *lock(&environment.bytes) = Some(bytes.clone());
    Ok(answer(bytes))
}

fn light(file: &[u8]) -> Result<Bytes, String> {
    if !file.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Err("it is no OpenEXR file".to_owned());
    }
    let header = header_bytes(file).map_err(|error| error.to_string())?;
    let mut picture = read_bytes(file, &LIMITS).map_err(|error| error.to_string())?;
    Conversion::of_file(&header).0.apply(&mut picture);
    Ok(Sky::of(&picture)?.bytes().into())
}

/// Returns the last environment taken in this run.
pub(super) async fn last(State(app): State<App>) -> Result<Response, ApiError> {
    let bytes = lock(&app.stage.environment.bytes).clone();
    bytes.map(answer).ok_or(ApiError::Nothing)
}
