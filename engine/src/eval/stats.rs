//! Statistics of the work done, per node.
use crate::value::Key;
use std::collections::HashMap;
use std::sync::Mutex;
use std::time::Duration;

/// Source of a node's result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NodeState {
    /// Its own code ran.
    Computed,
    /// The result was in memory.
    Memory,
    /// The result was on disk.
    Disk,
    /// Needed by an output, but not computed by itself: its readers compute it along with their own values, or their
    /// results were cached.
    Folded,
    /// No output needs it.
    Unused,
}

/// The work done for a node.
#[derive(Clone, Debug, serde::Serialize)]
pub struct NodeStats {
    /// The node's name.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Source of its result.
    pub state: NodeState,
    /// CPU seconds of its own code over all threads, without those of its inputs.
    pub seconds: f64,
    /// Number of tiles computed.
    pub tiles: u64,
    /// Number of pixels computed in these tiles, some of which are computed only in part.
    pub pixels: u64,
}

/// A result that was written to the store.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// Node name, or `node.output`.
    pub node: String,
    /// Size in bytes.
    pub bytes: u64,
    /// Seconds of CPU time to compute.
    pub seconds: f64,
}

/// The work done under one key.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Work {
    pub(super) time: Duration,
    pub(super) computed: u64,
    pub(super) pixels: u64,
    pub(super) memory: u64,
    pub(super) disk: u64,
}

impl Work {
    pub(super) fn add(&mut self, other: Self) {
        self.time += other.time;
        self.computed += other.computed;
        self.pixels += other.pixels;
        self.memory += other.memory;
        self.disk += other.disk;
    }
}

/// Work by key, summed over all threads.
#[derive(Default)]
pub(super) struct Ledger(Mutex<HashMap<Key, Work>>);

impl Ledger {
    pub(super) fn add(&self, key: Key, work: Work) {
        let mut map = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        map.entry(key).or_default().add(work);
    }

    /// The time of all work.
    pub(super) fn spent(&self) -> Duration {
        let map = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        map.values().map(|work| work.time).sum()
    }

    pub(super) fn get(&self, key: Key) -> Work {
        let map = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        map.get(&key).copied().unwrap_or_default()
    }
}
