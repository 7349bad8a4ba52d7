//! Opening a graph: its parameters, presets and outputs.
use super::{Refusal, base64, diagnostics};
use crate::Tools;
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use shibo_engine::session::Session;
use shibo_graph::{Gate, Graph, LoadOptions, Loaded, load_text};
use shibo_value::files::Memory;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Prefix of the names of shipped graphs.
const LIBRARY: &str = "shibo:";

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
    pub(super) text: Option<String>,
    pub(super) gate: Gate,
}

impl Source {
    pub(super) fn new(request: Request, tools: &Tools) -> Result<Self, Refusal> {
        let Some(text) = request.text else {
            let path = request.graph.ok_or_else(|| Refusal::new("bad-request", "`graph` or `text` is missing"))?;
            return Ok(Self { path: path.into(), text: None, gate: tools.gate.clone() });
        };
        let mut files = Memory::default();
        for (name, content) in request.files {
            let wrong = || Refusal::new("bad-request", format!("the content of `{name}` is not base64"));
            let content = base64::decode(&content).ok_or_else(wrong)?;
            files = files.with(&name, content);
        }
        let path = request.graph.filter(|name| !name.starts_with(LIBRARY)).unwrap_or_else(|| "graph.ron".to_owned());
        Ok(Self { path: path.into(), text: Some(text), gate: Gate::of(files) })
    }

    /// The text of a shipped graph.
    pub(super) fn shipped(&self, tools: &Tools) -> Option<String> {
        let (library, name) = (tools.registry.library()?, self.path.to_str()?.strip_prefix(LIBRARY)?);
        library.text(&library.find(name)?).map(str::to_owned)
    }

    pub(super) fn load(&self, session: &Session, tools: &Tools, options: LoadOptions) -> Loaded {
        let options = LoadOptions { import_paths: tools.import_paths.clone(), gate: self.gate.clone(), ..options };
        match &self.text {
            Some(text) => load_text(&self.path, text, session.registry(), &options),
            None => session.load(&self.path, &options),
        }
    }

    /// The graph, or all its errors.
    pub(super) fn graph(&self, session: &Session, tools: &Tools, options: LoadOptions) -> Result<Graph, Refusal> {
        let loaded = self.load(session, tools, options);
        loaded.graph.ok_or_else(|| {
            let errors: Vec<_> = loaded.diagnostics.into_iter().filter(|one| !one.warning).collect();
            Refusal::of_graph(tools, &self.path.display().to_string(), &errors, &loaded.sources)
        })
    }
}

/// An open graph.
pub(super) struct Opened {
    pub(super) source: Source,
    graph: Graph,
}

impl Opened {
    pub(super) fn new(source: Source, session: &Session, tools: &Tools) -> Result<Self, Refusal> {
        let graph = source.graph(session, tools, LoadOptions::default())?;
        Ok(Self { source, graph })
    }

    /// The answer of `open`, without the name of the graph.
    pub(super) fn answer(&self, session: &Session, tools: &Tools) -> Json {
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
                    "doc": param.doc,
                    "options": (!param.options.is_empty()).then_some(&param.options),
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
        let presets: Map<String, Json> =
            graph.presets.iter().map(|name| (name.clone(), self.preset(name, session, tools))).collect();
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
            "outputs": outputs,
            "warnings": diagnostics(tools, &graph.warnings, &graph.sources),
        })
    }

    /// The values of a preset.
    fn preset(&self, name: &str, session: &Session, tools: &Tools) -> Json {
        let options = LoadOptions { preset: Some(name.to_owned()), ..LoadOptions::default() };
        let graph = self.source.load(session, tools, options).graph;
        let params = graph.iter().flat_map(|graph| &graph.params);
        let own = params.zip(&self.graph.params).filter(|(of_preset, plain)| of_preset.value != plain.value);
        own.map(|(param, _)| (param.name.clone(), plain(&param.value))).collect::<Map<_, _>>().into()
    }
}

/// A value of RON as JSON: numbers, booleans, texts and tuples of numbers; a word becomes a text.
fn plain(ron: &str) -> Json {
    let list = ron.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')).map(|inside| format!("[{inside}]"));
    let text = list.as_deref().unwrap_or(ron);
    serde_json::from_str(text).unwrap_or_else(|_| ron.into())
}
