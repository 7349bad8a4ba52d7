//! Measures the CPU time of nodes that compute whole results, on any number of threads.
//!
//! A thread's own clock misses work that other threads do for it, so the process clock is read whenever a node begins,
//! ends, or reads a field. The time since the last reading belongs to the running nodes. Nodes that run at the same
//! time share it equally, so their sum never exceeds the time of the process. The time of tiles is measured on their
//! threads and is not shared.
use crate::value::clock::process_time;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Divides the CPU time of the process among the running nodes.
#[derive(Default)]
pub(super) struct Meter {
    state: Mutex<State>,
    /// Nanoseconds spent on tiles.
    tiles: AtomicU64,
}

#[derive(Default)]
struct State {
    running: BTreeMap<u64, Share>,
    next: u64,
    /// CPU time of the process, and of tiles, at the last division.
    before: (Duration, Duration),
    /// Tile time that was given to nodes before it was known to belong to tiles.
    owed: Duration,
}

#[derive(Default)]
struct Share {
    time: Duration,
    /// Number of fields being read for this node.
    reads: u32,
}

impl State {
    /// Divides the time spent up to `process`, of which `tiles` belongs to tiles.
    fn share(&mut self, process: Duration, tiles: Duration) {
        let (spent, known) = (process.saturating_sub(self.before.0), tiles.saturating_sub(self.before.1));
        self.before = (process.max(self.before.0), tiles.max(self.before.1));
        let busy = self.running.values_mut().filter(|share| share.reads == 0);
        let busy: Vec<&mut Share> = busy.collect();
        let Ok(count @ 1..) = u32::try_from(busy.len()) else {
            self.owed = Duration::ZERO;
            return;
        };
        let taken = known + self.owed;
        self.owed = taken.saturating_sub(spent);
        let each = spent.saturating_sub(taken) / count;
        busy.into_iter().for_each(|share| share.time += each);
    }
}

impl Meter {
    fn now(&self) -> MutexGuard<'_, State> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let tiles = Duration::from_nanos(self.tiles.load(Ordering::Relaxed));
        state.share(process_time(), tiles);
        state
    }

    /// Starts measuring a node.
    pub(super) fn begin(&self) -> Working<'_> {
        let mut state = self.now();
        let number = state.next;
        state.next += 1;
        state.running.insert(number, Share::default());
        Working { meter: self, number }
    }

    /// Records thread time spent on a tile.
    pub(super) fn tile(&self, time: Duration) {
        self.tiles.fetch_add(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX), Ordering::Relaxed);
    }
}

/// A running node; measured until dropped.
pub(super) struct Working<'m> {
    meter: &'m Meter,
    number: u64,
}

impl Working<'_> {
    fn count(&self, change: impl FnOnce(&mut u32)) {
        if let Some(share) = self.meter.now().running.get_mut(&self.number) {
            change(&mut share.reads);
        }
    }

    /// Reads a field; the node is not charged for this time.
    pub(super) fn read<T>(&self, read: impl FnOnce() -> T) -> T {
        self.count(|reads| *reads += 1);
        let read = read();
        self.count(|reads| *reads -= 1);
        read
    }

    /// The node's CPU time so far.
    pub(super) fn time(&self) -> Duration {
        self.meter.now().running.get(&self.number).map_or(Duration::ZERO, |share| share.time)
    }
}

impl Drop for Working<'_> {
    fn drop(&mut self) {
        self.meter.now().running.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn divides_process_time_among_running_nodes() {
        let mut state = State::default();
        state.running.insert(0, Share::default());
        state.share(SECOND, Duration::ZERO);
        state.running.insert(1, Share::default());
        // Two more seconds for both nodes, then four, of which one was spent on tiles while the second node read them.
        state.share(3 * SECOND, Duration::ZERO);
        state.running.get_mut(&1).unwrap().reads = 1;
        state.share(7 * SECOND, SECOND);
        let times: Vec<u64> = state.running.values().map(|share| share.time.as_secs()).collect();
        assert_eq!(times, [1 + 1 + 3, 1]);
    }

    #[test]
    fn deducts_tile_time_that_is_reported_late() {
        let mut state = State::default();
        state.running.insert(0, Share::default());
        state.share(4 * SECOND, Duration::ZERO);
        // A tile that took three seconds ends now: two of them were already given to the node.
        state.share(5 * SECOND, 3 * SECOND);
        state.share(9 * SECOND, 3 * SECOND);
        assert_eq!(state.running[&0].time, (4 + 4 - 2) * SECOND);
        // Time that passes while nothing runs is not counted.
        state.running.clear();
        state.share(20 * SECOND, 3 * SECOND);
        state.running.insert(1, Share::default());
        state.share(21 * SECOND, 3 * SECOND);
        assert_eq!(state.running[&1].time, SECOND);
    }
}
