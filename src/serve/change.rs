//! Changes of the graph file that a page requests. Each change names the content it is based on and is refused if the
//! file has another content by now. Everything outside the changed ranges, comments and line endings included, stays as
//! it is; a file in the usual layout keeps that layout.
use super::app::{ApiError, App, aside};
use super::numbers;
use super::stage::{Stage, Values};
use super::texts::sha256;
use super::wiring;
use axum::body::Bytes;
use axum::extract::State;
use axum::response::Json;
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_bridge::scene::{is_own, lock};
use shibo_bridge::write::{self, Refused};
use shibo_graph as graph;
use shibo_ide::actions::{add_preset, alike, apply, assign, promote, put_preset};
use shibo_ide::format::keep_layout;
use shibo_ide::rename::Edit;
use shibo_ide::{Cx, Workspace};
use std::fs;
use std::ops::Range;
use std::sync::Arc;

/// Request: a change, the hash of the content it is based on, and the parameter values to set afterwards.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
    base: String,
    change: Change,
    then: Option<Values>,
}

/// Kinds of changes.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Change {
    /// Sets values of parameters, in a preset or as defaults.
    Values { set: Vec<(String, String)>, preset: Option<String> },
    /// Adds a preset with these values.
    Preset { name: String, set: Vec<(String, String)> },
    /// Puts the values that the last fit found into a preset of this name.
    Fitted { name: String },
    /// Turns a constant of a node into a parameter.
    Promote { node: String, field: String },
    /// Sets a constant of a node.
    Field { node: String, field: String, value: String },
    /// Sets a number of a formula: in a field of a node, or in the node itself without a name.
    Number { node: String, field: String, index: usize, value: String },
    /// Restores an earlier content, named by its hash.
    Restore { to: String },
}

/// Handles a request to change the graph file.
pub(super) async fn change(State(app): State<App>, body: Bytes) -> Result<Json<Data>, ApiError> {
    let Wish { base, change, then } =
        serde_json::from_slice(&body).map_err(|error| ApiError::Bad(error.to_string()))?;
    let stage = app.stage.clone();
    let sha = aside(move || written(&stage, &base, &change)).await??;
    if let Some(values) = then {
        app.wish(values);
    }
    Ok(Json(json!({ "sha256": sha })))
}

/// Makes a change and returns the hash of the new content.
fn written(stage: &Stage, base: &str, change: &Change) -> Result<String, ApiError> {
    // Only one change runs at a time.
    let _writing = lock(&stage.writing);
    let name = stage.path.display();
    let bytes = fs::read(&stage.path).map_err(|error| ApiError::Failed(format!("cannot read `{name}`: {error}")))?;
    let before = String::from_utf8(bytes).map_err(|_| ApiError::Conflict(format!("`{name}` is not UTF-8 text")))?;
    if sha256(&before) != base {
        return Err(changed(stage));
    }
    stage.texts.keep(base, &before);
    let after = match change {
        Change::Restore { to } => stage
            .texts
            .get(to)
            .ok_or_else(|| ApiError::Failed("that content is no longer known".to_owned()))?
            .to_string(),
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
                Refused::Failed(error) => ApiError::Failed(format!("cannot write `{name}`: {error}")),
            });
        }
    }
    Ok(sha)
}

/// Error: another program has saved the file.
fn changed(stage: &Stage) -> ApiError {
    ApiError::Conflict(format!("`{}` has changed meanwhile; nothing was written", stage.path.display()))
}

/// Returns the text after the change.
fn edited(stage: &Stage, base: &str, before: &str, change: &Change) -> Result<String, ApiError> {
    let mut workspace = Workspace::new(Arc::new(crate::library::registry()), Vec::new())
        .with_import_paths(crate::environment::import_paths().to_vec());
    let file = workspace.open(&stage.path, before);
    let cx = Cx { world: &workspace, file: &file };
    let edits = match change {
        Change::Values { set, preset } => assign(cx, preset.as_deref(), set),
        Change::Preset { name, set } => add_preset(cx, name, set),
        Change::Fitted { name } => {
            let found = stage.photographs.found().ok_or_else(|| ApiError::Failed("no fit is finished".to_owned()))?;
            put_preset(cx, name, &found.comment, &found.values)
        }
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
        Change::Number { node, field, index, value } => {
            let literal = place(stage, base, node, field)?;
            let found = before.get(literal.clone()).and_then(|text| numbers::places(text).into_iter().nth(*index));
            match found.filter(|_| numbers::is_plain(value)) {
                Some(found) => {
                    let range = literal.start + found.start..literal.start + found.end;
                    let text = alike(cx, &range, value);
                    Ok(vec![Edit { range, text }])
                }
                None => Err(format!("`{value}` cannot replace number {index} of the formula of `{node}`")),
            }
        }
        Change::Restore { .. } => Ok(Vec::new()),
    };
    let edits = edits.map_err(ApiError::Failed)?;
    // Inserted lines use the line ending of the file.
    let ends = |edit: Edit| Edit { text: edit.text.replace('\n', "\r\n"), ..edit };
    let edits: Vec<Edit> = if before.contains("\r\n") { edits.into_iter().map(ends).collect() } else { edits };
    Ok(keep_layout(before, apply(before, &edits)))
}

/// Byte range of the value of a node's field in the graph file; of a node that is a formula, without a name.
fn place(stage: &Stage, base: &str, node: &str, field: &str) -> Result<Range<usize>, ApiError> {
    let scene = stage.scene().filter(|scene| scene.sha256 == base);
    let scene = scene.ok_or_else(|| ApiError::Conflict("the file is being read; try again in a moment".to_owned()))?;
    let target = scene.target(&format!("@{node}")).ok_or(ApiError::Unknown)?;
    let span = wiring::place(&scene.graph.nodes[target.node], &scene.graph.sources, field).ok_or(ApiError::Unknown)?;
    if !is_own(&scene, span) {
        return Err(ApiError::Failed(format!("`{node}` belongs to another file")));
    }
    Ok(span.start..span.end)
}

/// Rejects a text that does not load.
fn check(stage: &Stage, text: &str) -> Result<(), ApiError> {
    let loaded = graph::load_text(&stage.path, text, stage.session.registry(), &Values::default().options());
    match loaded.diagnostics.iter().find(|found| !found.warning) {
        Some(error) => Err(ApiError::Failed(format!("nothing was written: {}", error.message))),
        None => Ok(()),
    }
}
