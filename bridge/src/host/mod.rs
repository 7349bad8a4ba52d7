//! Requests of other programs as JSON: a program in another language asks, and gets pictures and errors. `docs/protocol.md` has the
//! messages. The transport is not here: `shibo bridge` reads lines, `wasm/` gets calls in memory.
//!
//! A request is an object with `id` and `op`. Its last answer has `ok` or `error`; events come before. Work is done in [`Host::step`],
//! one picture per call, so that a transport can send each answer at once and a program can stop between two pictures.
mod base64;
mod open;
mod render;
#[cfg(test)]
mod tests;

use crate::check::{CheckRequest, check, located};
use crate::{GraphText, Tools};
use open::{Opened, Source};
use render::Render;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json, json};
use shibo_engine::eval::code;
use shibo_engine::session::{Failure, Session};
use shibo_picture::export::TARGETS;
use shibo_value::diagnostics::{Diagnostic, SourceMap};
use std::collections::BTreeMap;

/// The version of the messages.
const PROTOCOL: u32 = 1;
/// Maximum length of a request in bytes.
pub const MOST_BYTES: usize = 16 << 20;
/// Maximum width and height of a picture.
const MOST_PIXELS: u32 = 65_536;

/// An answer or an event.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The object to send.
    pub json: Map<String, Json>,
    /// The samples of a picture, in the form that the request asks for. The transport decides how they are passed on.
    pub bytes: Option<Vec<u8>>,
}

/// Reason why a request fails.
struct Refusal {
    code: &'static str,
    message: String,
    errors: Vec<Json>,
}

impl Refusal {
    fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), errors: Vec::new() }
    }

    /// Errors of a graph.
    fn of_graph(tools: &Tools, name: &str, errors: &[Diagnostic], sources: &SourceMap) -> Self {
        let count = errors.len();
        let message = format!("{count} {} in {name}", if count == 1 { "error" } else { "errors" });
        Self { code: "graph", message, errors: diagnostics(tools, errors, sources) }
    }

    fn of_failure(tools: &Tools, name: &str, failure: Failure, sources: &SourceMap) -> Self {
        match failure {
            Failure::Errors(errors) => Self::of_graph(tools, name, &errors, sources),
            Failure::Cancelled => Self::new("cancelled", "the work was cancelled"),
            Failure::File(message) => Self::new("file", message),
            Failure::Usage(message) => Self::new("usage", message),
        }
    }
}

/// Diagnostics as `check --format json` prints them, with their level.
fn diagnostics(tools: &Tools, found: &[Diagnostic], sources: &SourceMap) -> Vec<Json> {
    located(tools, found, sources).into_iter().map(leveled).collect()
}

fn leveled(one: crate::check::Located) -> Json {
    let level = if one.warning { "warning" } else { "error" };
    let mut json = json!(one);
    json["level"] = level.into();
    json
}

/// What every request has.
#[derive(Deserialize)]
struct Head {
    id: u64,
    op: String,
}

#[derive(Deserialize)]
struct Close {
    graph: String,
}

/// Answers requests, one after the other. It keeps the opened graphs, and their results in memory.
pub struct Host {
    session: Session,
    tools: Tools,
    graphs: BTreeMap<String, Opened>,
    count: u64,
    /// The answer of a request that is already known.
    ready: Option<Message>,
    job: Option<(u64, Render)>,
}

impl Host {
    /// A host whose session has the nodes of `tools`. Graphs that are named by a path are read through the gate of `tools`; graphs
    /// that come as text see only the files in the request.
    pub fn new(session: Session, tools: Tools) -> Self {
        Self { session, tools, graphs: BTreeMap::new(), count: 0, ready: None, job: None }
    }

    /// Takes a request, a JSON object. Unfinished work of the request before is dropped.
    pub fn ask(&mut self, request: &[u8]) {
        self.job = None;
        let (id, answer) = self.answer(request);
        self.ready = match answer {
            Ok(Some(ok)) => Some(last(id, Ok(ok))),
            Ok(None) => None,
            Err(refusal) => Some(last(id, Err(refusal))),
        };
    }

    /// The next answer or event of the request; `None` after the last one.
    pub fn step(&mut self) -> Option<Message> {
        if let Some(message) = self.ready.take() {
            return Some(message);
        }
        let (id, mut render) = self.job.take()?;
        match render.step(&self.session, &self.tools) {
            Ok(Some(mut message)) => {
                message.json.insert("id".into(), id.into());
                self.job = Some((id, render));
                Some(message)
            }
            Ok(None) => Some(last(id, Ok(render.done()))),
            Err(refusal) => Some(last(id, Err(refusal))),
        }
    }

    /// The id of a request, if it has one, and its answer; no answer yet for work that `step` does.
    fn answer(&mut self, request: &[u8]) -> (Option<u64>, Result<Option<Json>, Refusal>) {
        if request.len() > MOST_BYTES {
            let message = format!("the request has {} bytes; at most {MOST_BYTES} are read", request.len());
            return (None, Err(Refusal::new("too-large", message)));
        }
        let json: Json = match serde_json::from_slice(request) {
            Ok(json) => json,
            Err(error) => {
                let message = format!("the request is not JSON: {error}");
                return (None, Err(Refusal::new("bad-request", message)));
            }
        };
        let id = json.get("id").and_then(Json::as_u64);
        (id, self.perform(json))
    }

    fn perform(&mut self, request: Json) -> Result<Option<Json>, Refusal> {
        let head: Head = read(request.clone())?;
        match head.op.as_str() {
            "hello" => Ok(Some(self.hello())),
            "open" => self.open(read(request)?).map(Some),
            "check" => self.check(read(request)?).map(Some),
            "close" => {
                let Close { graph } = read(request)?;
                self.graphs.remove(&graph).ok_or_else(|| no_graph(&graph))?;
                Ok(Some(json!({})))
            }
            "render" => {
                let wanted: render::Request = read(request)?;
                let opened = self.graphs.get(&wanted.graph).ok_or_else(|| no_graph(&wanted.graph))?;
                self.job = Some((head.id, Render::new(opened.source.clone(), wanted)?));
                Ok(None)
            }
            other => {
                let message =
                    format!("there is no operation `{other}`; there are hello, open, check, render and close");
                Err(Refusal::new("unknown-op", message))
            }
        }
    }

    fn hello(&self) -> Json {
        let graphs = shibo_library::graphs().into_iter();
        let graphs: Vec<Json> =
            graphs.map(|graph| json!({ "name": graph.name, "doc": graph.doc(), "part": graph.is_part() })).collect();
        let targets: Vec<&str> = TARGETS.iter().map(|target| target.info().name).collect();
        json!({
            "protocol": PROTOCOL,
            "version": env!("CARGO_PKG_VERSION"),
            "build": code(&self.tools.registry).to_string(),
            "graphs": graphs,
            "targets": targets,
            "limits": { "pixels": MOST_PIXELS },
        })
    }

    fn open(&mut self, request: open::Request) -> Result<Json, Refusal> {
        let source = Source::new(request, &self.tools)?;
        let opened = Opened::new(source, &self.session, &self.tools)?;
        self.count += 1;
        let name = format!("g{}", self.count);
        let mut answer = opened.answer(&self.session, &self.tools);
        answer["graph"] = name.clone().into();
        self.graphs.insert(name, opened);
        Ok(answer)
    }

    fn check(&self, request: open::Request) -> Result<Json, Refusal> {
        let source = Source::new(request, &self.tools)?;
        let tools = Tools { gate: source.gate.clone(), ..self.tools.clone() };
        let text = match source.text {
            Some(text) => text,
            None => source.shipped(&self.tools).ok_or_else(|| {
                Refusal::new(
                    "usage",
                    "`check` takes a text; for a file, send its content as `text` and its name as `graph`",
                )
            })?,
        };
        let checked = check(&tools, &CheckRequest { graph: GraphText { path: source.path, text } });
        Ok(json!({ "diagnostics": checked.diagnostics.into_iter().map(leveled).collect::<Vec<_>>() }))
    }
}

fn no_graph(name: &str) -> Refusal {
    Refusal::new("no-graph", format!("there is no open graph `{name}`; `open` gives its name"))
}

fn read<T: DeserializeOwned>(request: Json) -> Result<T, Refusal> {
    serde_json::from_value(request).map_err(|error| Refusal::new("bad-request", error.to_string()))
}

/// The last answer of a request.
fn last(id: impl Into<Option<u64>>, answer: Result<Json, Refusal>) -> Message {
    let mut json = Map::new();
    json.insert("id".into(), id.into().into());
    match answer {
        Ok(ok) => json.insert("ok".into(), ok),
        Err(Refusal { code, message, errors }) => {
            json.insert("error".into(), json!({ "code": code, "message": message, "errors": errors }))
        }
    };
    Message { json, bytes: None }
}
