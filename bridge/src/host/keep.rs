//! Writing values of parameters into the file of a graph.
use super::open::{Opened, Source, sha256};
use super::{Refusal, named, render};
use crate::Tools;
use crate::page::edits::{FieldEdit, changed, promoted, written};
use crate::write::{Refused, change};
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use shibo_graph::{GraphParam, LoadOptions, load_text};
use shibo_ide::actions::{add_preset, assign, put_preset};
use shibo_ide::{Cx, Workspace};
use std::io::Read;

/// The fields of `keep`.
#[derive(Deserialize)]
pub(super) struct Request {
    pub(super) graph: String,
    /// The values, by the names of the parameters.
    #[serde(default)]
    values: Map<String, Json>,
    /// The preset that gets the values; without one, they become defaults.
    #[serde(default)]
    preset: Option<String>,
    /// Makes `preset` as a new preset.
    #[serde(default)]
    add: bool,
    /// Makes `preset` with this comment above it, or replaces it.
    #[serde(default)]
    comment: Option<String>,
    /// Values in the texts of nodes.
    #[serde(default)]
    edits: Vec<FieldEdit>,
    /// A value of a node that becomes a parameter.
    #[serde(default)]
    promote: Option<Place>,
    /// The hash of the content that the values are for, as `open` gave it.
    sha256: String,
}

/// A field of a node.
#[derive(Deserialize)]
struct Place {
    node: String,
    field: String,
}

/// Writes the values; returns the hash of the new content, and the content of a graph without a file.
pub(super) fn keep(opened: &Opened, request: &Request, tools: &Tools) -> Result<Json, Refusal> {
    let source = &opened.source;
    let name = named(&source.path);
    let other = || Refusal::new("changed", format!("`{name}` is another file by now; nothing was written"));
    let before = match &source.text {
        Some(text) if !source.has_file() => text.to_string(),
        _ if source.has_file() => on_disk(source, &name)?.ok_or_else(other)?,
        _ => return Err(Refusal::new("usage", "`keep` needs a graph that was opened by its path or as a text")),
    };
    if sha256(&before) != request.sha256 {
        return Err(other());
    }
    let values: Vec<(String, String)> =
        request.values.iter().map(|(name, value)| (name.clone(), literal(name, value, &opened.graph.params))).collect();
    let mut workspace =
        Workspace::new(tools.registry.clone(), Vec::new()).with_import_paths(tools.import_paths.clone());
    let file = workspace.open(&source.path, before.as_str());
    let cx = Cx { world: &workspace, file: &file };
    let options =
        LoadOptions { import_paths: tools.import_paths.clone(), gate: source.gate.clone(), ..LoadOptions::default() };
    let load = |text: &str| {
        let loaded = load_text(&source.path, text, &tools.registry, &options);
        let errors: Vec<_> = loaded.diagnostics.into_iter().filter(|one| !one.warning).collect();
        loaded
            .graph
            .filter(|_| errors.is_empty())
            .ok_or_else(|| Refusal::of_graph(tools, &name, &errors, &loaded.sources))
    };
    let edits = match (&request.preset, &request.comment) {
        (Some(preset), Some(comment)) => put_preset(cx, preset, comment, &values),
        (Some(preset), None) if request.add => add_preset(cx, preset, &values),
        _ if values.is_empty() => Ok(Vec::new()),
        (preset, _) => assign(cx, preset.as_deref(), &values),
    };
    let usage = |message| Refusal::new("usage", message);
    let mut edits = edits.map_err(usage)?;
    if !request.edits.is_empty() || request.promote.is_some() {
        let base = load(&before)?;
        edits.extend(written(cx, &base, &request.edits).map_err(usage)?);
        if let Some(Place { node, field }) = &request.promote {
            edits.extend(promoted(cx, &base, node, field).map_err(usage)?);
        }
    }
    let after = changed(&before, edits);
    load(&after)?;
    if !source.has_file() {
        return Ok(json!({ "sha256": sha256(&after), "text": after }));
    }
    if after != before {
        let failed = |error: std::io::Error| Refusal::new("file", format!("cannot change `{name}`: {error}"));
        change(&source.path, &before, &after).map_err(|refused| match refused {
            Refused::Changed => other(),
            Refused::Failed(error) => failed(error),
        })?;
    }
    Ok(json!({ "sha256": sha256(&after) }))
}

/// The content of the file; `None` if another file may be there by now: a pipe, or a large one.
fn on_disk(source: &Source, name: &str) -> Result<Option<String>, Refusal> {
    let failed = |error: std::io::Error| Refusal::new("file", format!("cannot change `{name}`: {error}"));
    let facts = std::fs::metadata(&source.path).map_err(failed)?;
    let most = LoadOptions::default().limits.max_file_bytes;
    if !facts.is_file() || facts.len() > most {
        return Ok(None);
    }
    let mut text = String::new();
    let file = std::fs::File::open(&source.path).map_err(failed)?;
    file.take(most + 1).read_to_string(&mut text).map_err(failed)?;
    Ok(Some(text))
}

/// A value as it is written in a graph file: texts have quotation marks where those of the default do; a choice has none.
fn literal(name: &str, value: &Json, params: &[GraphParam]) -> String {
    let quoted = params.iter().find(|param| param.name == name).is_none_or(|param| param.default.starts_with('"'));
    match value {
        Json::String(_) if quoted => value.to_string(),
        other => render::ron(other),
    }
}
