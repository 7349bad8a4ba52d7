//! Requests of other programs as JSON: a program in another language asks, and gets pictures and errors. `docs/protocol.md` has the
//! messages. The transport is not here: `shibo bridge` reads lines, `wasm/` gets calls in memory.
//!
//! A request is an object with `id` and `op`. Its last answer has `ok` or `error`; events come before. [`Host::ask`] answers most
//! requests at once. Renders and exports become a [`Job`], which makes one picture per step, so that a transport can send each answer
//! at once, run several jobs at the same time, and stop a job between two pictures or within one.
pub mod base64;
mod job;
mod keep;
mod look;
mod mesh;
mod message;
mod open;
mod others;
#[cfg(test)]
mod page_tests;
mod render;
mod sample;
mod samples;
mod serial;
mod shape;
mod shared;
#[cfg(test)]
mod tests;
mod write;

pub use job::Job;
pub use message::{Message, Refusal};
pub use others::{Begun, Given, OnGraph, Operations, Step, Steps};
pub use serial::Serial;

use crate::GraphText;
use crate::Tools;
use crate::check::{CheckRequest, check};
use crate::light::{BuiltIn, of_file};
use crate::page::edits::FieldEdit;
use job::Work;
use message::{diagnostics, last, leveled};
use open::{Opened, Source};
use render::Render;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value as Json, json};
use shared::{Shared, SlotState};
use shibo_engine::eval::code;
use shibo_engine::session::Session;
use shibo_picture::export::Chosen;
use shibo_value::files::Memory;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use write::Write;

/// The version of the messages.
const PROTOCOL: u32 = 1;
/// Maximum length of a request in bytes.
pub const MOST_BYTES: usize = 16 << 20;
/// Maximum width and height of a picture.
const MOST_PIXELS: u32 = 65_536;
/// Maximum number of slots, and of open graphs.
const MOST_OPEN: usize = 1024;

/// The result of a request.
pub enum Asked {
    /// The last message of the request.
    Answer(Message),
    /// Work whose steps give the messages.
    Job(Box<Job>),
    /// The jobs with the id `of` are to be stopped; then the answer is due.
    Cancel {
        /// The id of the request to stop.
        of: u64,
        /// The last message of the request.
        answer: Message,
    },
    /// Files of pictures are to be removed; then the answer is due.
    Free {
        /// The files, as the transport named them.
        files: Vec<PathBuf>,
        /// The last message of the request.
        answer: Message,
    },
    /// A message for the language server, which the transport passes on.
    Lsp {
        /// The id of the request.
        id: u64,
        /// The message, an object of JSON-RPC.
        message: Json,
        /// The files that the texts see from now on, if the request has any. A server with a disk reads its files there.
        files: Option<Memory>,
    },
}

/// A graph that was read again.
pub struct Reloaded {
    /// The event `changed` or `broken`.
    pub message: Message,
    /// True if the graph has errors.
    pub is_broken: bool,
    /// True if the file is missing or ends too early, as a half-written one.
    pub is_unfinished: bool,
}

/// The fields of every request.
#[derive(Deserialize)]
struct Head {
    id: u64,
    op: String,
}

#[derive(Deserialize)]
struct Close {
    #[serde(default)]
    graph: Option<String>,
    #[serde(default)]
    mesh: Option<String>,
    #[serde(default)]
    slot: Option<String>,
}

#[derive(Deserialize)]
struct Try {
    graph: String,
    edits: Vec<FieldEdit>,
}

#[derive(Deserialize)]
struct Cancel {
    of: u64,
}

#[derive(Deserialize)]
struct Free {
    #[serde(default)]
    files: Vec<PathBuf>,
}

#[derive(Deserialize)]
struct Lsp {
    message: Json,
    #[serde(default)]
    files: Option<BTreeMap<String, String>>,
}

#[derive(Deserialize)]
struct Text {
    graph: String,
}

#[derive(Deserialize)]
struct Light {
    /// An environment of `Relief`.
    #[serde(default)]
    environment: Option<BuiltIn>,
    /// A panorama, in base64.
    #[serde(default)]
    content: Option<String>,
}

/// Answers requests. It keeps the opened graphs, and their results in memory.
pub struct Host {
    shared: Arc<Shared>,
    graphs: BTreeMap<String, Opened>,
    meshes: BTreeMap<String, Arc<mesh::Loaded>>,
    slots: BTreeMap<String, Arc<SlotState>>,
    others: Option<Arc<dyn Operations>>,
    count: u64,
}

impl Host {
    /// A host whose session has the nodes of `tools`. Graphs that are named by a path are read through the gate of `tools`; graphs
    /// that come as text see only the files in the request.
    pub fn new(session: Session, tools: Tools) -> Self {
        let shared = Arc::new(Shared { session, tools });
        let (graphs, meshes, slots) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Self { shared, graphs, meshes, slots, others: None, count: 0 }
    }

    pub(super) fn tools(&self) -> &Tools {
        &self.shared.tools
    }

    /// Takes a request, a JSON object.
    pub fn ask(&mut self, request: &[u8]) -> Asked {
        let (id, answer) = self.answer(request);
        answer.unwrap_or_else(|refusal| Asked::Answer(last(id, Err(refusal))))
    }

    /// The answer to a request that the transport refuses: the code and the message of the error.
    pub fn refused(id: impl Into<Option<u64>>, code: &'static str, message: &str) -> Message {
        last(id, Err(Refusal::new(code, message)))
    }

    /// The answer to a request that the transport has answered by itself.
    pub fn answered(id: u64, ok: Json) -> Message {
        last(id, Ok(ok))
    }

    /// Forgets a picture of a slot: the next render of the slot gives it even if it did not change.
    pub fn forget(&mut self, slot: &str, place: &str) {
        if let Some(state) = self.slots.get(slot) {
            state.forget(place);
        }
    }

    /// True if `graph` is the name of an open graph.
    pub fn is_open(&self, graph: &str) -> bool {
        self.graphs.contains_key(graph)
    }

    /// The files that an open graph reads, to be watched; empty for a graph without a file.
    pub fn files(&self, graph: &str) -> Vec<PathBuf> {
        self.graphs
            .get(graph)
            .filter(|opened| opened.source.has_file())
            .map_or(Vec::new(), |opened| opened.files.clone())
    }

    /// Reads the file of an open graph again. After errors the graph stays as it was. `None` for a graph that is not open.
    pub fn reload(&mut self, graph: &str) -> Option<Reloaded> {
        let opened = self.graphs.get_mut(graph)?;
        let (event, mut fields, is_broken, is_unfinished) = match opened.reload(&self.shared) {
            Ok(()) => ("changed", opened.answer(&self.shared), false, false),
            Err((refusal, is_unfinished)) => ("broken", json!({ "errors": refusal.errors }), true, is_unfinished),
        };
        fields["event"] = event.into();
        fields["graph"] = graph.into();
        let Json::Object(json) = fields else { return None };
        Some(Reloaded { message: Message { json, bytes: None, place: None }, is_broken, is_unfinished })
    }

    /// The id of a request, if it has one, and its result.
    fn answer(&mut self, request: &[u8]) -> (Option<u64>, Result<Asked, Refusal>) {
        if request.len() > MOST_BYTES {
            let message = format!("the request has more than {MOST_BYTES} bytes");
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

    fn perform(&mut self, request: Json) -> Result<Asked, Refusal> {
        let head = Head::deserialize(&request).map_err(|error| Refusal::new("bad-request", error.to_string()))?;
        let answer = |ok: Json| Asked::Answer(last(head.id, Ok(ok)));
        match head.op.as_str() {
            "hello" => Ok(answer(self.hello())),
            "open" => self.open(read(request)?).map(answer),
            "check" => self.check(read(request)?).map(answer),
            "keep" => self.keep(&read(request)?).map(answer),
            "try" => self.try_edits(&read(request)?).map(answer),
            "mesh" => self.mesh(read(request)?).map(answer),
            "close" => {
                match read::<Close>(request)? {
                    Close { graph: Some(graph), .. } => {
                        drop(self.graphs.remove(&graph).ok_or_else(|| no_graph(&graph))?)
                    }
                    Close { mesh: Some(mesh), .. } => drop(self.meshes.remove(&mesh).ok_or_else(|| no_mesh(&mesh))?),
                    Close { slot: Some(slot), .. } => drop(self.slots.remove(&slot)),
                    Close { .. } => return Err(Refusal::new("bad-request", "`graph`, `mesh` or `slot` is missing")),
                }
                Ok(answer(json!({})))
            }
            "render" => {
                let wanted: render::Request = read(request)?;
                let source = self.source(&wanted.graph, &wanted.values.edits)?;
                let slot = match wanted.slot.clone() {
                    Some(name) => Some((name.clone(), self.slot(name)?)),
                    None => None,
                };
                let mesh =
                    wanted.on.as_ref().map(|on| self.meshes.get(&on.mesh).cloned().ok_or_else(|| no_mesh(&on.mesh)));
                let state = slot.as_ref().map(|slot| slot.1.clone());
                let render = Render::new(source, wanted, state, mesh.transpose()?)?;
                Ok(self.job(head.id, slot.map(|slot| slot.0), Work::Render(Box::new(render))))
            }
            "write" => {
                let wanted: write::Request = read(request)?;
                let source = self.source(&wanted.graph, &wanted.values.edits)?;
                Ok(self.job(head.id, None, Work::Write(Box::new(Write::new(source, wanted)?))))
            }
            "sample" => {
                let sample::Request { graph } = read(request)?;
                let samples = sample::Samples::new(self.source(&graph, &[])?);
                Ok(self.job(head.id, None, Work::Sample(Box::new(samples))))
            }
            "look" => {
                let wanted: look::Request = read(request)?;
                let look = look::LookAt::new(self.source(&wanted.graph, &wanted.values.edits)?, wanted)?;
                Ok(self.job(head.id, None, Work::Look(Box::new(look))))
            }
            "shape" => {
                let wanted: shape::Request = read(request)?;
                let shape = shape::Shaping::new(self.source(&wanted.graph, &wanted.values.edits)?, wanted);
                Ok(self.job(head.id, None, Work::Shape(Box::new(shape))))
            }
            "about" => {
                let wanted: look::AboutRequest = read(request)?;
                look::about(&self.source(&wanted.graph, &wanted.values.edits)?, &wanted, &self.shared).map(answer)
            }
            "level" => {
                let wanted: look::LevelRequest = read(request)?;
                look::level(&self.source(&wanted.graph, &wanted.values.edits)?, &wanted, &self.shared).map(answer)
            }
            "cancel" => {
                let Cancel { of } = read(request)?;
                Ok(Asked::Cancel { of, answer: last(head.id, Ok(json!({}))) })
            }
            "free" => {
                let Free { files } = read(request)?;
                Ok(Asked::Free { files, answer: last(head.id, Ok(json!({}))) })
            }
            "text" => {
                let Text { graph } = read(request)?;
                let missing = || Refusal::new("usage", format!("there is no shipped graph `{graph}`"));
                let (path, text) = open::shipped(&graph, &self.shared.tools).ok_or_else(missing)?;
                Ok(answer(json!({ "path": path, "text": text })))
            }
            "light" => Ok(Asked::Answer(light(head.id, read(request)?)?)),
            "lsp" => {
                let Lsp { message, files } = read(request)?;
                Ok(Asked::Lsp { id: head.id, message, files: files.map(open::memory).transpose()? })
            }
            op => {
                let others = self.others.as_ref().map_or(&[][..], |others| others.names());
                if let Some(operations) = self.others.as_ref().filter(|_| others.contains(&op)) {
                    return Ok(match operations.begin(op, request, self)? {
                        Begun::Answer(ok) => answer(ok),
                        Begun::Work(steps) => self.job(head.id, None, Work::Other(steps)),
                    });
                }
                let own = "hello, open, check, render, sample, write, mesh, about, level, look, shape, text, light, keep, try, \
                           cancel, free, lsp and close";
                let known: String = others.iter().map(|name| format!("{name}, ")).collect();
                let message = format!("there is no operation `{op}`; there are {known}{own}");
                Err(Refusal::new("unknown-op", message))
            }
        }
    }

    fn job(&self, id: u64, slot: Option<String>, work: Work) -> Asked {
        Asked::Job(Box::new(Job::new(id, slot, work, self.shared.clone())))
    }

    /// An open graph with values in the texts of nodes. Those that do not fit it are left out.
    fn source(&self, graph: &str, edits: &[FieldEdit]) -> Result<Source, Refusal> {
        Ok(self.graphs.get(graph).ok_or_else(|| no_graph(graph))?.tried(edits, &self.shared).0)
    }

    fn slot(&mut self, name: String) -> Result<Arc<SlotState>, Refusal> {
        if self.slots.len() >= MOST_OPEN && !self.slots.contains_key(&name) {
            return Err(Refusal::new("usage", format!("there are {MOST_OPEN} slots; use one of them again")));
        }
        Ok(self.slots.entry(name).or_default().clone())
    }

    fn hello(&self) -> Json {
        let graphs = shibo_library::graphs().into_iter();
        let graphs: Vec<Json> =
            graphs.map(|graph| json!({ "name": graph.name, "doc": graph.doc(), "part": graph.is_part() })).collect();
        let targets: Vec<&str> = Chosen::variants().into_iter().map(|(name, ..)| name).collect();
        json!({
            "protocol": PROTOCOL,
            "version": env!("CARGO_PKG_VERSION"),
            "build": code(&self.shared.tools.registry).to_string(),
            "graphs": graphs,
            "targets": targets,
            "limits": { "pixels": MOST_PIXELS, "bytes": MOST_BYTES },
        })
    }

    fn open(&mut self, request: open::Request) -> Result<Json, Refusal> {
        if self.graphs.len() >= MOST_OPEN {
            return Err(Refusal::new("usage", format!("{MOST_OPEN} graphs are open; close some of them")));
        }
        let opened = Opened::new(Source::new(request, &self.shared.tools)?, &self.shared)?;
        self.count += 1;
        let name = format!("g{}", self.count);
        let mut answer = opened.answer(&self.shared);
        answer["graph"] = name.clone().into();
        self.graphs.insert(name, opened);
        Ok(answer)
    }

    fn mesh(&mut self, request: mesh::Request) -> Result<Json, Refusal> {
        if self.meshes.len() >= MOST_OPEN {
            return Err(Refusal::new("usage", format!("{MOST_OPEN} meshes are open; close some of them")));
        }
        let (loaded, mut answer) = mesh::Loaded::new(request, &self.shared)?;
        self.count += 1;
        let name = format!("o{}", self.count);
        answer["mesh"] = name.clone().into();
        self.meshes.insert(name, Arc::new(loaded));
        Ok(answer)
    }

    fn check(&self, request: open::Request) -> Result<Json, Refusal> {
        let tools = &self.shared.tools;
        let source = Source::new(request, tools)?;
        let text = match source.text.clone() {
            Some(text) => text.to_string(),
            None => source.shipped(tools).ok_or_else(|| {
                Refusal::new(
                    "usage",
                    "`check` takes a text; for a file, send its content as `text` and its name as `graph`",
                )
            })?,
        };
        let tools = Tools { gate: source.gate, ..tools.clone() };
        let checked = check(&tools, &CheckRequest { graph: GraphText { path: source.path, text } });
        Ok(json!({ "diagnostics": checked.diagnostics.into_iter().map(leveled).collect::<Vec<_>>() }))
    }

    fn try_edits(&self, Try { graph, edits }: &Try) -> Result<Json, Refusal> {
        let (source, refused) = self.graphs.get(graph).ok_or_else(|| no_graph(graph))?.tried(edits, &self.shared);
        let refused: Vec<Json> = refused.iter().map(|(edit, why)| json!({ "edit": edit, "why": why })).collect();
        Ok(json!({ "text": source.text, "refused": refused }))
    }

    fn keep(&mut self, request: &keep::Request) -> Result<Json, Refusal> {
        let opened = self.graphs.get(&request.graph).ok_or_else(|| no_graph(&request.graph))?;
        keep::keep(opened, request, &self.shared.tools)
    }
}

/// The light of an environment: its bytes come with the answer.
fn light(id: u64, wanted: Light) -> Result<Message, Refusal> {
    if cfg!(not(target_family = "wasm")) {
        return Err(Refusal::new("unknown-op", "`light` is for pages that run the module in WebAssembly"));
    }
    let bytes = match (wanted.environment, wanted.content) {
        (Some(built_in), None) => built_in.light(),
        (None, Some(content)) => {
            let wrong = || Refusal::new("bad-request", "the content is not base64");
            of_file(&base64::decode(&content).ok_or_else(wrong)?).map_err(|why| Refusal::new("file", why))?
        }
        _ => return Err(Refusal::new("bad-request", "either `environment` or `content` is needed")),
    };
    Ok(Message { bytes: Some(bytes), ..last(id, Ok(json!({}))) })
}

fn no_graph(name: &str) -> Refusal {
    Refusal::new("no-graph", format!("there is no open graph `{name}`; `open` gives its name"))
}

fn no_mesh(name: &str) -> Refusal {
    Refusal::new("no-mesh", format!("there is no open mesh `{name}`; `mesh` gives its name"))
}

fn read<T: DeserializeOwned>(request: Json) -> Result<T, Refusal> {
    serde_json::from_value(request).map_err(|error| Refusal::new("bad-request", error.to_string()))
}

/// The name of a graph in messages.
fn named(path: &Path) -> String {
    path.display().to_string()
}
