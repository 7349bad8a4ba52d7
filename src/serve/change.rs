//! Changes of the graph file that a page asks for: each is based on a content, and refused if the file has another one by now.
//! Comments, line endings and everything else that is not meant stays as it is.
use super::handlers::{App, No, aside};
use super::scene::{Scene, lock};
use super::stage::{Stage, Values};
use super::texts::sha256;
use crate::ide::actions::{add_preset, alike, apply, assign, promote};
use crate::ide::rename::Edit;
use crate::ide::{Cx, Workspace};
use crate::write::{self, Refused};
use axum::body::Bytes;
use axum::extract::State;
use axum::response::Json;
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_engine::diagnostics::Span;
use shibo_engine::graph;
use std::fs;
use std::ops::Range;
use std::sync::Arc;

/// A change, what it is based on, and the values that are to be in force after it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
    base: String,
    change: Change,
    then: Option<Values>,
}

/// What is to be changed.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Change {
    /// Values of parameters: in a preset, or their defaults.
    Values { set: Vec<(String, String)>, preset: Option<String> },
    /// A new preset of these values.
    Preset { name: String, set: Vec<(String, String)> },
    /// A constant of a node becomes a parameter.
    Promote { node: String, field: String },
    /// A constant of a node.
    Field { node: String, field: String, value: String },
    /// An earlier content.
    Restore { to: String },
}

/// Changes the graph file.
pub(super) async fn change(State(app): State<App>, body: Bytes) -> Result<Json<Data>, No> {
    let Wish { base, change, then } = serde_json::from_slice(&body).map_err(|error| No::Bad(error.to_string()))?;
    let stage = app.stage.clone();
    let sha = aside(move || written(&stage, &base, &change)).await??;
    if let Some(values) = then {
        app.wish(values);
    }
    Ok(Json(json!({ "sha256": sha })))
}

/// Makes a change; the hash of the new content.
fn written(stage: &Stage, base: &str, change: &Change) -> Result<String, No> {
    // One change at a time.
    let _writing = lock(&stage.writing);
    let name = stage.path.display();
    let bytes = fs::read(&stage.path).map_err(|error| No::Failed(format!("cannot read `{name}`: {error}")))?;
    let before = String::from_utf8(bytes).map_err(|_| No::Conflict(format!("`{name}` is not UTF-8 text")))?;
    if sha256(&before) != base {
        return Err(changed(stage));
    }
    stage.texts.keep(base, &before);
    let after = match change {
        Change::Restore { to } => {
            stage.texts.get(to).ok_or_else(|| No::Failed("that content is no longer known".to_owned()))?.to_string()
        }
        change => edited(stage, base, &before, change)?,
    };
    if !matches!(change, Change::Restore { .. }) {
        check(stage, &after)?;
    }
    let sha = sha256(&after);
    if after != before {
        stage.texts.keep(&sha, &after);
        *lock(&stage.own) = Some(sha.clone());
        if let Err(refused) = write::change(&stage.path, &before, &after) {
            *lock(&stage.own) = None;
            return Err(match refused {
                Refused::Changed => changed(stage),
                Refused::Failed(error) => No::Failed(format!("cannot write `{name}`: {error}")),
            });
        }
    }
    Ok(sha)
}

/// Somebody else has saved the file.
fn changed(stage: &Stage) -> No {
    No::Conflict(format!("`{}` has changed meanwhile; nothing was written", stage.path.display()))
}

/// The text with a change in it.
fn edited(stage: &Stage, base: &str, before: &str, change: &Change) -> Result<String, No> {
    let mut workspace = Workspace::new(Arc::new(crate::library::registry()), Vec::new());
    let file = workspace.open(&stage.path, before);
    let cx = Cx { world: &workspace, file: &file };
    let edits = match change {
        Change::Values { set, preset } => assign(cx, preset.as_deref(), set),
        Change::Preset { name, set } => add_preset(cx, name, set),
        Change::Promote { node, field } => {
            let place = place(stage, base, node, field)?;
            promote(cx, place.start)
                .ok_or_else(|| format!("`{field}` of `{node}` is no plain number, switch or colour in the file"))
        }
        Change::Field { node, field, value } => {
            let range = place(stage, base, node, field)?;
            let text = alike(cx, &range, value);
            Ok(vec![Edit { range, text }])
        }
        Change::Restore { .. } => Ok(Vec::new()),
    };
    let edits = edits.map_err(No::Failed)?;
    // New lines end like those that are there.
    let ends = |edit: Edit| Edit { text: edit.text.replace('\n', "\r\n"), ..edit };
    let edits: Vec<Edit> = if before.contains("\r\n") { edits.into_iter().map(ends).collect() } else { edits };
    Ok(apply(before, &edits))
}

/// Where the value of a field of a node is written in the graph file.
fn place(stage: &Stage, base: &str, node: &str, field: &str) -> Result<Range<usize>, No> {
    let scene = stage.scene().filter(|scene| scene.sha256 == base);
    let scene = scene.ok_or_else(|| No::Conflict("the file is being read; try again in a moment".to_owned()))?;
    let target = scene.target(&format!("@{node}")).ok_or(No::Unknown)?;
    let fields = &scene.graph.nodes[target.node].fields;
    let span = fields.iter().find(|(name, _)| name == field).map(|(_, span)| *span).ok_or(No::Unknown)?;
    if !is_own(&scene, span) {
        return Err(No::Failed(format!("`{node}` belongs to another file")));
    }
    Ok(span.start..span.end)
}

/// Whether a place is in the graph file itself.
pub(super) fn is_own(scene: &Scene, span: Span) -> bool {
    scene.graph.sources.path(span.file) == scene.graph.path
}

/// Refuses a text that would not load.
fn check(stage: &Stage, text: &str) -> Result<(), No> {
    let loaded = graph::load_text(&stage.path, text, stage.session.registry(), &Values::default().options());
    match loaded.diagnostics.iter().find(|found| !found.warning) {
        Some(error) => Err(No::Failed(format!("nothing was written: {}", error.message))),
        None => Ok(()),
    }
}
