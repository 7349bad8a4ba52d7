//! Routes of the server and handlers of its requests.
use super::assets::asset;
use super::guard::{Guard, guard};
use super::scene::{Scene, Target, View};
use super::stage::{News, Stage, Values};
use super::{change, data, editor, environment, export, map, marks, mesh, thumb, wear};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::rejection::{BytesRejection, QueryRejection};
use axum::extract::{DefaultBodyLimit, Path, Query, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Json, Response};
use axum::routing::{get, post};
use futures_util::stream;
use serde::Deserialize;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, Look};
use shibo_picture::contained;
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Maximum size of a request body in bytes.
const BODY: usize = 64 << 10;
/// Maximum number of listening pages; further ones must poll.
const LISTENERS: usize = 128;
/// Maximum number of looks running at once.
const LOOKS: usize = 3;
/// Maximum number of waiting looks.
const WAITING: usize = 512;
/// After this time without news, a stream sends a comment so that it is not taken for dead.
const ALIVE: Duration = Duration::from_secs(10);

/// Callback that receives the parameter values set by pages; returns whether the watch loop has accepted them.
type Wishes = Arc<dyn Fn(Values) -> bool + Send + Sync>;

/// State shared by all handlers.
#[derive(Clone)]
pub(super) struct App {
    pub(super) stage: Arc<Stage>,
    wishes: Wishes,
    pub(super) jumps: editor::Jumps,
    /// Number of open pages.
    pub(super) pages: Arc<AtomicUsize>,
    listeners: Arc<Semaphore>,
    looks: Arc<Semaphore>,
    waiting: Arc<Semaphore>,
}

/// Builds the routes of the server.
pub(super) fn router(stage: Arc<Stage>, (wishes, jumps): (Wishes, editor::Jumps), who: Guard) -> Router {
    let app = App {
        stage,
        wishes,
        jumps,
        pages: Arc::default(),
        listeners: Arc::new(Semaphore::new(LISTENERS)),
        looks: Arc::new(Semaphore::new(LOOKS)),
        waiting: Arc::new(Semaphore::new(WAITING)),
    };
    Router::new()
        .route("/{token}/", get(|| async { asset("").ok_or(ApiError::Unknown) }))
        .route("/{token}/{file}", get(file))
        .route("/{token}/events", get(events))
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
        .route("/{token}/marks", get(marks::marks))
        .route("/{token}/graph", get(data::graph))
        .route("/{token}/stats", get(data::stats))
        .route("/{token}/values", post(values))
        .route("/{token}/change", post(change::change))
        .route("/{token}/export", post(export::export))
        .route("/{token}/export/{id}", get(export::fetch))
        .route("/{token}/export/{id}/stop", post(export::stop))
        .route("/{token}/environment", get(environment::last).post(environment::take))
        .route("/{token}/show", post(editor::show))
        .route("/{token}/jump", post(editor::jump))
        .layer(DefaultBodyLimit::max(BODY))
        .layer(from_fn_with_state(Arc::new(who), guard))
        .with_state(app)
}

/// Reason why a request fails.
pub(super) enum ApiError {
    /// The request is malformed.
    Bad(String),
    /// The requested thing does not exist.
    Unknown,
    /// The target has no answer of this kind; an object, for example, has no picture.
    Nothing,
    /// The request is about a graph that is no longer shown. The page shows no error, because it cannot know yet.
    Superseded,
    /// The file has another content than the one the request is based on.
    Conflict(String),
    /// Too many requests at once.
    Busy,
    /// The computation failed; the reason is among the errors shown.
    Failed(String),
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let (status, text) = match self {
            Self::Bad(text) => (StatusCode::BAD_REQUEST, text),
            Self::Unknown => (StatusCode::NOT_FOUND, String::new()),
            Self::Nothing | Self::Superseded => (StatusCode::NO_CONTENT, String::new()),
            Self::Conflict(text) => (StatusCode::CONFLICT, text),
            Self::Busy => (StatusCode::SERVICE_UNAVAILABLE, String::new()),
            Self::Failed(text) => (StatusCode::UNPROCESSABLE_ENTITY, text),
        };
        (status, text).into_response()
    }
}

impl From<Failure> for ApiError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Cancelled => Self::Superseded,
            Failure::Errors(errors) => {
                Self::Failed(errors.into_iter().map(|e| e.message).collect::<Vec<_>>().join("\n"))
            }
            Failure::File(text) | Failure::Usage(text) => Self::Failed(text),
        }
    }
}

impl From<QueryRejection> for ApiError {
    fn from(rejection: QueryRejection) -> Self {
        Self::Bad(rejection.body_text())
    }
}

/// Query: a generation of the graph.
#[derive(Debug, Deserialize)]
pub(super) struct Of {
    /// Generation.
    pub(super) g: u64,
}

/// Query: a generation and a target.
#[derive(Debug, Deserialize)]
pub(super) struct About {
    /// Generation.
    g: u64,
    /// Name of the target.
    t: String,
}

impl App {
    /// Passes on parameter values set by a page; returns whether they were accepted.
    pub(super) fn wish(&self, values: Values) -> bool {
        (self.wishes)(values)
    }

    /// Returns the scene if it has this generation.
    pub(super) fn scene(&self, generation: u64) -> Result<Arc<Scene>, ApiError> {
        let scene = self.stage.scene().ok_or(ApiError::Unknown)?;
        if scene.generation == generation { Ok(scene) } else { Err(ApiError::Superseded) }
    }

    /// Returns the scene and the target of a request.
    pub(super) fn about(&self, about: &About) -> Result<(Arc<Scene>, Target), ApiError> {
        let scene = self.scene(about.g)?;
        let target = scene.target(&about.t).ok_or(ApiError::Unknown)?;
        Ok((scene, target))
    }

    /// Waits for a slot in the queue of computations for pages.
    async fn queue(&self) -> Result<OwnedSemaphorePermit, ApiError> {
        let _waiting = self.waiting.clone().try_acquire_owned().map_err(|_| ApiError::Busy)?;
        self.looks.clone().acquire_owned().await.map_err(|_| ApiError::Busy)
    }

    /// Queues and runs `work` with a look into the scene, as long as the page waits and the scene is current.
    pub(super) async fn look<T: Send + 'static>(
        &self,
        scene: &Arc<Scene>,
        work: impl FnOnce(&Look<'_>, &Stage, &Scene) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, ApiError> {
        let of = scene.clone();
        let look = move |stage: &Stage, token: &CancelToken| {
            stage.session.look(&of.graph, &of.keys, token, &Silent, |look| work(look, stage, &of))
        };
        self.apart(scene, look).await
    }

    /// Queues and runs `work` without a look, as long as the page waits and the scene is current.
    pub(super) async fn apart<T: Send + 'static>(
        &self,
        scene: &Arc<Scene>,
        work: impl FnOnce(&Stage, &CancelToken) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, ApiError> {
        let view = View::new(scene);
        let place = self.queue().await?;
        let (stage, token) = (self.stage.clone(), view.token());
        let result = aside(move || {
            let _place = place;
            work(&stage, &token)
        });
        let result = result.await?;
        drop(view);
        Ok(result?)
    }
}

/// Runs `work` on a thread of its own. A panic becomes an error of this request only.
pub(super) async fn aside<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, ApiError> {
    let failed = |said: &str| ApiError::Failed(format!("it could not be made: {said}"));
    let done = tokio::task::spawn_blocking(move || contained(work)).await;
    done.map_err(|_| failed("the server ends"))?.map_err(|said| failed(&format!("there is a defect: {said}")))
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

/// Builds the response for a PNG picture.
pub(super) fn png(bytes: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "image/png")], bytes).into_response()
}

/// Streams events to a page: first the state, then all news.
async fn events(State(app): State<App>, uri: Uri) -> Result<Response, ApiError> {
    let place = app.listeners.clone().try_acquire_owned().map_err(|_| ApiError::Busy)?;
    let page = uri.query() != Some(editor::EDITOR);
    app.pages.fetch_add(usize::from(page), Ordering::Relaxed);
    let listener = Listener { app: app.clone(), news: app.stage.listen(), begun: false, page, _place: place };
    let body = Body::from_stream(stream::unfold(listener, |mut listener| async move {
        let bytes = listener.next().await?;
        Some((Ok::<_, Infallible>(bytes), listener))
    }));
    Ok(([(header::CONTENT_TYPE, "text/event-stream")], body).into_response())
}

struct Listener {
    app: App,
    news: Receiver<News>,
    begun: bool,
    /// True for a page, false for an editor.
    page: bool,
    _place: OwnedSemaphorePermit,
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.app.pages.fetch_sub(usize::from(self.page), Ordering::Relaxed);
    }
}

impl Listener {
    async fn next(&mut self) -> Option<Bytes> {
        if !self.begun {
            self.begun = true;
            return Some(event("state", &self.app.stage.state().to_string()));
        }
        match tokio::time::timeout(ALIVE, self.news.recv()).await {
            Ok(Ok((kind, what))) => Some(event(kind, &what)),
            // The page has missed too much news, so the whole state is sent again.
            Ok(Err(RecvError::Lagged(_))) => {
                self.news = self.news.resubscribe();
                Some(event("state", &self.app.stage.state().to_string()))
            }
            Ok(Err(RecvError::Closed)) => None,
            Err(_) => Some(Bytes::from_static(b": alive\n\n")),
        }
    }
}

fn event(kind: &str, what: &str) -> Bytes {
    format!("event: {kind}\ndata: {what}\n\n").into()
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
    if app.wish(values) { Ok(StatusCode::ACCEPTED) } else { Err(ApiError::Busy.into_response()) }
}

/// Extracted query of a request about a target.
pub(super) type AboutQuery = Result<Query<About>, QueryRejection>;
