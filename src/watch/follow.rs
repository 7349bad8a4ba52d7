//! The watch loop: reads every save and puts every graph without errors into [`LatestJob`].
use super::args::WatchArgs;
use super::editor::Note;
use super::evaluate::{Job, LatestJob};
use super::files::Files;
use super::folders::Folders;
use super::load::{self, Reading};
use super::settle::Settle;
use super::signal::Signal;
use super::status_reporter::StatusReporter;
use crate::report;
use crate::serve::{Stage, TextsByPath, Values};
use crate::terminal::Terminal;
use shibo_graph::{Graph, Loaded};
use shibo_ide::identity;
use shibo_picture::contained;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant, SystemTime};

/// Interval at which the files are compared even without a hint.
const IDLE: Duration = Duration::from_millis(250);
/// Interval without a watcher.
const POLL: Duration = Duration::from_millis(100);

/// Errors held back for a moment, since the file may be half written.
struct Held {
    loaded: Loaded,
    generation: u64,
    sha256: Option<String>,
    /// True once the save has been reported.
    told: bool,
    /// True if the text is that of an editor.
    unsaved: bool,
    due: Instant,
}

/// The loop and its state.
pub(super) struct Watch<'a> {
    path: PathBuf,
    url: &'a str,
    /// Tells editors the address of the page.
    note: Option<Note>,
    stage: &'a Stage,
    desk: &'a LatestJob,
    teller: &'a StatusReporter<'a>,
    values: Values,
    files: Files,
    /// The texts of an editor that are shown.
    texts: TextsByPath,
    folders: Option<Folders>,
    settle: Settle,
    held: Option<Held>,
    generation: u64,
    stopped: bool,
    /// A graph to show next.
    next: Option<PathBuf>,
    /// True if the texts of an editor may have changed.
    typed: bool,
    /// The warnings shown last.
    warned: Vec<String>,
}

impl<'a> Watch<'a> {
    /// Creates a loop.
    pub(super) fn new(
        args: &'a WatchArgs,
        stage: &'a Stage,
        desk: &'a LatestJob,
        teller: &'a StatusReporter<'a>,
        signals: Sender<Signal>,
        (url, note): (&'a str, Option<Note>),
    ) -> Self {
        let folders = if args.poll { None } else { watcher(signals, teller.terminal) };
        Self {
            path: args.graph.clone(),
            url,
            note,
            stage,
            desk,
            teller,
            values: Values { preset: args.values.preset.clone(), set: args.values.set.clone(), ..Values::default() },
            files: Files::default(),
            texts: TextsByPath::new(),
            folders,
            settle: Settle::default(),
            held: None,
            generation: first_generation(),
            stopped: false,
            next: None,
            typed: false,
            warned: Vec::new(),
        }
    }

    /// Follows the files until stopped.
    pub(super) fn run(&mut self, signals: &Receiver<Signal>) {
        self.stage.set_values(&self.values);
        let name = self.path.display().to_string();
        self.safely(|watch| watch.load(&name, true));
        let mut looked = Instant::now();
        while !self.stopped {
            let idle = looked + if self.folders.is_some() { IDLE } else { POLL };
            let dues = [self.settle.due(), self.held.as_ref().map(|held| held.due), Some(idle)];
            let due = dues.into_iter().flatten().min().unwrap_or(idle);
            match signals.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Ok(Signal::Touched { closed }) => self.settle.touch(Instant::now(), closed),
                Ok(Signal::Values(values)) => self.safely(|watch| watch.set(values, signals)),
                Ok(Signal::Open(path)) => self.next = Some(path),
                Ok(Signal::Texts) => self.typed = true,
                Ok(Signal::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Some(path) = self.next.take() {
                self.safely(|watch| watch.open(path));
            }
            if std::mem::take(&mut self.typed) {
                self.safely(Self::take_texts);
            }
            let now = Instant::now();
            if self.settle.due().is_some_and(|due| due <= now) || idle <= now {
                let closed = self.settle.clear();
                self.safely(|watch| watch.look(closed));
                looked = Instant::now();
            }
            if self.held.as_ref().is_some_and(|held| held.due <= now) {
                self.safely(Self::tell_held);
            }
        }
    }

    /// Runs a step. A panic is reported, and the next save is still read.
    fn safely(&mut self, step: impl FnOnce(&mut Self)) {
        if let Err(said) = contained(|| step(self)) {
            self.teller.terminal.error(&format!("this save is not shown, because of a defect: {said}"));
        }
    }

    /// Compares the files.
    fn look(&mut self, closed: bool) {
        let changed = self.files.changed();
        if !changed.is_empty() {
            let names = changed.iter().map(|path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy());
            let names = names.collect::<Vec<_>>().join(", ");
            self.load(&format!("{names} saved"), closed);
        }
        self.follow();
    }

    /// Shows the texts of the editor, unless these are shown already.
    fn take_texts(&mut self) {
        let mut texts = self.stage.buffers.texts().unwrap_or_default();
        if !texts.is_empty() {
            let files: BTreeSet<PathBuf> = self.files.paths().map(identity).collect();
            texts.retain(|path, _| files.contains(path));
        }
        if texts == self.texts {
            self.stage.set_unsaved(self.unsaved());
            return;
        }
        let name = self.path.file_name().unwrap_or(self.path.as_os_str()).to_string_lossy();
        let cause = if texts.is_empty() { format!("{name} as saved") } else { format!("{name} typed") };
        self.load(&cause, false);
    }

    /// The shown texts; `None` if no editor follows the graph.
    fn unsaved(&self) -> Option<TextsByPath> {
        self.stage.buffers.texts().map(|_| self.texts.clone())
    }

    /// Sets parameter values for a page; the newest request counts.
    fn set(&mut self, mut values: Values, signals: &Receiver<Signal>) {
        while let Ok(signal) = signals.try_recv() {
            match signal {
                Signal::Values(newer) => values = newer,
                Signal::Touched { closed } => self.settle.touch(Instant::now(), closed),
                // The values belong to the graph before.
                Signal::Open(path) => {
                    self.next = Some(path);
                    return;
                }
                Signal::Texts => self.typed = true,
                Signal::Stop => self.stopped = true,
            }
        }
        let set = |values: &Values| values.set.iter().map(|(n, v)| format!("{n} = {v}")).collect::<Vec<_>>();
        let before = set(&self.values);
        let mut changes: Vec<String> = set(&values).into_iter().filter(|s| !before.contains(s)).collect();
        if values.preset != self.values.preset {
            changes.push(values.preset.as_ref().map_or("no preset".to_owned(), |p| format!("preset {p}")));
        }
        let edits = values.edits.iter().filter(|edit| !self.values.edits.contains(edit));
        changes.extend(edits.map(|edit| [&edit.node, &edit.field].map(String::as_str).join(" ") + " = " + &edit.value));
        if values == self.values {
            return;
        }
        self.values = values;
        let cause = if changes.is_empty() { "values reset".to_owned() } else { changes.join(", ") };
        self.load(&cause, true);
    }

    /// Shows another graph, with its own values.
    fn open(&mut self, path: PathBuf) {
        if path == self.path {
            return;
        }
        self.desk.stop();
        self.stage.open(path.clone());
        self.path = path;
        self.values = Values::default();
        self.stage.set_values(&self.values);
        self.files = Files::default();
        self.held = None;
        self.warned.clear();
        self.note = Note::write(&self.path, self.url);
        let name = self.path.display().to_string();
        self.load(&name, true);
    }

    /// Reads the graph and passes it on for evaluation, or holds its errors back for a moment.
    fn load(&mut self, cause: &str, closed: bool) {
        let since = Instant::now();
        self.generation += 1;
        let texts = self.stage.buffers.texts().unwrap_or_default();
        let reading = load::load(&self.path, self.stage.session.registry(), &self.values, &texts);
        let hold = reading.hold(closed);
        let unfinished = !hold.is_zero() && reading.is_unfinished();
        let Reading { sha256, state, before, loaded, text, unsaved, saved, refused, refused_edits } = reading;
        saved.iter().for_each(|(path, text)| self.stage.buffers.forget(path, text));
        self.texts = unsaved;
        self.stage.set_unsaved(self.unsaved());
        let unsaved = !self.texts.is_empty();
        if let Some((sha, text)) = sha256.as_ref().zip(text) {
            self.stage.texts.keep(sha, &text);
        }
        let own = sha256.as_ref().is_some_and(|sha| self.stage.is_own(sha)) && cause.ends_with(" saved");
        let cause = if own { format!("{cause} from the page") } else { cause.to_owned() };
        if !unfinished {
            self.teller.read(sha256.as_deref(), unsaved);
        }
        self.files.note(&self.path, before, state);
        self.files.keep(&loaded.files);
        let mut values = self.values.clone();
        values.set.retain(|(name, _)| !refused.contains(name));
        if values.preset.as_ref().is_some_and(|p| refused.contains(p)) {
            values.preset = None;
        }
        for (edit, why) in &refused_edits {
            values.edits.retain(|other| other != edit);
            self.stage.refuse(edit, why);
        }
        self.values = values;
        self.stage.set_values(&self.values);
        self.held = None;
        let generation = self.generation;
        match (loaded.graph, sha256) {
            (Some(mut graph), Some(sha256)) => {
                graph.warnings.extend(graph.advice());
                self.warn(&graph);
                self.desk.put(Job { generation, sha256, graph, cause, since }, self.stage);
            }
            (graph, sha256) => {
                let loaded = Loaded { graph, ..loaded };
                self.stage.hold();
                self.held = Some(Held { loaded, generation, sha256, told: !unfinished, unsaved, due: since + hold });
            }
        }
        self.follow();
    }

    /// Shows the warnings of a graph, unless they are the same as at the last save.
    fn warn(&mut self, graph: &Graph) {
        let warnings: Vec<String> = graph.warnings.iter().map(|w| w.message.clone()).collect();
        if warnings != self.warned {
            report::show(self.teller.terminal, &graph.warnings, &graph.sources);
            self.warned = warnings;
        }
    }

    /// Shows the errors of a file that has been unchanged for long enough.
    fn tell_held(&mut self) {
        let Some(held) = self.held.take() else { return };
        if !held.told {
            self.teller.read(held.sha256.as_deref(), held.unsaved);
        }
        let errors: Vec<_> = held.loaded.diagnostics.iter().filter(|d| !d.warning).cloned().collect();
        self.stage.fail(held.generation, &errors, &held.loaded.sources);
        self.teller.errors(held.sha256.as_deref(), &errors, &held.loaded.sources);
    }

    /// Watches the folders of the current files.
    fn follow(&mut self) {
        if let Some(folders) = &mut self.folders
            && let Err(error) = folders.keep(self.files.paths().filter(|path| !is_far(path, &self.path)))
            && matches!(error.kind, notify::ErrorKind::MaxFilesWatch)
        {
            self.teller.terminal.warning("the system has no watches left; the files are looked at regularly instead");
            self.folders = None;
        }
    }
}

/// The milliseconds since 1970. A run that follows another one on the same port begins with larger numbers than that one
/// had, so open pages do not mistake old pictures for new ones.
fn first_generation() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(0)
}

/// Returns true for a missing `shibo.toml` in a folder above the graph. Such a folder is not watched, since many other
/// files may change in it; the files are compared at regular times anyway.
fn is_far(path: &Path, graph: &Path) -> bool {
    path.ends_with("shibo.toml") && path.parent() != graph.parent() && !path.exists()
}

/// Creates the watcher, if the system supports it.
fn watcher(signals: Sender<Signal>, terminal: &Terminal) -> Option<Folders> {
    match Folders::new(signals) {
        Ok(folders) => Some(folders),
        Err(error) => {
            terminal.warning(&format!("{error}; the files are looked at regularly instead"));
            None
        }
    }
}
