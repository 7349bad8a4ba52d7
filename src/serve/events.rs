//! News for pages and editors, as streams of events.
use super::app::{ApiError, App};
use super::editor;
use super::stage::News;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{Uri, header};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use std::convert::Infallible;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;

/// After this time without news, a stream sends a comment so that it is not taken for dead.
const ALIVE: Duration = Duration::from_secs(10);

/// Streams events to a page: first the state, then all news.
pub(super) async fn events(State(app): State<App>, uri: Uri) -> Result<Response, ApiError> {
    let place = app.listeners.clone().try_acquire_owned().map_err(|_| ApiError::Busy)?;
    let page = uri.query() != Some(editor::EDITOR);
    app.pages.fetch_add(usize::from(page), Ordering::Relaxed);
    let listener = Listener { app: app.clone(), news: app.stage.listen(), begun: false, page, _place: place };
    Ok(streamed(listener))
}

/// A source of events.
pub(super) trait Events: Send + 'static {
    /// The next event; `None` at the end of the stream.
    fn next(&mut self) -> impl Future<Output = Option<Bytes>> + Send;
}

/// The response that streams events.
pub(super) fn streamed(events: impl Events) -> Response {
    let body = Body::from_stream(stream::unfold(events, |mut events| async move {
        let bytes = events.next().await?;
        Some((Ok::<_, Infallible>(bytes), events))
    }));
    ([(header::CONTENT_TYPE, "text/event-stream")], body).into_response()
}

/// Waits for a message; after a while without one, returns a comment.
pub(super) async fn soon<T>(message: impl Future<Output = T>) -> Result<T, Bytes> {
    tokio::time::timeout(ALIVE, message).await.map_err(|_| Bytes::from_static(b": alive\n\n"))
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

impl Events for Listener {
    async fn next(&mut self) -> Option<Bytes> {
        if !self.begun {
            self.begun = true;
            return Some(event("state", &self.app.stage.state().to_string()));
        }
        match soon(self.news.recv()).await {
            Ok(Ok((kind, what))) => Some(event(kind, &what)),
            // The page has missed too much news, so the whole state is sent again.
            Ok(Err(RecvError::Lagged(_))) => {
                self.news = self.news.resubscribe();
                Some(event("state", &self.app.stage.state().to_string()))
            }
            Ok(Err(RecvError::Closed)) => None,
            Err(comment) => Some(comment),
        }
    }
}

/// Formats an event.
pub(super) fn event(kind: &str, what: &str) -> Bytes {
    format!("event: {kind}\ndata: {what}\n\n").into()
}
