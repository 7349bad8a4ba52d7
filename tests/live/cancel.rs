//! A newer save stops old work: every long-running node checks often enough for cancellation.
//!
//! The test counts checks instead of time; `cargo bench --bench cancel` measures the time.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use crate::long_work::{CASES, load, prepare, session, work};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::Failure;

/// When to cancel, in percent of all checks; the cases alternate.
const STOPS: [u64; 4] = [10, 40, 70, 95];

#[test]
fn long_work_checks_for_cancellation() {
    for (case, percent) in CASES.iter().zip(STOPS.iter().cycle()) {
        let graph = load(case);
        let session = session(2);
        prepare(&session, &graph);
        let stop = CancelToken::counting((case.questions * percent / 100).max(1));
        assert_eq!(work(&session, &graph, &stop), Err(Failure::Cancelled), "{}", case.name);
        // Results made before the cancellation are reused.
        let token = CancelToken::counting(0);
        work(&session, &graph, &token).unwrap();
        let all = stop.asked() + token.asked();
        assert!(all >= case.questions, "{}: asked {all} times, and not {}", case.name, case.questions);
    }
}
