//! Time that work continues after a cancellation: `cargo bench -p shibo --bench cancel`. `SHIBO_CASE=warp` selects the
//! cases with this word in their name.
//!
//! Each case is started again and again and cancelled a little later each time, until it ends before the cancellation.
//! The shortest of several tries counts, since other processes may load the machine.
#[path = "../tests/support/long_work.rs"]
mod long_work;

use cpu_time::ProcessTime;
use long_work::{CASES, load, prepare, session, work};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, Session};
use shibo_graph::Graph;
use std::time::{Duration, Instant};

/// Good enough: the page follows a save at once.
const GOOD: Duration = Duration::from_millis(25);
/// Maximum number of tries.
const TRIES: usize = 6;

/// Time that the work continues after a cancellation `after` its start; `None` if it ended before. To exclude time that
/// other processes take from the processor, the smaller of wall time and CPU time of all threads counts.
fn stopped(session: &Session, graph: &Graph, after: Duration) -> Option<Duration> {
    let token = CancelToken::default();
    let stop = token.clone();
    let stopping = std::thread::spawn(move || {
        std::thread::sleep(after);
        stop.cancel();
        (Instant::now(), ProcessTime::now())
    });
    let result = work(session, graph, &token);
    let (end, worked) = (Instant::now(), ProcessTime::now());
    let (asked, worked_before) = stopping.join().expect("it only waits");
    let at_work = worked.as_duration().saturating_sub(worked_before.as_duration());
    let time = end.saturating_duration_since(asked).min(at_work);
    match result {
        // Work that never checks for cancellation ends normally.
        Ok(()) if end > asked + Duration::from_millis(1) => {
            session.caches().memory.clear();
            prepare(session, graph);
            Some(time)
        }
        Ok(()) => None,
        Err(Failure::Cancelled) => Some(time),
        Err(failure) => panic!("{failure:?}"),
    }
}

fn main() {
    let only = std::env::var("SHIBO_CASE").unwrap_or_default();
    for case in CASES.iter().filter(|case| case.name.contains(&only)) {
        let graph = load(case);
        let session = session(2);
        prepare(&session, &graph);
        let mut after = Duration::from_millis(2);
        let mut times = Vec::new();
        'longer: loop {
            let mut best = Duration::MAX;
            for _ in 0..TRIES {
                let Some(time) = stopped(&session, &graph, after) else { break 'longer };
                best = best.min(time);
                if best < GOOD {
                    break;
                }
            }
            times.push((best, after));
            after = after.mul_f64(1.3);
        }
        times.sort();
        let (worst, at) = times.last().copied().unwrap_or_default();
        let median = times.get(times.len() / 2).map_or(Duration::ZERO, |t| t.0);
        println!("{:40} {:4} stops: median {median:6.1?}, worst {worst:6.1?} at {at:.0?}", case.name, times.len());
    }
}
