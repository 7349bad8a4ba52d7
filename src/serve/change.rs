//! Changes of the graph file that a page requests. Each change names the content it is based on and is refused if the
//! file has another content by now. Everything outside the changed ranges, comments and line endings included, stays as
//! it is; a file in the usual layout keeps that layout. While an editor follows the graph, it makes the change in its text.
use super::app::{self, ApiError, App, aside};
use super::stage::Stage;
use super::texts::sha256;
use super::values::Values;
use axum::body::Bytes;
use axum::extract::State;
use axum::response::Json;
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_bridge::page::edits::{self, FieldEdit};
use shibo_bridge::scene::lock;
use shibo_bridge::write::{self, Refused};
use shibo_graph::{self as graph, Graph, LoadOptions};
use shibo_ide::actions::{add_preset, assign, put_preset};
use shibo_ide::{Cx, Workspace, identity};
use std::fs;
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
    /// Sets values of parameters, in a preset or as defaults, and values of nodes.
    Values {
        set: Vec<(String, String)>,
        preset: Option<String>,
        /// Values in the texts of nodes.
        #[serde(default)]
        edits: Vec<FieldEdit>,
    },
    /// Adds a preset with these values.
    Preset { name: String, set: Vec<(String, String)> },
    /// Puts the values that the last fit found into a preset of this name.
    Fitted { name: String },
    /// Turns a constant of a node into a parameter.
    Promote { node: String, field: String },
    /// Restores an earlier content, named by its hash.
    Restore { to: String },
}

/// Handles a request to change the graph file.
pub(super) async fn change(State(app): State<App>, body: Bytes) -> Result<Json<Data>, ApiError> {
    let Wish { base, change, then } =
        serde_json::from_slice(&body).map_err(|error| ApiError::Bad(error.to_string()))?;
    let stage = app.stage.clone();
    let sha = aside(move || written(&stage, &base, &change)).await??;
    // The text of an editor may have changed.
    app.wish(app::Wish::Texts);
    if let Some(values) = then {
        app.wish(app::Wish::Values(values));
    }
    Ok(Json(json!({ "sha256": sha })))
}

/// Makes a change and returns the hash of the new content.
fn written(stage: &Stage, base: &str, change: &Change) -> Result<String, ApiError> {
    // Only one change runs at a time.
    let _writing = lock(&stage.writing);
    let path = stage.path();
    let name = path.display();
    let followed = stage.buffers.texts().map(|texts| (identity(&path), texts));
    let typed = followed.as_ref().and_then(|(path, texts)| texts.get(path));
    let before = match typed {
        Some(text) => text.to_string(),
        None => {
            let bytes = fs::read(&path).map_err(|error| ApiError::Failed(format!("cannot read `{name}`: {error}")))?;
            String::from_utf8(bytes).map_err(|_| ApiError::Conflict(format!("`{name}` is not UTF-8 text")))?
        }
    };
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
        change => edited(stage, &before, change)?,
    };
    if !matches!(change, Change::Restore { .. }) {
        check(stage, &after)?;
    }
    let sha = sha256(&after);
    if after != before {
        stage.texts.keep(&sha, &after);
        if let Some((path, _)) = followed {
            let refused = |why| ApiError::Conflict(format!("nothing was written: {why}"));
            stage.buffers.change(&path, &before, &after).map_err(refused)?;
            return Ok(sha);
        }
        *lock(&stage.own) = Some(sha.clone());
        if let Err(refused) = write::change(&path, &before, &after) {
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
    ApiError::Conflict(format!("`{}` has changed meanwhile; nothing was written", stage.path().display()))
}

/// Returns the text after the change.
fn edited(stage: &Stage, before: &str, change: &Change) -> Result<String, ApiError> {
    let mut workspace = Workspace::new(Arc::new(crate::library::registry()), Vec::new())
        .with_import_paths(crate::environment::import_paths().to_vec());
    for (path, text) in stage.unsaved() {
        workspace.open(&path, text);
    }
    let file = workspace.open(&stage.path(), before);
    let cx = Cx { world: &workspace, file: &file };
    let edits = match change {
        Change::Values { set, preset, edits } => {
            let set = if set.is_empty() { Ok(Vec::new()) } else { assign(cx, preset.as_deref(), set) };
            let fields = || match edits.is_empty() {
                true => Ok(Vec::new()),
                false => edits::written(cx, &based(stage, before)?, edits),
            };
            set.and_then(|set| Ok([set, fields()?].concat()))
        }
        Change::Preset { name, set } => add_preset(cx, name, set),
        Change::Fitted { name } => {
            let found = stage.photographs.found().ok_or_else(|| ApiError::Failed("no fit is finished".to_owned()))?;
            put_preset(cx, name, &found.comment, &found.values)
        }
        Change::Promote { node, field } => {
            let graph = based(stage, before).map_err(ApiError::Failed)?;
            if !graph.nodes.node_weights().any(|found| found.name == *node) {
                return Err(ApiError::Unknown);
            }
            edits::promoted(cx, &graph, node, field)
        }
        Change::Restore { .. } => Ok(Vec::new()),
    };
    Ok(edits::changed(before, edits.map_err(ApiError::Failed)?))
}

/// Options for loading the graph beside the unsaved texts of an editor.
fn options(stage: &Stage) -> LoadOptions {
    LoadOptions { overlay: stage.unsaved(), ..Values::default().options() }
}

/// The graph of the file.
fn based(stage: &Stage, before: &str) -> Result<Graph, String> {
    let loaded = graph::load_text(&stage.path(), before, stage.session.registry(), &options(stage));
    loaded.graph.ok_or_else(|| "nothing was written: the file has errors".to_owned())
}

/// Rejects a text that does not load.
fn check(stage: &Stage, text: &str) -> Result<(), ApiError> {
    let loaded = graph::load_text(&stage.path(), text, stage.session.registry(), &options(stage));
    match loaded.diagnostics.iter().find(|found| !found.warning) {
        Some(error) => Err(ApiError::Failed(format!("nothing was written: {}", error.message))),
        None => Ok(()),
    }
}
