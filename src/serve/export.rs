//! Exports that a page requests: files are rendered into a temporary folder with progress reports, and fetched when
//! finished.
use super::app::{ApiError, App};
use super::edits::tried;
use super::stage::Stage;
use super::values::Values;
use crate::render::add_node;
use crate::target::Target;
use crate::zip;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use clap::ValueEnum;
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_bridge::scene::lock;
use shibo_engine::eval::{CancelToken, Event, Observer};
use shibo_engine::session::{Failure, RenderRequest};
use shibo_graph::{self as graph, Graph, LoadOptions};
use shibo_picture::{Format, contained};
use shibo_value::Resolution;
use std::fs;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Minimum time between two progress reports.
const PROGRESS: Duration = Duration::from_millis(150);

/// Request: the files to export.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
    g: u64,
    /// Target; all outputs if absent.
    target: Option<String>,
    /// Writes the materials for another program instead: a name of `render --as`.
    set: Option<String>,
    /// Longer side in pixels; by default the resolution of the graph.
    resolution: Option<u32>,
    /// `png`, `tiff` or `exr`; by default the format of the graph.
    format: Option<String>,
}

/// Sends the progress of an export to the pages.
struct Telling<'a> {
    stage: &'a Stage,
    id: u64,
    last: Mutex<Instant>,
}

impl Observer for Telling<'_> {
    fn event(&self, event: Event) {
        let Event::Rows { done, total } = event else { return };
        let mut last = lock(&self.last);
        if last.elapsed() >= PROGRESS {
            *last = Instant::now();
            self.stage.tell("export", &json!({ "id": self.id, "state": "running", "done": done, "total": total }));
        }
    }
}

/// Starts an export and returns its number.
pub(super) async fn export(State(app): State<App>, body: Bytes) -> Result<Json<Data>, ApiError> {
    let wish: Wish = serde_json::from_slice(&body).map_err(|error| ApiError::Bad(error.to_string()))?;
    let scene = app.scene(wish.g)?;
    let stage = app.stage.clone();
    let values = stage.values();
    let text = stage.texts.get(&scene.sha256).ok_or(ApiError::Nothing)?;
    let (id, cancel) = stage.exports.begin().ok_or(ApiError::Busy)?;
    tokio::task::spawn_blocking(move || work(&stage, (&text, values), &wish, (id, &cancel)));
    Ok(Json(json!({ "id": id })))
}

/// Returns the names and descriptions of the formats for other programs.
pub(super) async fn targets() -> Json<Data> {
    let targets = Target::value_variants().iter().map(|target| {
        let (name, doc) = target.told();
        json!({ "name": name, "doc": doc })
    });
    Json(targets.collect())
}

/// Runs an export and tells the pages its result.
fn work(stage: &Stage, (text, values): (&Arc<str>, Values), wish: &Wish, (id, cancel): (u64, &CancelToken)) {
    let resolution = wish.resolution.map(Resolution::Longer);
    let made = || load(stage, text, values, resolution).and_then(|graph| render(stage, graph, wish, id, cancel));
    // A panic is reported like any other failure and frees the slot.
    let result = contained(made).unwrap_or_else(|said| Err(Failure::File(format!("there is a defect: {said}"))));
    let news = match &result {
        Ok((name, bytes)) => json!({ "id": id, "state": "done", "name": name, "bytes": bytes.len() }),
        Err(Failure::Cancelled) => json!({ "id": id, "state": "cancelled" }),
        Err(failure) => json!({ "id": id, "state": "failed", "message": failure.to_string() }),
    };
    stage.exports.end(id, result.ok());
    stage.tell("export", &news);
}

/// Stops an export.
pub(super) async fn stop(State(app): State<App>, Path((_, id)): Path<(String, u64)>) -> StatusCode {
    if let Some(export) = lock(&app.stage.exports.0).1.get(&id) {
        export.cancel.cancel();
    }
    StatusCode::ACCEPTED
}

/// Returns the file that an export made.
pub(super) async fn fetch(State(app): State<App>, Path((_, id)): Path<(String, u64)>) -> Result<Response, ApiError> {
    let made = lock(&app.stage.exports.0).1.get(&id).and_then(|export| export.made.clone());
    let (name, bytes) = made.ok_or(ApiError::Unknown)?;
    let plain: String = name.chars().filter(|c| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-')).collect();
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{plain}\"")),
    ];
    Ok((head, bytes).into_response())
}

/// Loads a graph that is shown, with another resolution if one is given.
pub(super) fn load(
    stage: &Stage,
    text: &Arc<str>,
    values: Values,
    resolution: Option<Resolution>,
) -> Result<Graph, Failure> {
    let path = stage.path();
    let overlay = stage.unsaved();
    let (text, _) = tried(&path, text, stage.session.registry(), &values, &overlay);
    let options = LoadOptions { resolution, overlay, ..values.options() };
    let loaded = graph::load_text(&path, &text, stage.session.registry(), &options);
    loaded.graph.ok_or_else(|| Failure::from(loaded.diagnostics))
}

/// Renders the export; returns the name and the bytes of the file.
fn render(
    stage: &Stage,
    mut graph: Graph,
    wish: &Wish,
    id: u64,
    cancel: &CancelToken,
) -> Result<(String, Bytes), Failure> {
    let usage = |quit: crate::quit::Quit| Failure::Usage(quit.text());
    let mut outputs = Vec::new();
    if let Some(set) = &wish.set {
        let target = Target::from_str(set, false).map_err(Failure::Usage)?;
        target.replace_outputs(&mut graph, false).map_err(usage)?;
    } else if let Some(target) = &wish.target {
        outputs.push(match target.strip_prefix('@') {
            Some(node) => add_node(&mut graph, &node.replacen(':', ".", 1)).map_err(usage)?,
            None => target.clone(),
        });
    }
    let format = wish.format.as_deref().and_then(Format::from_extension);
    let request = RenderRequest { outputs, format, ..RenderRequest::default() };
    let telling = Telling { stage, id, last: Mutex::new(Instant::now()) };
    let mut files = files(stage, &graph, request, cancel, &telling)?;
    match files.len() {
        0 => Err(Failure::Usage("the graph has no outputs to export".to_owned())),
        1 => Ok(files.pop().map(|(name, bytes)| (name, bytes.into())).unwrap_or_default()),
        _ => {
            let stem = graph.path.file_stem().map_or_else(|| "maps".into(), |stem| stem.to_string_lossy());
            let archive = zip::zip(&files).map_err(|_| Failure::File("the files are larger than 4 GiB".to_owned()))?;
            Ok((format!("{stem}.zip"), archive.into()))
        }
    }
}

/// Renders into a temporary folder; returns the names and the bytes of the files.
pub(super) fn files(
    stage: &Stage,
    graph: &Graph,
    request: RenderRequest,
    cancel: &CancelToken,
    observer: &dyn Observer,
) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let folder = tempfile::tempdir().map_err(|error| Failure::File(format!("cannot make a folder: {error}")))?;
    let request = RenderRequest { dir: folder.path().to_path_buf(), ..request };
    let done = stage.session.render(graph, &request, cancel, observer)?;
    let read = |path: &std::path::PathBuf| {
        let bytes = fs::read(path).map_err(|error| Failure::File(format!("cannot read what was made: {error}")))?;
        let inside = path.strip_prefix(folder.path()).unwrap_or(path);
        Ok((inside.to_string_lossy().replace('\\', "/"), bytes))
    };
    done.files.iter().map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::serve::defective;
    use crate::serve::export_slots::AT_ONCE;

    /// Exports a graph and returns the news that the pages receive.
    fn exported(stage: &Stage, bad: bool) -> Data {
        let mut news = stage.listen();
        let (id, cancel) = stage.exports.begin().expect("a place is free");
        let wish = Wish { g: 0, target: None, set: None, resolution: None, format: None };
        work(stage, (&defective::text(bad).into(), Values::default()), &wish, (id, &cancel));
        let told = std::iter::from_fn(|| news.try_recv().ok()).filter(|(kind, _)| *kind == "export");
        let told: Vec<Data> = told.map(|(_, what)| serde_json::from_str(&what).unwrap()).collect();
        told.into_iter().find(|news| news["state"] != "running").expect("the end is told")
    }

    #[test]
    fn panicking_export_frees_its_slot() {
        let stage = defective::stage();
        for _ in 0..=AT_ONCE {
            let news = exported(&stage, true);
            assert_eq!(news["state"], "failed", "{news}");
            assert!(news["message"].as_str().unwrap().contains("the test panics"), "{news}");
        }
        assert_eq!(exported(&stage, false)["state"], "done");
    }
}
