//! A store shared by several machines, behind a [`Remote`]. The remote may be slow, full, unreachable or return
//! arbitrary bytes; the run then only loses a few seconds.
//!
//! - Each answer is awaited for at most [`PATIENCE`]. Failures are counted; a store that fails several times, or for
//!   [`MOST_LOST`] in total, is not used again in this process.
//! - A separate thread writes, and only results that take longer to compute than to send, or at least [`COSTLY`].
//!   [`SharedStore::finish`] waits for these writes within the remaining allowance.
//! - Every result must match its seal; with a secret, a seal cannot be forged.
mod entry;
mod tally;

pub use entry::Checked;

use super::{Digester, Seal, Shelf, Store};
use crate::value::Key;
use crate::value::clock::Stopwatch;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tally::RemoteHealth;

/// An answer that takes longer counts as missing.
pub const PATIENCE: Duration = Duration::from_millis(1500);
/// After this much time spent waiting in vain, a store is not used again. With one more missing answer, the total is
/// still below five seconds.
const MOST_LOST: Duration = Duration::from_millis(2500);
/// A result that takes this long to compute is always shared.
const COSTLY: Duration = Duration::from_millis(200);
/// Larger results are not shared.
const LARGEST: u64 = 256 << 20;
/// The most bytes of a remote's answer.
pub const LARGEST_ANSWER: u64 = LARGEST + entry::MORE;
/// The most bytes queued for writing.
const WAITING: u64 = 512 << 20;

/// Reason why a [`Remote`] did not perform a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trouble {
    /// No answer in time.
    Slow,
    /// No connection, or a broken one.
    Gone,
    /// Not allowed to read or to write.
    Denied,
    /// No such bucket or folder.
    Missing,
    /// The remote reported a failure, such as HTTP 503.
    Failed,
    /// The answer differs from the data written.
    Wrong,
}

impl Trouble {
    /// The trouble as the end of a sentence about the store.
    pub fn text(self) -> &'static str {
        match self {
            Self::Slow => "does not answer in time",
            Self::Gone => "cannot be reached",
            Self::Denied => "does not allow it",
            Self::Missing => "has no such bucket or folder",
            Self::Failed => "answers that it cannot",
            Self::Wrong => "returns something else than was written",
        }
    }
}

/// Bytes by name on another machine. No call takes much longer than `within`.
pub trait Remote: Send + Sync {
    /// The bytes under a name, at most `most`; `None` if there are none.
    ///
    /// # Errors
    /// Any trouble.
    fn get(&self, name: &str, most: u64, within: Duration) -> Result<Option<Vec<u8>>, Trouble>;

    /// Puts bytes under a name; they appear there when they are complete.
    ///
    /// # Errors
    /// Any trouble.
    fn put(&self, name: &str, bytes: Vec<u8>, within: Duration) -> Result<(), Trouble>;
}

/// A store that machines share.
pub struct SharedStore {
    shared: Arc<Shared>,
    seal: Seal,
    queue: Mutex<Option<Sender<Job>>>,
}

struct Shared {
    remote: Box<dyn Remote>,
    tally: Mutex<RemoteHealth>,
    /// Notified after each write.
    written: Condvar,
}

/// A queued write.
struct Job {
    name: String,
    bytes: Vec<u8>,
}

impl Shared {
    fn tally(&self) -> MutexGuard<'_, RemoteHealth> {
        self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self, jobs: &Receiver<Job>) {
        while let Ok(Job { name, bytes }) = jobs.recv() {
            let length = bytes.len() as u64;
            if self.tally().may_write() {
                let start = Stopwatch::wall();
                // Large entries may take longer, since the command meanwhile does other work.
                let within = PATIENCE.max(Duration::from_secs_f64(length as f64 / 4e6));
                let result = self.remote.put(&name, bytes, within);
                self.tally().wrote(length, start.elapsed(), result);
            }
            self.tally().waiting -= length;
            self.written.notify_all();
        }
    }
}

impl SharedStore {
    /// A store behind `remote` whose entries have this seal.
    pub fn new(remote: Box<dyn Remote>, seal: Seal) -> Self {
        let shared = Arc::new(Shared { remote, tally: Mutex::default(), written: Condvar::new() });
        let (sender, receiver) = channel();
        let writer = shared.clone();
        let started = std::thread::Builder::new().name("shibo-shared".into()).spawn(move || writer.write(&receiver));
        // If the thread cannot be started, nothing is written, which only costs time.
        Self { shared, seal, queue: Mutex::new(started.is_ok().then_some(sender)) }
    }

    fn name(&self, shelf: Shelf, key: Key) -> String {
        let name = self.seal.name(key).to_string();
        format!("{}/{}/{}", shelf.name(), &name[..2], &name[2..])
    }

    /// Waits for queued writes within the remaining allowance, then drops the rest.
    pub fn finish(&self) {
        let mut tally = self.shared.tally();
        let (start, most) = (Stopwatch::wall(), tally.left());
        while tally.waiting > 0 && tally.may_write() {
            let left = most.saturating_sub(start.elapsed());
            if left.is_zero() {
                tally.gave_up();
                break;
            }
            let waited = self.shared.written.wait_timeout(tally, left);
            tally = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// The first failure and the number of failures, if any.
    pub fn trouble(&self) -> Option<(Trouble, u32)> {
        self.shared.tally().trouble()
    }
}

impl Store for SharedStore {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        if !shelf.travels() || !self.shared.tally().may_read() {
            return None;
        }
        let (name, start) = (self.name(shelf, key), Stopwatch::wall());
        let found = self.shared.remote.get(&name, LARGEST_ANSWER, PATIENCE);
        let opened = match found {
            Ok(Some(bytes)) => entry::open(&self.seal, (shelf, key), &name, bytes).map(Some).ok_or(Trouble::Wrong),
            Ok(None) => Ok(None),
            Err(trouble) => Err(trouble),
        };
        let length = opened.as_ref().ok().and_then(Option::as_ref).map_or(0, Vec::len);
        self.shared.tally().read(length as u64, start.elapsed(), opened.as_ref().err().copied());
        opened.ok().flatten()
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], spared: Duration, stopped: &dyn Fn() -> bool) {
        let length = content.len() as u64;
        let small = shelf == Shelf::Channels;
        if !shelf.travels() || length > LARGEST || stopped() {
            return;
        }
        {
            let mut tally = self.shared.tally();
            let worth = small || spared >= COSTLY || spared >= tally.cost(length) * 2;
            if !worth || !tally.may_write() || tally.waiting + length > WAITING {
                return;
            }
            tally.waiting += length + entry::MORE;
        }
        let name = self.name(shelf, key);
        let mut digest = Digester::default();
        digest.update(content);
        let seal = self.seal.of(shelf, key, &digest.finish());
        let bytes = entry::close(&self.seal, &name, content, &seal);
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        if queue.as_ref().is_none_or(|queue| queue.send(Job { name, bytes }).is_err()) {
            self.shared.tally().waiting -= length + entry::MORE;
        }
    }

    /// Removes nothing: a correct result later overwrites the wrong one.
    fn remove(&self, _shelf: Shelf, _key: Key) {}

    fn room(&self) -> u64 {
        LARGEST
    }
}

#[cfg(test)]
mod tests;
