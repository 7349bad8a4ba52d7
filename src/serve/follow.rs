//! An editor that follows the graph: it sends the texts as they are typed, and makes the changes of pages. It holds one
//! connection open; when that is closed, the files count again.
use super::app::{ApiError, App, Wish};
use super::buffers::{LONGEST_TEXT, Message, Refused};
use super::events::{Events, event, soon, streamed};
use super::texts::sha256;
use super::token;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use shibo_ide::identity;
use std::path::PathBuf;
use std::time::Duration;
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::mpsc::UnboundedReceiver;

/// Maximum size of the request with a text: in JSON a character may take six bytes.
pub(super) const BODY: usize = 6 * LONGEST_TEXT + (16 << 10);
/// The longest time for which a text is waited for, before the editor sends a newer one.
const SEEN: Duration = Duration::from_millis(500);

/// Request: the graph that the editor wants to follow.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Begin {
    graph: PathBuf,
}

/// Request: a text, or none if the file itself counts. The path is only compared with those that the graph reads.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Typed {
    id: String,
    file: PathBuf,
    text: Option<String>,
}

/// Request: the result of a change.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Answered {
    id: String,
    number: u64,
    why: Option<String>,
}

fn read<T: DeserializeOwned>(body: &Bytes) -> Result<T, ApiError> {
    serde_json::from_slice(body).map_err(|error| ApiError::Bad(error.to_string()))
}

/// The connection to the editor.
struct Session {
    app: App,
    id: String,
    messages: UnboundedReceiver<Message>,
    _place: OwnedSemaphorePermit,
}

impl Events for Session {
    async fn next(&mut self) -> Option<Bytes> {
        match soon(self.messages.recv()).await {
            Ok(message) => message.map(|(kind, what)| event(kind, &what)),
            Err(comment) => Some(comment),
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if self.app.stage.buffers.end(&self.id) {
            self.app.wish(Wish::Texts);
        }
    }
}

/// Begins to follow: the answer is a stream of messages to the editor, first the name of the session.
pub(super) async fn follow(State(app): State<App>, body: Bytes) -> Result<Response, ApiError> {
    let Begin { graph } = read(&body)?;
    let path = app.stage.path();
    if graph != identity(&path) {
        return Err(ApiError::Conflict(format!("the page shows `{}` now", path.display())));
    }
    let place = app.listeners.clone().try_acquire_owned().map_err(|_| ApiError::Busy)?;
    let id = token::random().map_err(|quit| ApiError::Failed(quit.text()))?;
    let messages = app.stage.buffers.begin(id.clone());
    let session = Session { app: app.clone(), id, messages, _place: place };
    app.wish(Wish::Texts);
    Ok(streamed(session))
}

/// Takes a text, and answers once the page shows it, or its errors. The editor then sends the next one, so that a newer
/// text does not end the work on each text before it.
pub(super) async fn text(State(app): State<App>, body: Bytes) -> Result<StatusCode, ApiError> {
    let Typed { id, file, text } = read(&body)?;
    // Subscribed before the text is passed on, so that no news is missed.
    let mut news = app.stage.listen();
    let sha = text.as_deref().map(sha256);
    match app.stage.buffers.set(&id, &file, text.map(Into::into)) {
        Ok(true) => {}
        Ok(false) => return Ok(StatusCode::NO_CONTENT),
        Err(Refused::Over) => return Err(ApiError::Conflict("this editor no longer follows the graph".to_owned())),
        Err(Refused::Large(why)) => return Err(ApiError::Failed(why)),
    }
    if !app.wish(Wish::Texts) {
        return Err(ApiError::Busy);
    }
    if let Some(sha) = sha.filter(|_| file == identity(&app.stage.path())) {
        let shown = async {
            while let Ok((kind, _)) = news.recv().await {
                let is_shown = || app.stage.scene().is_some_and(|scene| scene.sha256 == sha);
                if kind == "held" || (matches!(kind, "shown" | "done") && is_shown()) {
                    return;
                }
            }
        };
        let _ = tokio::time::timeout(SEEN, shown).await;
    }
    Ok(StatusCode::NO_CONTENT)
}

/// Takes the answer of the editor to a change of the page.
pub(super) async fn answer(State(app): State<App>, body: Bytes) -> Result<StatusCode, ApiError> {
    let Answered { id, number, why } = read(&body)?;
    app.stage.buffers.answer(&id, number, why);
    Ok(StatusCode::NO_CONTENT)
}
