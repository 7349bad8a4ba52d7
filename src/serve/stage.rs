//! What the loop that follows the files, the evaluation and the pages share: the last good scene, the current errors, and
//! the news for pages.
use super::environment::Environment;
use super::export::Exports;
use super::scene::{Scene, Shown, lock};
use super::store::{Store, Stored};
use super::texts::Texts;
use super::wear;
use serde::{Deserialize, Serialize};
use serde_json::{Value as Json, json};
use shibo_engine::diagnostics::{Diagnostic, SourceMap, to_json};
use shibo_engine::eval::{NodeState, NodeStats};
use shibo_engine::graph::LoadOptions;
use shibo_engine::session::Session;
use shibo_engine::value::Key;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::sync::broadcast;

/// How many pieces of news a page may miss before it is sent everything again.
const BACKLOG: usize = 256;
/// How many results are remembered as made.
const MADE: usize = 200_000;
/// Errors that pages are told of.
const ERRORS: usize = 100;
/// How long work takes before its progress is reported, and the time between two reports.
const PROGRESS: Duration = Duration::from_millis(200);
/// Longer lines of a source are cut, in characters.
const LINE: usize = 240;

/// The values of parameters that a page asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Values {
    /// The preset.
    #[serde(default)]
    pub(crate) preset: Option<String>,
    /// Names and values, as RON.
    #[serde(default)]
    pub(crate) set: Vec<(String, String)>,
}

impl Values {
    /// How a graph is loaded with them.
    pub(crate) fn options(self) -> LoadOptions {
        LoadOptions {
            preset: self.preset,
            set: self.set,
            working_dir: std::env::current_dir().unwrap_or_default(),
            import_paths: crate::environment::import_paths().to_vec(),
            ..LoadOptions::default()
        }
    }
}

/// A piece of news: its kind, and what it says.
pub(crate) type News = (&'static str, Arc<str>);

#[derive(Default)]
struct Present {
    scene: Option<Arc<Scene>>,
    errors: Vec<Json>,
    /// Which graph they are of.
    failed: u64,
    warnings: Vec<Json>,
    busy: bool,
    progress: Option<Json>,
    values: Values,
    /// What was last done, in words and numbers.
    done: Option<Json>,
}

/// The state that all share.
pub(crate) struct Stage {
    /// The engine.
    pub(crate) session: Session,
    /// The pictures.
    pub(crate) store: Store,
    /// The graph file.
    pub(super) path: PathBuf,
    /// The texts that it had.
    pub(crate) texts: Texts,
    /// What pages export.
    pub(super) exports: Exports,
    /// The environment that a page brought.
    pub(super) environment: Environment,
    /// Held while a page changes the file.
    pub(super) writing: Mutex<()>,
    /// The content that a page wrote last.
    pub(super) own: Mutex<Option<String>>,
    present: Mutex<Present>,
    news: broadcast::Sender<News>,
    focus: Mutex<Option<String>>,
    /// When progress was last reported, or the work began.
    progressed: Mutex<Option<Instant>>,
    /// What was made in this run, and the seconds it took.
    made: Mutex<HashMap<Key, f64>>,
}

impl Stage {
    /// An empty stage for that graph file.
    pub(crate) fn new(session: Session, path: PathBuf) -> Self {
        Self {
            store: Store::new(session.memory()),
            session,
            path,
            texts: Texts::default(),
            exports: Exports::default(),
            environment: Environment::default(),
            writing: Mutex::default(),
            own: Mutex::default(),
            present: Mutex::default(),
            news: broadcast::Sender::new(BACKLOG),
            focus: Mutex::default(),
            progressed: Mutex::default(),
            made: Mutex::default(),
        }
    }

    /// The last good scene.
    pub(crate) fn scene(&self) -> Option<Arc<Scene>> {
        lock(&self.present).scene.clone()
    }

    /// News from now on.
    pub(crate) fn listen(&self) -> broadcast::Receiver<News> {
        self.news.subscribe()
    }

    /// Tells all pages something.
    pub(super) fn tell(&self, kind: &'static str, what: &Json) {
        // Without a page, nobody receives it.
        let _ = self.news.send((kind, what.to_string().into()));
    }

    /// The target that was last looked at: to be made first.
    pub(crate) fn focus(&self) -> Option<String> {
        lock(&self.focus).clone()
    }

    /// Somebody looks at a target.
    pub(crate) fn set_focus(&self, target: &str) {
        *lock(&self.focus) = Some(target.to_owned());
    }

    /// The picture of that name, if it is still known.
    pub(crate) fn picture(&self, id: &str) -> Option<Arc<Stored>> {
        self.store.get(id).or_else(|| {
            let scene = self.scene()?;
            let shown = lock(&scene.shown);
            shown.values().find(|shown| shown.stored.id == id).map(|shown| shown.stored.clone())
        })
    }

    /// A scene takes the place of the last good one.
    pub(crate) fn adopt(&self, scene: &Arc<Scene>) {
        let old = {
            let mut present = lock(&self.present);
            // The errors of a newer graph stay.
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

    /// A picture of a scene is there.
    pub(crate) fn show(&self, scene: &Scene, output: &str, shown: &Shown) {
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

    /// Advice that came up while the scene was evaluated.
    pub(crate) fn advise(&self, warnings: &[Diagnostic], sources: &SourceMap) {
        let mut present = lock(&self.present);
        present.warnings.extend(diagnostics(warnings, sources));
        let all = present.warnings.clone();
        drop(present);
        self.tell("warnings", &json!({ "warnings": all }));
    }

    /// An evaluation begins, or ends.
    pub(crate) fn set_busy(&self, busy: bool) {
        let mut present = lock(&self.present);
        present.busy = busy;
        present.progress = None;
        *lock(&self.progressed) = Some(Instant::now());
        drop(present);
        self.tell("busy", &json!({ "busy": busy }));
    }

    /// How far an evaluation has come.
    pub(crate) fn progress(&self, node: &str, done: u64, total: u64) {
        let now = Instant::now();
        let mut last = lock(&self.progressed);
        if last.is_some_and(|last| now.duration_since(last) < PROGRESS) {
            return;
        }
        *last = Some(now);
        drop(last);
        let progress = json!({ "node": node, "done": done, "total": total });
        lock(&self.present).progress = Some(progress.clone());
        self.tell("progress", &progress);
    }

    /// An evaluation is over: how long it took, in ms, until something was shown and until all was.
    pub(crate) fn done(&self, scene: &Scene, mut stats: Vec<NodeStats>, first: f64, all: f64) {
        let ran = stats.iter().filter(|s| s.state == NodeState::Computed).count();
        self.remember(scene, &mut stats);
        *lock(&scene.stats) = stats;
        let done = json!({ "generation": scene.generation, "ran": ran, "first_ms": first, "all_ms": all });
        lock(&self.present).done = Some(done.clone());
        self.tell("done", &done);
    }

    /// Marks a node as taken from memory if it did not run because the pictures that need it were known already.
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

    /// Whether a page wrote that content.
    pub(crate) fn is_own(&self, sha256: &str) -> bool {
        lock(&self.own).as_deref() == Some(sha256)
    }

    /// The values of parameters in force.
    pub(super) fn values(&self) -> Values {
        lock(&self.present).values.clone()
    }

    /// Sets them.
    pub(crate) fn set_values(&self, values: &Values) {
        lock(&self.present).values.clone_from(values);
    }

    /// Everything that a page needs to begin with.
    pub(crate) fn state(&self) -> Json {
        let present = lock(&self.present);
        let mut state = json!({
            "file": self.path.file_name().map_or_else(|| "graph".into(), |name| name.to_string_lossy()),
            "version": env!("CARGO_PKG_VERSION"),
            "errors": present.errors,
            "warnings": present.warnings,
            "busy": present.busy,
            "progress": present.progress,
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
    let params = graph.params.iter().map(|p| {
        let (before, after) = around(&graph.sources, p.span);
        json!({
            "name": p.name, "type": p.ty, "value": p.value, "default": p.default, "range": p.range, "unit": p.unit,
            "doc": p.doc, "options": p.options, "before": before, "after": after,
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
        // Why it does not repeat although the canvas asks for it.
        "breaks": graph.breaks_in_tiling().into_iter().map(|(node, why)| json!({
            "node": graph.nodes[node].name, "message": why.message, "help": why.help,
        })).collect::<Vec<_>>(),
        // Whether shapes can be cut out of something.
        "solid": wear::has_solid(scene),
        // Equal names are the same mesh.
        "mesh": scene.mesh().map(|(node, output)| scene.keys.output(node, output).to_string()),
        "outputs": outputs.collect::<Vec<_>>(),
        "params": params.collect::<Vec<_>>(),
        "presets": graph.presets,
        "pictures": *lock(&scene.shown),
    })
}

/// What stands on the line of a default before and after it.
fn around(sources: &SourceMap, span: shibo_engine::diagnostics::Span) -> (String, String) {
    let text = sources.text(span.file);
    let before = text.get(..span.start).and_then(|t| t.rsplit('\n').next()).unwrap_or("").trim_start();
    let after = text.get(span.end..).and_then(|t| t.split('\n').next()).unwrap_or("").trim_end();
    (before.to_owned(), after.to_owned())
}

/// Diagnostics with the lines around them.
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
