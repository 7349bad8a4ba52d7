//! What a shared store has cost so far, and whether it is still asked.
use super::{MOST_LOST, PATIENCE, Trouble};
use std::time::Duration;

/// So many failures in a row, and the store is left alone.
const FAILURES: u32 = 3;
/// All losses together stay below five seconds; this much of it may pass at the end.
const END: Duration = Duration::from_millis(4000);
/// What is believed before anything was measured: the seconds of an answer, and bytes a second.
const LATENCY: f64 = 0.02;
const RATE: f64 = 30e6;

/// Counts what happens.
#[derive(Default)]
pub(super) struct Tally {
    /// Bytes that wait to be written.
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

impl Tally {
    pub(super) fn may_read(&self) -> bool {
        !self.reads_over
    }

    pub(super) fn may_write(&self) -> bool {
        !self.writes_over
    }

    /// How long the end of a command may wait.
    pub(super) fn left(&self) -> Duration {
        END.saturating_sub(self.lost)
    }

    /// The time that it takes to send so much.
    pub(super) fn cost(&self, bytes: u64) -> Duration {
        let (seconds, moved) = self.moved;
        let rate = (RATE + moved) / (1.0 + seconds);
        Duration::from_secs_f64(LATENCY + bytes as f64 / rate.max(1.0))
    }

    /// Notes an answer.
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
        // A store that is slow to refuse to read is as slow to refuse to write.
        if self.reads_failed >= FAILURES || self.lost >= MOST_LOST {
            self.reads_over = true;
            self.writes_over |= !matches!(trouble, Trouble::Wrong);
        }
    }

    /// Notes a write, which happened beside other work.
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
                // What is not allowed or not there will not be in a moment.
                let never = matches!(trouble, Trouble::Denied | Trouble::Missing);
                self.writes_over |= never || slow || self.writes_failed >= FAILURES;
            }
        }
    }

    /// Notes that the end could not wait for all writes.
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
