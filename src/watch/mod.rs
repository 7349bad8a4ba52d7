//! `shibo watch`: a page that shows a graph, and follows every save of it.
//!
//! Three parties: this loop, which knows the files and reads the graph; a thread that evaluates the newest graph; and the
//! server of the page. They meet on the [`Stage`].
mod evaluate;
mod files;
mod folders;
mod load;
mod settle;
mod tell;

use crate::args::{EngineArgs, ValueArgs};
use crate::interrupt;
use crate::open;
use crate::quit::Quit;
use crate::report;
use crate::serve::{self, Stage, Values};
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use evaluate::{Desk, Job, evaluate};
use files::Files;
use folders::Folders;
use load::Reading;
use settle::Settle;
use shibo_engine::graph::{Graph, Loaded};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};
use tell::Teller;

/// The files are looked at so often even if there is no hint that they changed.
const IDLE: Duration = Duration::from_millis(250);
/// The same where there are no hints.
const POLL: Duration = Duration::from_millis(100);

const EXAMPLES: &str = "\
Examples:
  shibo watch calf.ron                   open a page that follows every save
  shibo watch calf.ron --no-open --port 7007
  shibo watch /net/share/calf.ron --poll

Over SSH, use the same port on both sides: ssh -L 7007:127.0.0.1:7007 host, then shibo watch calf.ron --port 7007.";

/// Show a graph in a browser, and follow every save of it.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct WatchArgs {
    /// The graph file.
    graph: PathBuf,
    /// The port of the page; 0 is any that is free.
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Do not open a browser.
    #[arg(long)]
    no_open: bool,
    /// Look at the files regularly instead of asking the system for changes; for network folders.
    #[arg(long)]
    poll: bool,
    /// Print what happens on stdout, for programs.
    #[arg(long, value_name = "FORMAT")]
    log: Option<LogArg>,
    #[command(flatten)]
    values: ValueArgs,
    #[command(flatten)]
    engine: EngineArgs,
}

/// How to print what happens.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum LogArg {
    Json,
}

/// What the loop is told.
pub(crate) enum Signal {
    /// Something happened in a folder; `closed`: it ended a save.
    Touched {
        /// Whether it ended a save.
        closed: bool,
    },
    /// A page wants other values of parameters.
    Values(Values),
    /// It is over.
    Stop,
}

/// Runs the command.
pub(crate) fn run(args: &WatchArgs, terminal: &Terminal) -> Result<(), Quit> {
    let (sender, signals) = channel();
    let session = open::session(shibo_nodes::registry(), &args.engine, terminal)?;
    let name = args.graph.file_name().map_or_else(|| "graph".to_owned(), |n| n.to_string_lossy().into_owned());
    let stage = Arc::new(Stage::new(session, name));
    let server = serve::start(args.port, stage.clone(), sender.clone())?;
    let teller = Teller { terminal, log: args.log.is_some() };
    interrupt::on_signals({
        let sender = sender.clone();
        move || drop(sender.send(Signal::Stop))
    });
    teller.listening(&server.url);
    if !args.no_open {
        serve::open_browser(&server.url);
    }
    let desk = Desk::default();
    std::thread::scope(|scope| {
        scope.spawn(|| evaluate(&desk, &stage, &teller));
        Watch::new(args, &stage, &desk, &teller, sender).run(&signals);
        desk.close();
    });
    server.stop();
    Ok(())
}

/// Errors that are kept back for a moment, since the file may be half written.
struct Held {
    loaded: Loaded,
    generation: u64,
    sha256: Option<String>,
    /// Whether the save has been told of.
    told: bool,
    due: Instant,
}

struct Watch<'a> {
    path: &'a Path,
    stage: &'a Stage,
    desk: &'a Desk,
    teller: &'a Teller<'a>,
    values: Values,
    files: Files,
    folders: Option<Folders>,
    settle: Settle,
    held: Option<Held>,
    generation: u64,
    stopped: bool,
    /// The advice that was last shown.
    warned: Vec<String>,
}

impl<'a> Watch<'a> {
    fn new(
        args: &'a WatchArgs,
        stage: &'a Stage,
        desk: &'a Desk,
        teller: &'a Teller<'a>,
        signals: Sender<Signal>,
    ) -> Self {
        let folders = if args.poll { None } else { watcher(signals, teller.terminal) };
        Self {
            path: &args.graph,
            stage,
            desk,
            teller,
            values: Values { preset: args.values.preset.clone(), set: args.values.set.clone() },
            files: Files::default(),
            folders,
            settle: Settle::default(),
            held: None,
            generation: 0,
            stopped: false,
            warned: Vec::new(),
        }
    }

    fn run(&mut self, signals: &Receiver<Signal>) {
        self.stage.set_values(&self.values);
        let name = self.path.display().to_string();
        self.load(&name, true);
        let mut looked = Instant::now();
        while !self.stopped {
            let idle = looked + if self.folders.is_some() { IDLE } else { POLL };
            let dues = [self.settle.due(), self.held.as_ref().map(|held| held.due), Some(idle)];
            let due = dues.into_iter().flatten().min().unwrap_or(idle);
            match signals.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Ok(Signal::Touched { closed }) => self.settle.touch(Instant::now(), closed),
                Ok(Signal::Values(values)) => self.set(values, signals),
                Ok(Signal::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = Instant::now();
            if self.settle.due().is_some_and(|due| due <= now) || idle <= now {
                let closed = self.settle.clear();
                self.look(closed);
                looked = Instant::now();
            }
            if self.held.as_ref().is_some_and(|held| held.due <= now) {
                self.tell_held();
            }
        }
    }

    /// Looks at the files.
    fn look(&mut self, closed: bool) {
        let changed = self.files.changed();
        if !changed.is_empty() {
            let names = changed.iter().map(|path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy());
            let names = names.collect::<Vec<_>>().join(", ");
            self.load(&format!("{names} saved"), closed);
        }
        self.follow();
    }

    /// A page wants other values: the newest wish counts.
    fn set(&mut self, mut values: Values, signals: &Receiver<Signal>) {
        while let Ok(signal) = signals.try_recv() {
            match signal {
                Signal::Values(newer) => values = newer,
                Signal::Touched { closed } => self.settle.touch(Instant::now(), closed),
                Signal::Stop => self.stopped = true,
            }
        }
        let set = |values: &Values| values.set.iter().map(|(n, v)| format!("{n} = {v}")).collect::<Vec<_>>();
        let before = set(&self.values);
        let mut changes: Vec<String> = set(&values).into_iter().filter(|s| !before.contains(s)).collect();
        if values.preset != self.values.preset {
            changes.push(values.preset.as_ref().map_or("no preset".to_owned(), |p| format!("preset {p}")));
        }
        if values == self.values {
            return;
        }
        self.values = values;
        let cause = if changes.is_empty() { "values reset".to_owned() } else { changes.join(", ") };
        self.load(&cause, true);
    }

    /// Reads the graph and has it evaluated, or keeps its errors for a moment.
    fn load(&mut self, cause: &str, closed: bool) {
        let since = Instant::now();
        self.generation += 1;
        let reading = load::load(self.path, self.stage.session.registry(), &self.values);
        let hold = reading.hold(closed);
        let unfinished = !hold.is_zero() && reading.is_unfinished();
        let Reading { sha256, state, before, loaded, refused } = reading;
        if !unfinished {
            self.teller.saved(sha256.as_deref());
        }
        self.files.note(self.path, before, state);
        self.files.keep(&loaded.files);
        let mut values = self.values.clone();
        values.set.retain(|(name, _)| !refused.contains(name));
        if values.preset.as_ref().is_some_and(|p| refused.contains(p)) {
            values.preset = None;
        }
        self.values = values;
        self.stage.set_values(&self.values);
        self.held = None;
        let generation = self.generation;
        match (loaded.graph, sha256) {
            (Some(mut graph), Some(sha256)) => {
                graph.warnings.extend(self.stage.session.advice(&graph));
                self.warn(&graph);
                self.desk.put(Job { generation, sha256, graph, cause: cause.to_owned(), since }, self.stage);
            }
            (graph, sha256) => {
                let loaded = Loaded { graph, ..loaded };
                self.held = Some(Held { loaded, generation, sha256, told: !unfinished, due: since + hold });
            }
        }
        self.follow();
    }

    /// Shows the advice of a graph, but not the same again at every save.
    fn warn(&mut self, graph: &Graph) {
        let warnings: Vec<String> = graph.warnings.iter().map(|w| w.message.clone()).collect();
        if warnings != self.warned {
            report::show(self.teller.terminal, &graph.warnings, &graph.sources);
            self.warned = warnings;
        }
    }

    /// The file has been as it is for long enough: its errors are told.
    fn tell_held(&mut self) {
        let Some(held) = self.held.take() else { return };
        if !held.told {
            self.teller.saved(held.sha256.as_deref());
        }
        let errors: Vec<_> = held.loaded.diagnostics.iter().filter(|d| !d.warning).cloned().collect();
        self.stage.fail(held.generation, &errors, &held.loaded.sources);
        self.teller.errors(held.sha256.as_deref(), &errors, &held.loaded.sources);
    }

    /// Watches the folders that matter now.
    fn follow(&mut self) {
        if let Some(folders) = &mut self.folders
            && let Err(error) = folders.keep(self.files.paths())
            && matches!(error.kind, notify::ErrorKind::MaxFilesWatch)
        {
            self.teller.terminal.warning("the system has no watches left; the files are looked at regularly instead");
            self.folders = None;
        }
    }
}

/// Hints from the system, if it gives any.
fn watcher(signals: Sender<Signal>, terminal: &Terminal) -> Option<Folders> {
    match Folders::new(signals) {
        Ok(folders) => Some(folders),
        Err(error) => {
            terminal.warning(&format!("{error}; the files are looked at regularly instead"));
            None
        }
    }
}
