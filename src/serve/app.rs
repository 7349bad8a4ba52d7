//! State shared by all handlers of requests, and their errors.
use super::position::Jumps;
use super::stage::Stage;
use super::values::Values;
use axum::body::Bytes;
use axum::extract::Query;
use axum::extract::rejection::QueryRejection;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use shibo_bridge::scene::{Scene, Target, View};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, Look};
use shibo_picture::contained;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Maximum number of listening pages; further ones must poll.
const LISTENERS: usize = 128;

/// Maximum number of looks running at once.
const LOOKS: usize = 3;

/// Maximum number of waiting looks.
const WAITING: usize = 512;

/// A request of a page to the watch loop.
#[derive(Debug)]
pub(crate) enum Wish {
    /// Sets values of parameters and of fields of nodes.
    Values(Values),
    /// Shows another graph.
    Open(PathBuf),
    /// Shows the texts of the editor that follows the graph, which have changed.
    Texts,
}

/// Callback that receives the wishes of pages; returns whether the watch loop has accepted them.
pub(super) type Wishes = Arc<dyn Fn(Wish) -> bool + Send + Sync>;

/// State shared by all handlers.
#[derive(Clone)]
pub(super) struct App {
    pub(super) stage: Arc<Stage>,
    wishes: Wishes,
    pub(super) jumps: Jumps,
    /// Number of open pages.
    pub(super) pages: Arc<AtomicUsize>,
    pub(super) listeners: Arc<Semaphore>,
    looks: Arc<Semaphore>,
    waiting: Arc<Semaphore>,
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

/// Extracted query.
pub(super) type Query2<T> = Result<Query<T>, QueryRejection>;

/// Extracted query of a request about a target.
pub(super) type AboutQuery = Result<Query<About>, QueryRejection>;

impl App {
    pub(super) fn new(stage: Arc<Stage>, wishes: Wishes, jumps: Jumps) -> Self {
        Self {
            stage,
            wishes,
            jumps,
            pages: Arc::default(),
            listeners: Arc::new(Semaphore::new(LISTENERS)),
            looks: Arc::new(Semaphore::new(LOOKS)),
            waiting: Arc::new(Semaphore::new(WAITING)),
        }
    }

    /// Passes on a wish of a page; returns whether it was accepted.
    pub(super) fn wish(&self, wish: Wish) -> bool {
        (self.wishes)(wish)
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

/// Builds the response for a PNG picture.
pub(super) fn png(bytes: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "image/png")], bytes).into_response()
}
