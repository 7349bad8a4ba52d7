//! What was done, by node.
use crate::value::Key;
use std::collections::HashMap;
use std::sync::Mutex;
use std::time::Duration;

/// Where the result of a node came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NodeState {
    /// Its own code ran.
    Computed,
    /// It was in memory.
    Memory,
    /// It was on disk.
    Disk,
    /// An output needs it, but it did not have to be made by itself: those that read it compute it with their own values, or
    /// what they make of it was at hand.
    Folded,
    /// No output needs it.
    Unused,
}

/// What was done for a node.
#[derive(Clone, Debug, serde::Serialize)]
pub struct NodeStats {
    /// The node's name.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Where its result came from.
    pub state: NodeState,
    /// CPU seconds of its own code over all threads, without those of its inputs.
    pub seconds: f64,
    /// How many tiles it computed.
    pub tiles: u64,
    /// How many pixels of them: of some tiles only a part is computed.
    pub pixels: u64,
}

/// Something that was put into the store.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// The node, and which of its outputs, that it is of.
    pub node: String,
    /// Its size.
    pub bytes: u64,
    /// The time that it took.
    pub seconds: f64,
}

/// What was done under one key.
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

/// Work by key, gathered from all threads.
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
