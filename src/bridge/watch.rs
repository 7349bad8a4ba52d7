//! Graphs whose files are watched. Files are compared at regular times, because few of them are watched.
use super::Bridge;
use crate::watch::FileSet;
use shibo_bridge::scene::lock;
use shibo_picture::contained;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Interval of the comparison.
const POLL: Duration = Duration::from_millis(100);
/// Delay for errors of a file that ends too early, since it is probably being written.
const UNFINISHED: Duration = Duration::from_millis(700);
/// Delay for other errors: the file may be half old and half new.
const DOUBTFUL: Duration = Duration::from_millis(150);

/// A watched graph.
#[derive(Default)]
struct Watched {
    files: FileSet,
    /// The time from which errors of the last change are reported.
    due: Option<Instant>,
}

#[derive(Default)]
struct State {
    graphs: BTreeMap<String, Watched>,
    stopped: bool,
}

/// All watched graphs.
#[derive(Default)]
pub(super) struct Watch {
    state: Mutex<State>,
    woken: Condvar,
}

impl Watch {
    /// Watches the files of a graph. `answer` tells the other program, before any event about the graph.
    pub(super) fn add(&self, graph: &str, files: &[PathBuf], answer: impl FnOnce()) {
        let mut state = lock(&self.state);
        if !files.is_empty() {
            state.graphs.entry(graph.to_owned()).or_default().files.keep(files);
        }
        answer();
        drop(state);
        self.woken.notify_all();
    }

    /// Ends the thread.
    pub(super) fn stop(&self) {
        lock(&self.state).stopped = true;
        self.woken.notify_all();
    }
}

/// Compares files until stopped.
pub(super) fn run(bridge: &Bridge<'_>) {
    let watch = &bridge.watch;
    let mut state = lock(&watch.state);
    while !state.stopped {
        let now = Instant::now();
        state.graphs.retain(|graph, watched| look(bridge, graph, watched, now));
        let idle = state.graphs.is_empty();
        state = match idle {
            true => watch.woken.wait(state).unwrap_or_else(PoisonError::into_inner),
            false => watch.woken.wait_timeout(state, POLL).unwrap_or_else(PoisonError::into_inner).0,
        };
    }
}

/// Reads a graph again if its files have changed; false if it is not open any more.
fn look(bridge: &Bridge<'_>, graph: &str, watched: &mut Watched, now: Instant) -> bool {
    let has_changed = !watched.files.changed().is_empty();
    let is_due = watched.due.is_some_and(|due| due <= now);
    if !has_changed && !is_due {
        return lock(&bridge.host).is_open(graph);
    }
    let mut host = lock(&bridge.host);
    // After a defect the last good graph stays.
    let Ok(reloaded) = contained(|| host.reload(graph)) else { return true };
    let Some(reloaded) = reloaded else { return false };
    watched.files.keep(&host.files(graph));
    drop(host);
    if reloaded.is_broken && !is_due {
        watched.due = Some(now + if reloaded.is_unfinished { UNFINISHED } else { DOUBTFUL });
        return true;
    }
    watched.due = None;
    bridge.send(reloaded.message.json.into());
    true
}
