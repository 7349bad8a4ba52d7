//! Writing the outputs of a graph to files, as `shibo render` does.
use super::open::Source;
use super::render::{Parameters, check_size};
use super::shared::Around;
use super::{Message, Refusal, diagnostics, named};
use crate::scene::lock;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use shibo_engine::eval::{Event, Observer};
use shibo_engine::session::RenderRequest;
use shibo_graph::Graph;
use shibo_picture::export::Chosen;
use shibo_value::diagnostics::Diagnostic;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Mutex;

/// The fields of `write`.
#[derive(Deserialize)]
pub(super) struct Request {
    pub(super) graph: String,
    /// The folder; without a disk there is none, and the files come as events.
    #[serde(default)]
    folder: Option<PathBuf>,
    /// A name of `hello`'s `targets`; without one, the outputs are written as the graph states.
    #[serde(default)]
    target: Option<String>,
    /// `OUTPUT` or `OUTPUT.CHANNEL`; all by default.
    #[serde(default)]
    outputs: Vec<String>,
    #[serde(flatten)]
    pub(super) values: Parameters,
    /// Pixels of the longer side.
    #[serde(default)]
    size: Option<u32>,
}

/// An unfinished export.
pub(super) struct Write {
    source: Source,
    wanted: Request,
    target: Option<Chosen>,
    /// The names of all files and the warnings, once they are written.
    done: Option<Json>,
    /// The files that were not given yet.
    waiting: VecDeque<(String, Vec<u8>)>,
}

impl Write {
    pub(super) fn new(source: Source, wanted: Request) -> Result<Self, Refusal> {
        wanted.size.map_or(Ok(()), check_size)?;
        if wanted.folder.is_some() != HAS_DISK {
            let message = if HAS_DISK { "`folder` is missing" } else { "there is no disk here, so leave `folder` out" };
            return Err(Refusal::new("usage", message));
        }
        let named = |name: &String| {
            let found = Chosen::variants().into_iter().find(|(known, ..)| known == name);
            found.map(|(.., chosen)| chosen).ok_or_else(|| {
                let all: Vec<&str> = Chosen::variants().into_iter().map(|(name, ..)| name).collect();
                Refusal::new("usage", format!("there is no target `{name}`; there are {}", all.join(", ")))
            })
        };
        let target = wanted.target.as_ref().map(named).transpose()?;
        Ok(Self { source, wanted, target, done: None, waiting: VecDeque::new() })
    }

    pub(super) fn step(&mut self, around: &Around<'_>) -> Result<Option<Message>, Refusal> {
        if self.done.is_none() {
            self.write(around)?;
        }
        Ok(self.waiting.pop_front().map(|(name, bytes)| {
            let mut message = Message::event("file");
            message.put("name", name);
            message.bytes = Some(bytes);
            message
        }))
    }

    /// The answer after the last file.
    pub(super) fn done(&mut self) -> Json {
        self.done.take().unwrap_or_default()
    }

    fn write(&mut self, around: &Around<'_>) -> Result<(), Refusal> {
        let (session, tools) = (&around.shared.session, &around.shared.tools);
        let mut graph = self.source.graph(around.shared, self.wanted.values.options(self.wanted.size))?;
        if let Some(target) = &self.target {
            let exported = graph.export_as(target, !self.wanted.outputs.is_empty());
            exported.map_err(|message| Refusal::new("usage", message))?;
        }
        let warnings = Warnings { found: Mutex::default(), also: around.observer };
        let request = RenderRequest {
            dir: self.wanted.folder.clone().unwrap_or_default(),
            outputs: self.wanted.outputs.clone(),
            ..RenderRequest::default()
        };
        let report = session.render(&graph, &request, around.cancel, &warnings);
        // Files of a render that failed are dropped with the error.
        let files = taken();
        let report =
            report.map_err(|failure| Refusal::of_failure(tools, &named(&self.source.path), failure, &graph.sources))?;
        self.waiting = files;
        self.done = Some(json!({
            "files": report.files,
            "notes": report.notes,
            "warnings": self.warnings(around, &graph, &warnings),
        }));
        Ok(())
    }

    fn warnings(&self, around: &Around<'_>, graph: &Graph, warnings: &Warnings<'_>) -> Vec<Json> {
        diagnostics(&around.shared.tools, &lock(&warnings.found), &graph.sources)
    }
}

/// True where files are written to a disk.
const HAS_DISK: bool = cfg!(not(target_family = "wasm"));

/// The files that were written to memory, because there is no disk.
#[cfg(target_family = "wasm")]
fn taken() -> VecDeque<(String, Vec<u8>)> {
    let files = shibo_picture::taken_files().into_iter();
    files.map(|(path, bytes)| (path.to_string_lossy().into_owned(), bytes)).collect()
}

#[cfg(not(target_family = "wasm"))]
fn taken() -> VecDeque<(String, Vec<u8>)> {
    VecDeque::new()
}

/// Collects warnings, and passes other events on.
struct Warnings<'a> {
    found: Mutex<Vec<Diagnostic>>,
    also: &'a dyn Observer,
}

impl Observer for Warnings<'_> {
    fn event(&self, event: Event) {
        match event {
            Event::Warning(warning) => lock(&self.found).push(warning),
            event => self.also.event(event),
        }
    }
}
