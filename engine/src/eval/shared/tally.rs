//! The time lost on a shared store so far, and the decision whether it is still used.
use super::{MOST_LOST, PATIENCE, Trouble};
use std::time::Duration;

/// After this many failures in a row, the store is no longer used.
const FAILURES: u32 = 3;
/// The most time lost in total when the end of a command waits. All losses together stay below five seconds.
const END: Duration = Duration::from_millis(4000);
/// Priors before any measurement: seconds per answer, and bytes per second.
const LATENCY: f64 = 0.02;
const RATE: f64 = 30e6;

/// Counts transfers, failures and lost time of a remote.
#[derive(Default)]
pub(super) struct RemoteHealth {
    /// Bytes queued for writing.
    pub(super) waiting: u64,
    pub(super) lost: Duration,
    reads_failed: u32,
    writes_failed: u32,
    reads_over: bool,
    writes_over: bool,
    troubles: u32,
    first: Option<Trouble>,
    /// Seconds and bytes of all transfers.
    moved: (f64, f64),
}

impl RemoteHealth {
    pub(super) fn may_read(&self) -> bool {
        !self.reads_over
    }

    pub(super) fn may_write(&self) -> bool {
        !self.writes_over
    }

    /// The time that the end of a command may still wait.
    pub(super) fn left(&self) -> Duration {
        END.saturating_sub(self.lost)
    }

    /// The estimated time to send `bytes`.
    pub(super) fn cost(&self, bytes: u64) -> Duration {
        let (seconds, moved) = self.moved;
        let rate = (RATE + moved) / (1.0 + seconds);
        Duration::from_secs_f64(LATENCY + bytes as f64 / rate.max(1.0))
    }

    /// Records an answer to a read.
    pub(super) fn read(&mut self, bytes: u64, took: Duration, trouble: Option<Trouble>) {
        let Some(trouble) = trouble else {
            self.reads_failed = 0;
            if bytes > 0 {
                self.moved(bytes, took);
            }
            return;
        };
        self.note(trouble);
        self.lost += took;
        self.reads_failed += 1;
        // A store that is slow to fail reads is also slow to fail writes.
        if self.reads_failed >= FAILURES || self.lost >= MOST_LOST {
            self.reads_over = true;
            self.writes_over |= !matches!(trouble, Trouble::Wrong);
        }
    }

    /// Records a write; writes run beside other work.
    pub(super) fn wrote(&mut self, bytes: u64, took: Duration, result: Result<(), Trouble>) {
        match result {
            Ok(()) => {
                self.writes_failed = 0;
                self.moved(bytes, took);
            }
            Err(trouble) => {
                self.note(trouble);
                self.writes_failed += 1;
                let slow = trouble == Trouble::Slow && took >= PATIENCE;
                // A refused or missing place does not change within a moment.
                let never = matches!(trouble, Trouble::Denied | Trouble::Missing);
                self.writes_over |= never || slow || self.writes_failed >= FAILURES;
            }
        }
    }

    /// Records that the end could not wait for all writes.
    pub(super) fn gave_up(&mut self) {
        self.note(Trouble::Slow);
        self.writes_over = true;
    }

    pub(super) fn trouble(&self) -> Option<(Trouble, u32)> {
        self.first.map(|first| (first, self.troubles))
    }

    fn note(&mut self, trouble: Trouble) {
        self.first.get_or_insert(trouble);
        self.troubles += 1;
    }

    fn moved(&mut self, bytes: u64, took: Duration) {
        self.moved.0 += took.as_secs_f64();
        self.moved.1 += bytes as f64;
    }
}
