//! The thread that checks texts, so that no answer waits for a check.
use shibo_ide::server::{Checker, Job};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Interval between checks of the files on disk.
const LOOK: Duration = Duration::from_millis(400);

/// Runs until all senders of jobs are gone.
pub(super) fn run(mut checker: Checker, jobs: &Receiver<Job>) {
    let mut looked = Instant::now();
    loop {
        let wait = if checker.is_due() { Duration::ZERO } else { LOOK.saturating_sub(looked.elapsed()) };
        match jobs.recv_timeout(wait) {
            Ok(job) => {
                checker.take(job);
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {}
        }
        if !checker.check_next() && looked.elapsed() >= LOOK {
            checker.look();
            looked = Instant::now();
        }
    }
}
