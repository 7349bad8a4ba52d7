//! Opening a graph: its parameters, presets and outputs.
use super::shared::Shared;
use super::{Refusal, base64, diagnostics, named};
use crate::Tools;
use crate::page::bodies;
use crate::page::edits::{FieldEdit, tried};
use crate::scene::shown_mesh;
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use sha2::{Digest, Sha256};
use shibo_graph::{Gate, Graph, LoadOptions, Loaded, load_text};
use shibo_value::Type;
use shibo_value::diagnostics::{Code, Diagnostic, SourceMap, Span};
use shibo_value::files::Memory;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Prefix of the names of shipped graphs.
const LIBRARY: &str = "shibo:";

/// `open` gives the values of as many presets as this number of nodes allows: the graph is loaded once for each.
const PRESET_NODES: usize = 100_000;

/// The fields of `open` and `check`.
#[derive(Deserialize)]
pub(super) struct Request {
    /// A path, `shibo:NAME`, or the name of the text.
    #[serde(default)]
    graph: Option<String>,
    /// The graph itself.
    #[serde(default)]
    text: Option<String>,
    /// Files that the text reads: their paths relative to the graph, and their contents as base64.
    #[serde(default)]
    files: BTreeMap<String, String>,
}

/// Where a graph comes from.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) path: PathBuf,
    /// The text; `None` for a shipped graph.
    pub(super) text: Option<Arc<str>>,
    pub(super) gate: Gate,
    /// True if the text is the content of the file at `path`.
    on_disk: bool,
}

impl Source {
    pub(super) fn new(request: Request, tools: &Tools) -> Result<Self, Refusal> {
        let Some(text) = request.text else {
            let name = request.graph.ok_or_else(|| Refusal::new("bad-request", "`graph` or `text` is missing"))?;
            let on_disk = !name.starts_with(LIBRARY);
            return Ok(Self { path: name.into(), text: None, gate: tools.gate.clone(), on_disk });
        };
        let files = memory(request.files)?;
        let is_fit = |name: &String| !name.starts_with(LIBRARY) || shipped(name, tools).is_some();
        let path = request.graph.filter(is_fit).unwrap_or_else(|| "graph.ron".to_owned());
        Ok(Self { path: path.into(), text: Some(text.into()), gate: Gate::of(files), on_disk: false })
    }

    /// True if the graph is a file.
    pub(super) fn has_file(&self) -> bool {
        self.on_disk
    }

    /// The text of a shipped graph.
    pub(super) fn shipped(&self, tools: &Tools) -> Option<String> {
        shipped(self.path.to_str()?, tools).map(|(_, text)| text.to_owned())
    }

    /// Loads the graph: from its text, or from the file if the text was not read yet.
    fn load(&self, shared: &Shared, options: LoadOptions) -> Loaded {
        let Shared { session, tools } = shared;
        let options = LoadOptions { import_paths: tools.import_paths.clone(), gate: self.gate.clone(), ..options };
        match &self.text {
            Some(text) => load_text(&self.path, text, session.registry(), &options),
            None => session.load(&self.path, &options),
        }
    }

    /// The graph, or all its errors.
    pub(super) fn graph(&self, shared: &Shared, options: LoadOptions) -> Result<Graph, Refusal> {
        let Loaded { graph, diagnostics, sources, .. } = self.load(shared, options);
        graph.ok_or_else(|| self.refusal(shared, diagnostics, &sources))
    }

    fn refusal(&self, shared: &Shared, diagnostics: Vec<Diagnostic>, sources: &SourceMap) -> Refusal {
        let errors: Vec<_> = diagnostics.into_iter().filter(|one| !one.warning).collect();
        Refusal::of_graph(&shared.tools, &named(&self.path), &errors, sources)
    }
}

/// The path of a shipped graph in the library, and its text.
pub(super) fn shipped<'t>(name: &str, tools: &'t Tools) -> Option<(String, &'t str)> {
    let (library, name) = (tools.registry.library()?, name.strip_prefix(LIBRARY)?);
    let path = library.find(name)?;
    let text = library.text(&path)?;
    Some((format!("{LIBRARY}/{path}"), text))
}

/// Files from their contents in base64, by name.
pub(super) fn memory(contents: BTreeMap<String, String>) -> Result<Memory, Refusal> {
    let mut files = Memory::default();
    for (name, content) in contents {
        let wrong = || Refusal::new("bad-request", format!("the content of `{name}` is not base64"));
        let content = base64::decode(&content).ok_or_else(wrong)?;
        files = files.with(&name, content);
    }
    Ok(files)
}

/// The SHA-256 of a text, in hexadecimal.
pub(super) fn sha256(text: &str) -> String {
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// An open graph.
pub(super) struct Opened {
    pub(super) source: Source,
    pub(super) graph: Graph,
    /// Every file that was looked for.
    pub(super) files: Vec<PathBuf>,
}

impl Opened {
    pub(super) fn new(mut source: Source, shared: &Shared) -> Result<Self, Refusal> {
        let Loaded { graph, diagnostics, sources, files } = source.load(shared, LoadOptions::default());
        let graph = graph.ok_or_else(|| source.refusal(shared, diagnostics, &sources))?;
        if source.on_disk {
            // Later renders use this text, also while the file is being changed.
            source.text = graph.sources.sources().first().map(|first| first.text.clone());
        }
        Ok(Self { source, graph, files })
    }

    /// Reads the file again. After errors the graph stays as it was; the second part of the error tells whether the file is missing
    /// or ends too early.
    pub(super) fn reload(&mut self, shared: &Shared) -> Result<(), (Refusal, bool)> {
        let source =
            Source { text: if self.source.on_disk { None } else { self.source.text.clone() }, ..self.source.clone() };
        let loaded = source.load(shared, LoadOptions::default());
        self.files = loaded.files;
        let Some(graph) = loaded.graph else {
            let ends_early = |error: &Diagnostic| error.unfinished || error.code == Code::FileNotFound;
            let is_unfinished = loaded.diagnostics.iter().filter(|one| !one.warning).any(ends_early);
            return Err((source.refusal(shared, loaded.diagnostics, &loaded.sources), is_unfinished));
        };
        if self.source.on_disk {
            self.source.text = graph.sources.sources().first().map(|first| first.text.clone());
        }
        self.graph = graph;
        Ok(())
    }

    /// The graph with values in the texts of nodes, and the values that do not fit it, with reasons.
    pub(super) fn tried(&self, edits: &[FieldEdit], shared: &Shared) -> (Source, Vec<(FieldEdit, String)>) {
        let source = |text: Arc<str>| Source { text: Some(text), ..self.source.clone() };
        let first = self.graph.sources.sources().first().map(|first| first.text.clone());
        let Some(text) = first.filter(|_| !edits.is_empty()) else { return (self.source.clone(), Vec::new()) };
        let load = |text: &str| source(text.into()).load(shared, LoadOptions::default());
        let (tried, refused) = tried(&text, &self.graph, edits, &load);
        (source(tried.into()), refused)
    }

    /// The answer of `open`, without the name of the graph.
    pub(super) fn answer(&self, shared: &Shared) -> Json {
        let graph = &self.graph;
        let params: Vec<Json> = graph
            .params
            .iter()
            .map(|param| {
                json!({
                    "name": param.name,
                    "type": param.ty,
                    "value": plain(&param.value),
                    "default": plain(&param.default),
                    "range": param.range.map(|(low, high)| [low, high]),
                    "unit": param.unit,
                    "group": param.group,
                    "doc": param.doc,
                    "options": (!param.options.is_empty()).then_some(&param.options),
                    "source": { "value": param.value, "default": param.default, "line": around(&graph.sources, param.span) },
                })
            })
            .collect();
        let outputs: Vec<Json> = graph
            .outputs
            .iter()
            .map(|output| {
                let mut entry = json!({ "name": output.name, "type": output.ty.name() });
                let channels = graph.nodes[output.node].channels.iter().map(|channel| channel.name());
                if output.ty.is_material() {
                    entry["channels"] = channels.collect::<Vec<_>>().into();
                }
                entry
            })
            .collect();
        let presets: Map<String, Json> = graph
            .presets
            .iter()
            .take(PRESET_NODES / graph.nodes.node_count().max(1))
            .map(|name| (name.clone(), self.preset(name, shared)))
            .collect();
        let breaks = graph
            .breaks_in_tiling()
            .into_iter()
            .map(|(node, why)| json!({ "node": graph.nodes[node].name, "message": why.message, "help": why.help }));
        let canvas = &graph.canvas;
        let tile = match (canvas.tile.x, canvas.tile.y) {
            (true, true) => "Both",
            (true, false) => "X",
            (false, true) => "Y",
            (false, false) => "None",
        };
        json!({
            "params": params,
            "presets": presets,
            "canvas": {
                "size_mm": canvas.size_mm.to_array(),
                "resolution": canvas.resolution.to_array(),
                "tile": tile,
                "seed": canvas.seed,
            },
            "nodes": graph.nodes.node_count(),
            "breaks": breaks.collect::<Vec<_>>(),
            "outputs": outputs,
            "solid": graph.nodes.node_weights().any(|node| node.outputs.contains(&Type::SolidColor)),
            "bodies": bodies(graph),
            "mesh": shown_mesh(graph).is_some(),
            "sha256": graph.sources.sources().first().map(|first| sha256(&first.text)),
            "warnings": diagnostics(&shared.tools, &graph.warnings, &graph.sources),
        })
    }

    /// The values of a preset.
    fn preset(&self, name: &str, shared: &Shared) -> Json {
        let options = LoadOptions { preset: Some(name.to_owned()), ..LoadOptions::default() };
        let graph = self.source.load(shared, options).graph;
        let params = graph.iter().flat_map(|graph| &graph.params);
        let own = params.zip(&self.graph.params).filter(|(of_preset, plain)| of_preset.value != plain.value);
        own.map(|(param, _)| (param.name.clone(), plain(&param.value))).collect::<Map<_, _>>().into()
    }
}

/// The text before and after a default on its line.
fn around(sources: &SourceMap, span: Span) -> [String; 2] {
    let text = sources.text(span.file);
    let before = text.get(..span.start).and_then(|text| text.rsplit('\n').next()).unwrap_or("");
    let after = text.get(span.end..).and_then(|text| text.split('\n').next()).unwrap_or("");
    [before.trim_start().to_owned(), after.trim_end().to_owned()]
}

/// A value of RON as JSON: numbers, booleans, texts and tuples of numbers; a word becomes a text.
fn plain(ron: &str) -> Json {
    let list = ron.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')).map(|inside| format!("[{inside}]"));
    let text = list.as_deref().unwrap_or(ron);
    serde_json::from_str(text).unwrap_or_else(|_| ron.into())
}
