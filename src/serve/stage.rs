//! State shared by the watch loop, the evaluation and the pages: the last good scene, the current errors, and the news
//! for pages.
use super::buffers::{Buffers, TextsByPath};
use super::export_slots::Exports;
use super::panorama::Environment;
use super::photographs::Photographs;
use super::texts::Texts;
use super::values::Values;
use serde_json::{Value as Json, json};
use shibo_bridge::page::bodies;
use shibo_bridge::page::edits::FieldEdit;
use shibo_bridge::scene::{PictureInfo, Scene, has_solid, lock};
use shibo_bridge::scene::{Store, Stored};
use shibo_engine::eval::{NodeState, NodeStats};
use shibo_engine::session::Session;
use shibo_graph::syntax::{NodeKind, Tree};
use shibo_value::Key;
use shibo_value::diagnostics::{Diagnostic, SourceMap, Span, to_json};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use tokio::sync::broadcast;

/// Number of news items a page may miss before the whole state is sent again.
const BACKLOG: usize = 256;
/// Maximum number of results remembered as made.
const MADE: usize = 200_000;
/// Maximum number of errors sent to pages.
const ERRORS: usize = 100;
/// Longer source lines are cut, in characters.
const LINE: usize = 240;

/// A news item: its kind and its content.
pub(crate) type News = (&'static str, Arc<str>);

#[derive(Default)]
struct Present {
    scene: Option<Arc<Scene>>,
    errors: Vec<Json>,
    /// Generation of the graph that has the errors.
    failed: u64,
    warnings: Vec<Json>,
    busy: bool,
    progress: Option<Json>,
    /// The shown texts of an editor that are not saved; `None` if no editor follows the graph.
    unsaved: Option<TextsByPath>,
    values: Values,
    /// Summary of the last evaluation.
    done: Option<Json>,
}

/// The shared state.
pub(crate) struct Stage {
    /// The engine.
    pub(crate) session: Session,
    /// The pictures.
    pub(crate) store: Store,
    /// Path of the graph file.
    path: Mutex<PathBuf>,
    /// Earlier texts of the graph file.
    pub(crate) texts: Texts,
    /// Unsaved texts of an editor.
    pub(crate) buffers: Buffers,
    /// Exports requested by pages.
    pub(super) exports: Exports,
    /// Environment sent by a page.
    pub(super) environment: Environment,
    /// The photograph of a page, and its fit.
    pub(super) photographs: Photographs,
    /// Held while a page changes the file.
    pub(super) writing: Mutex<()>,
    /// Hash of the content that a page wrote last.
    pub(super) own: Mutex<Option<String>>,
    present: Mutex<Present>,
    news: broadcast::Sender<News>,
    focus: Mutex<Option<String>>,
    /// Results made in this run, and the seconds they took.
    pub(super) made: Mutex<HashMap<Key, f64>>,
    /// Seconds that each node took when it ran last, by its name.
    pub(super) costs: Mutex<HashMap<String, f64>>,
}

impl Stage {
    /// Creates an empty stage for a graph file.
    pub(crate) fn new(session: Session, path: PathBuf) -> Self {
        Self {
            store: Store::new(session.memory()),
            session,
            path: Mutex::new(path),
            texts: Texts::default(),
            buffers: Buffers::default(),
            exports: Exports::default(),
            environment: Environment::default(),
            photographs: Photographs::default(),
            writing: Mutex::default(),
            own: Mutex::default(),
            present: Mutex::default(),
            news: broadcast::Sender::new(BACKLOG),
            focus: Mutex::default(),
            made: Mutex::default(),
            costs: Mutex::default(),
        }
    }

    /// Path of the graph file.
    pub(crate) fn path(&self) -> PathBuf {
        lock(&self.path).clone()
    }

    /// Shows another graph file. Pages are told at once; its scene follows.
    pub(crate) fn open(&self, path: PathBuf) {
        *lock(&self.path) = path;
        self.buffers.close("the page shows another graph");
        *lock(&self.focus) = None;
        let old = {
            let mut present = lock(&self.present);
            (present.errors, present.warnings, present.done, present.unsaved) = Default::default();
            present.scene.take()
        };
        if let Some(old) = old {
            old.cancel_views();
        }
        self.tell("state", &self.state());
    }

    /// Tells the pages that a value in the text of a node was not accepted.
    pub(crate) fn refuse(&self, edit: &FieldEdit, why: &str) {
        self.tell("refused", &json!({ "edit": edit, "why": why }));
    }

    /// The last good scene.
    pub(crate) fn scene(&self) -> Option<Arc<Scene>> {
        lock(&self.present).scene.clone()
    }

    /// Subscribes to the news from now on.
    pub(crate) fn listen(&self) -> broadcast::Receiver<News> {
        self.news.subscribe()
    }

    /// Sends a news item to all pages.
    pub(super) fn tell(&self, kind: &'static str, what: &Json) {
        // Without a page there is no receiver, so the error is ignored.
        let _ = self.news.send((kind, what.to_string().into()));
    }

    /// The target shown last, which is made first.
    pub(crate) fn focus(&self) -> Option<String> {
        lock(&self.focus).clone()
    }

    /// Records the target that a page shows.
    pub(crate) fn set_focus(&self, target: &str) {
        *lock(&self.focus) = Some(target.to_owned());
    }

    /// Returns the picture `id` if it is still stored.
    pub(crate) fn picture(&self, id: &str) -> Option<Arc<Stored>> {
        self.store.get(id).or_else(|| {
            let scene = self.scene()?;
            let shown = lock(&scene.shown);
            shown.values().find(|shown| shown.stored.id == id).map(|shown| shown.stored.clone())
        })
    }

    /// Replaces the last good scene.
    pub(crate) fn adopt(&self, scene: &Arc<Scene>) {
        // Pages have switched to another graph meanwhile.
        if scene.graph.path != self.path() {
            return;
        }
        let old = {
            let mut present = lock(&self.present);
            // Errors of a newer graph stay.
            if present.failed <= scene.generation {
                present.errors.clear();
            }
            present.warnings = diagnostics(&scene.graph.warnings, &scene.graph.sources);
            present.scene.replace(scene.clone())
        };
        if let Some(old) = old {
            old.cancel_views();
        }
        self.tell("state", &self.state());
    }

    /// Announces a picture of a scene.
    pub(crate) fn show(&self, scene: &Scene, output: &str, shown: &PictureInfo) {
        lock(&scene.shown).insert(shown.target.clone(), shown.clone());
        let mut news = json!(shown);
        news["generation"] = scene.generation.into();
        news["output"] = output.into();
        self.tell("shown", &news);
    }

    /// Sets the current errors; the pictures stay.
    pub(crate) fn fail(&self, generation: u64, errors: &[Diagnostic], sources: &SourceMap) {
        let errors = diagnostics(errors, sources);
        let mut present = lock(&self.present);
        if generation < present.failed {
            return;
        }
        present.failed = generation;
        present.errors.clone_from(&errors);
        drop(present);
        self.tell("errors", &json!({ "errors": errors }));
    }

    /// The current errors.
    #[cfg(test)]
    pub(crate) fn errors(&self) -> Vec<Json> {
        lock(&self.present).errors.clone()
    }

    /// Adds warnings found while the scene was evaluated.
    pub(crate) fn advise(&self, warnings: &[Diagnostic], sources: &SourceMap) {
        let mut present = lock(&self.present);
        present.warnings.extend(diagnostics(warnings, sources));
        let all = present.warnings.clone();
        drop(present);
        self.tell("warnings", &json!({ "warnings": all }));
    }

    /// Records the beginning or end of an evaluation.
    pub(crate) fn set_busy(&self, busy: bool) {
        let mut present = lock(&self.present);
        present.busy = busy;
        present.progress = None;
        drop(present);
        self.tell("busy", &json!({ "busy": busy }));
    }

    /// Reports the progress of an evaluation: see [`Forecast::report`](super::Forecast::report).
    pub(crate) fn progress(&self, progress: &Json) {
        lock(&self.present).progress = Some(progress.clone());
        self.tell("progress", progress);
    }

    /// Records the end of an evaluation; `first` and `all` are the ms until the first picture and until all pictures
    /// were shown.
    pub(crate) fn done(&self, scene: &Scene, mut stats: Vec<NodeStats>, first: f64, all: f64) {
        let ran = stats.iter().filter(|s| s.state == NodeState::Computed).count();
        self.remember(scene, &mut stats);
        let computed = stats.iter().filter(|stat| stat.state == NodeState::Computed);
        lock(&self.costs).extend(computed.map(|stat| (stat.name.clone(), stat.seconds)));
        *lock(&scene.stats) = stats;
        let done = json!({ "generation": scene.generation, "ran": ran, "first_ms": first, "all_ms": all });
        lock(&self.present).done = Some(done.clone());
        self.tell("done", &done);
    }

    /// Marks a node as taken from memory if it did not run because the pictures that need it already existed.
    fn remember(&self, scene: &Scene, stats: &mut [NodeStats]) {
        let mut made = lock(&self.made);
        if made.len() > MADE {
            made.clear();
        }
        for (index, stat) in scene.graph.nodes.node_indices().zip(stats) {
            let key = scene.keys.output(index, 0);
            match (stat.state, made.get(&key)) {
                (NodeState::Folded, Some(seconds)) => (stat.state, stat.seconds) = (NodeState::Memory, *seconds),
                (NodeState::Folded | NodeState::Unused, _) => {}
                _ => drop(made.insert(key, stat.seconds)),
            }
        }
    }

    /// Returns whether a page wrote the content with this hash.
    pub(crate) fn is_own(&self, sha256: &str) -> bool {
        lock(&self.own).as_deref() == Some(sha256)
    }

    /// The current values of parameters.
    pub(super) fn values(&self) -> Values {
        lock(&self.present).values.clone()
    }

    /// Records the shown texts of an editor that are not saved; `None` if no editor follows the graph.
    pub(crate) fn set_unsaved(&self, unsaved: Option<TextsByPath>) {
        let is_unsaved = |texts: &TextsByPath| !texts.is_empty();
        let after = unsaved.as_ref().map(is_unsaved);
        let before = std::mem::replace(&mut lock(&self.present).unsaved, unsaved);
        if before.as_ref().map(is_unsaved) != after {
            self.tell("state", &self.state());
        }
    }

    /// The shown texts of an editor that are not saved.
    pub(super) fn unsaved(&self) -> TextsByPath {
        lock(&self.present).unsaved.clone().unwrap_or_default()
    }

    /// Tells that the newest text has errors, which may be shown later.
    pub(crate) fn hold(&self) {
        self.tell("held", &Json::Null);
    }

    /// Sets the values of parameters.
    pub(crate) fn set_values(&self, values: &Values) {
        lock(&self.present).values.clone_from(values);
    }

    /// The whole state, as sent to a page that connects.
    pub(crate) fn state(&self) -> Json {
        let present = lock(&self.present);
        let mut state = json!({
            "file": self.path().file_name().map_or_else(|| "graph".into(), |name| name.to_string_lossy()),
            "version": env!("CARGO_PKG_VERSION"),
            "errors": present.errors,
            "warnings": present.warnings,
            "busy": present.busy,
            "progress": present.progress,
            // True if texts of an editor are shown that are not saved, false if all are, null if no editor follows the graph.
            "unsaved": present.unsaved.as_ref().map(|texts| !texts.is_empty()),
            "values": present.values,
            "done": present.done,
            "scene": null,
        });
        if let Some(scene) = &present.scene {
            state["scene"] = describe(scene);
        }
        state
    }
}

fn describe(scene: &Scene) -> Json {
    let graph = &scene.graph;
    let canvas = &graph.canvas;
    let outputs = graph.outputs.iter().map(|o| json!({ "name": o.name, "type": o.ty.to_string() }));
    // All parameters are declared in the file of the graph.
    let file = graph.params.first().map_or_else(|| "".into(), |param| graph.sources.text(param.span.file));
    let tree = Tree::parse(file);
    let params = graph.params.iter().map(|p| {
        let (before, after) = around(&tree, p.span);
        json!({
            "name": p.name, "type": p.ty, "value": p.value, "default": p.default, "range": p.range, "unit": p.unit,
            "group": p.group, "doc": p.doc, "options": p.options, "before": before, "after": after,
        })
    });
    json!({
        "generation": scene.generation,
        "sha256": scene.sha256,
        "canvas": {
            "size_mm": canvas.size_mm.to_array(),
            "resolution": canvas.resolution.to_array(),
            "tile": [canvas.tile.x, canvas.tile.y],
            "seed": canvas.seed.to_string(),
        },
        "nodes": graph.nodes.node_count(),
        // Reasons why nodes do not tile although the canvas does.
        "breaks": graph.breaks_in_tiling().into_iter().map(|(node, why)| json!({
            "node": graph.nodes[node].name, "message": why.message, "help": why.help,
        })).collect::<Vec<_>>(),
        // True if the lit view can cut shapes from a solid.
        "solid": has_solid(scene),
        // Equal names mean the same mesh.
        "mesh": scene.mesh().map(|(node, output)| scene.keys.output(node, output).to_string()),
        "outputs": outputs.collect::<Vec<_>>(),
        // Outputs whose files are bodies.
        "bodies": bodies(graph),
        "params": params.collect::<Vec<_>>(),
        "presets": graph.presets,
        "pictures": *lock(&scene.shown),
    })
}

/// Text before and after a default on the lines of its declaration.
fn around(tree: &Tree, span: Span) -> (String, String) {
    let text = tree.text();
    let value = tree.covering(span.start..span.end);
    let entries = std::iter::once(value).chain(value.ancestors()).filter(|node| node.kind() == NodeKind::Entry);
    let whole = entries.map(|entry| entry.range()).nth(1).unwrap_or(span.start..span.end);
    let begin = text.get(..whole.start).and_then(|before| before.rfind('\n')).map_or(0, |at| at + 1);
    let end = text.get(whole.end..).and_then(|after| after.find('\n')).map_or(text.len(), |at| whole.end + at);
    let before = text.get(begin..span.start).unwrap_or_default().trim_start();
    let after = text.get(span.end..end).unwrap_or_default().trim_end();
    (before.to_owned(), after.to_owned())
}

/// Diagnostics with the source lines around them.
fn diagnostics(list: &[Diagnostic], sources: &SourceMap) -> Vec<Json> {
    let list = &list[..list.len().min(ERRORS)];
    let plain = |d: &Diagnostic| Diagnostic { warning: false, ..d.clone() };
    let list: Vec<Diagnostic> = list.iter().map(plain).collect();
    let Json::Array(mut entries) = to_json(&list, sources)["errors"].take() else { return Vec::new() };
    for (entry, diagnostic) in entries.iter_mut().zip(&list) {
        let text = sources.text(diagnostic.span.file);
        let line = sources.position(diagnostic.span.file, diagnostic.span.start).line;
        let first = line.saturating_sub(2).max(1);
        let lines = text.lines().enumerate().skip(first - 1).take(line - first + 2);
        entry["lines"] =
            lines.map(|(i, l)| json!({ "n": i + 1, "text": l.chars().take(LINE).collect::<String>() })).collect();
    }
    entries
}
