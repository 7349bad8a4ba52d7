//! Messages to the other program.
use crate::Tools;
use crate::check::{Located, located};
use serde_json::{Map, Value as Json, json};
use shibo_engine::session::Failure;
use shibo_value::diagnostics::{Diagnostic, SourceMap};

/// An answer or an event.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The object to send.
    pub json: Map<String, Json>,
    /// The samples of a picture or the content of a file. The transport decides how they are passed on.
    pub bytes: Option<Vec<u8>>,
    /// The picture of a slot that the message is about. A newer message about it replaces this one.
    pub place: Option<String>,
}

impl Message {
    /// An event without further fields.
    pub fn event(name: &str) -> Self {
        Self { json: Map::from_iter([("event".to_owned(), name.into())]), bytes: None, place: None }
    }

    /// Sets a field.
    pub fn put(&mut self, name: &str, value: impl Into<Json>) {
        self.json.insert(name.to_owned(), value.into());
    }

    /// True for the last message of a request.
    pub fn is_last(&self) -> bool {
        self.json.contains_key("ok") || self.json.contains_key("error")
    }
}

/// Reason why a request fails.
#[derive(Debug)]
pub struct Refusal {
    code: &'static str,
    message: String,
    pub(super) errors: Vec<Json>,
}

impl Refusal {
    /// A refusal with a code of `docs/protocol.md` and a message for people.
    pub fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), errors: Vec::new() }
    }

    /// Errors of a graph.
    pub(super) fn of_graph(tools: &Tools, name: &str, errors: &[Diagnostic], sources: &SourceMap) -> Self {
        let count = errors.len();
        let message = format!("{count} {} in {name}", if count == 1 { "error" } else { "errors" });
        Self { code: "graph", message, errors: diagnostics(tools, errors, sources) }
    }

    pub(super) fn of_failure(tools: &Tools, name: &str, failure: Failure, sources: &SourceMap) -> Self {
        match failure {
            Failure::Errors(errors) => Self::of_graph(tools, name, &errors, sources),
            Failure::Cancelled => Self::cancelled(),
            Failure::File(message) => Self::new("file", message),
            Failure::Usage(message) => Self::new("usage", message),
        }
    }

    /// The refusal of work that was cancelled.
    pub fn cancelled() -> Self {
        Self::new("cancelled", "the work was cancelled")
    }
}

/// Diagnostics as `check --format json` prints them, with their level.
pub(super) fn diagnostics(tools: &Tools, found: &[Diagnostic], sources: &SourceMap) -> Vec<Json> {
    located(tools, found, sources).into_iter().map(leveled).collect()
}

pub(super) fn leveled(one: Located) -> Json {
    let level = if one.warning { "warning" } else { "error" };
    let mut json = json!(one);
    json["level"] = level.into();
    json
}

/// The last answer of a request.
pub(super) fn last(id: impl Into<Option<u64>>, answer: Result<Json, Refusal>) -> Message {
    let mut json = Map::new();
    json.insert("id".into(), id.into().into());
    match answer {
        Ok(ok) => json.insert("ok".into(), ok),
        Err(Refusal { code, message, errors }) => {
            json.insert("error".into(), json!({ "code": code, "message": message, "errors": errors }))
        }
    };
    Message { json, bytes: None, place: None }
}
