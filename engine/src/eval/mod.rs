//! Evaluation: derives keys before values and objects before tiles, and caches every result under its key.
//!
//! [`Keys`] names the result of every node without computing it. A [`Run`] computes the requested values: objects
//! first, in parallel where they are independent, then tiles of fields, in parallel, each on one thread. A result whose
//! key is in the [`MemoryCache`] or in the [`Store`], currently a [`DiskCache`], is not computed.
mod bounds;
mod cancel;
mod demand;
mod disk;
mod entry;
mod evaluators;
mod files;
mod keep;
mod kept;
mod keys;
mod known;
mod limit;
mod memory;
mod meter;
mod order;
mod overlap;
mod prepare;
mod region;
mod run;
mod schedule;
mod shared;
mod stats;
mod store;
mod tiles;
mod warned;
mod warnings;

pub use cancel::CancelToken;
pub use demand::{Demand, Fields};
pub use disk::{CacheError, DiskCache, DiskUse};
pub use entry::{Digest, Digester, Seal, Shelf};
pub use keys::Keys;
pub use limit::Neighbor;
pub use memory::{MemoryCache, TileKey};
pub use order::{Order, Pass};
pub use overlap::OverlapStore;
pub(crate) use run::defect;
pub use run::{Caches, Run};
pub use shared::{Checked, LARGEST_ANSWER, PATIENCE, Remote, SharedStore, Trouble};
pub use stats::{NodeState, NodeStats, Stored};
pub use store::{Layers, MemoryStore, Store};
pub(crate) use warnings::{Gathered, Warnings, append as append_warnings, split as split_warnings};

use crate::registry::Registry;
use crate::value::Key;
pub use crate::value::codec::{decode, encode};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks `mutex`, also if a thread panicked while it held the lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Events reported to an observer during an evaluation.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Event {
    /// Progress of a node; `done == total` when it is finished.
    Node {
        /// The node's name.
        name: String,
        /// Steps done.
        done: u64,
        /// Steps to do.
        total: u64,
    },
    /// Pixel rows completed, over all outputs.
    Rows {
        /// Rows done.
        done: u64,
        /// Rows to do.
        total: u64,
    },
    /// A warning for the user.
    Warning(crate::diagnostics::Diagnostic),
}

/// Receives progress and warnings, from any thread.
pub trait Observer: Sync {
    /// Called for each event.
    fn event(&self, event: Event);
}

/// An observer that ignores all events.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {
    fn event(&self, _event: Event) {}
}

/// A key for all code that results depend on: the engine, and the kinds of a registry. Other code may give other results.
pub fn code(registry: &Registry) -> Key {
    let crates = [shibo_picture::CODE, shibo_graph::CODE, crate::CODE].map(str::as_bytes);
    Key::of("code", &[registry.code().as_bytes(), crates[0], crates[1], crates[2]])
}
