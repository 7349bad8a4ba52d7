//! An environment of the user's own for the lit view: an EXR panorama that a page sends, answered as light. It is kept for this
//! run only, so that a page that is loaded again has it; nothing is written.
use super::handlers::{App, No};
use super::scene::lock;
use super::sky::Sky;
use axum::body::{Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use shibo_engine::picture::{Conversion, ReadLimits, header_bytes, read_bytes};
use std::sync::Mutex;
use tokio::sync::Semaphore;

/// The most bytes of a file: enough for 8192 × 4096 pixels with 16 bits a channel.
const MOST: usize = 256 << 20;
/// What the decoding may cost.
const LIMITS: ReadLimits =
    ReadLimits { max_file_bytes: MOST as u64, max_pixels: 1 << 26, max_bytes_decoded: 768 << 20 };

/// The environment of a run.
pub(crate) struct Environment {
    bytes: Mutex<Option<Bytes>>,
    /// One panorama is read at a time.
    turn: Semaphore,
}

impl Default for Environment {
    fn default() -> Self {
        Self { bytes: Mutex::default(), turn: Semaphore::new(1) }
    }
}

fn answer(bytes: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
}

/// Takes a panorama; its light is answered, see [`Sky::bytes`].
pub(super) async fn take(State(app): State<App>, request: Request) -> Result<Response, Response> {
    if request.headers().get(header::CONTENT_TYPE).is_none_or(|kind| kind != "application/octet-stream") {
        return Err(StatusCode::UNSUPPORTED_MEDIA_TYPE.into_response());
    }
    let environment = &app.stage.environment;
    let _turn = environment.turn.try_acquire().map_err(|_| No::Busy.into_response())?;
    let large = format!("the file has more than {} MiB; scale it down", MOST >> 20);
    let large = |_| (StatusCode::PAYLOAD_TOO_LARGE, large).into_response();
    let file = to_bytes(request.into_body(), MOST).await.map_err(large)?;
    // On the threads of the engine, as all that is computed for pages.
    let scene = app.stage.scene().ok_or_else(|| No::Failed("no graph is shown yet".to_owned()).into_response())?;
    let made = app.look(&scene, move |_, _, _| Ok(light(&file))).await.map_err(IntoResponse::into_response)?;
    let bytes = made.map_err(|why| No::Failed(why).into_response())?;
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

/// The environment that was last taken in this run.
pub(super) async fn last(State(app): State<App>) -> Result<Response, No> {
    let bytes = lock(&app.stage.environment.bytes).clone();
    bytes.map(answer).ok_or(No::Nothing)
}
