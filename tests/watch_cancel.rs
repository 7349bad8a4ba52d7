//! A newer save stops old work: every node that can be at work for long asks often enough whether it should go on.
//!
//! What is counted is how often work asks, in all and once it was told to stop, and not how long it takes; for that there is
//! `cargo bench --bench cancel`.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]
#[path = "support/long_work.rs"]
mod long_work;

use long_work::{CASES, load, prepare, session, work};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::Failure;

#[test]
fn all_that_takes_long_stops_when_asked() {
    let only = std::env::var("SHIBO_CASE").unwrap_or_default();
    for case in CASES.iter().filter(|case| case.0.contains(&only)) {
        let graph = load(case);
        let session = session(2);
        prepare(&session, &graph);
        let start = std::time::Instant::now();
        let cpu = cpu_time::ProcessTime::now();
        let token = CancelToken::counting(0);
        work(&session, &graph, &token).unwrap();
        let all = token.asked();
        print!("{:40} {:6.0?} {:6.0?} {all:8}", case.0, start.elapsed(), cpu.elapsed());
        for percent in [0, 25, 50, 75, 95] {
            session.caches().memory.clear();
            prepare(&session, &graph);
            let last = (all * percent / 100).max(1);
            let token = CancelToken::counting(last);
            let result = work(&session, &graph, &token);
            assert_eq!(result, Err(Failure::Cancelled));
            print!(" {:6}", token.asked() - last);
        }
        println!();
    }
}
