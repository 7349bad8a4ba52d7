//! A newer save stops old work: every node that can be at work for long asks often enough whether it should go on.
//!
//! What is counted is how often work asks, and not how long it takes; for that there is `cargo bench --bench cancel`.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use crate::long_work::{CASES, load, prepare, session, work};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::Failure;

/// Where work is told to stop, in percent of the questions that it asks; the cases take turns.
const STOPS: [u64; 4] = [10, 40, 70, 95];

#[test]
fn all_that_takes_long_stops_when_asked() {
    for (case, percent) in CASES.iter().zip(STOPS.iter().cycle()) {
        let graph = load(case);
        let session = session(2);
        prepare(&session, &graph);
        let stop = CancelToken::counting((case.questions * percent / 100).max(1));
        assert_eq!(work(&session, &graph, &stop), Err(Failure::Cancelled), "{}", case.name);
        // What was made before the stop is not made again.
        let token = CancelToken::counting(0);
        work(&session, &graph, &token).unwrap();
        let all = stop.asked() + token.asked();
        assert!(all >= case.questions, "{}: asked {all} times, and not {}", case.name, case.questions);
    }
}
