//! Checks and fixes end early once their answers are not needed any more.
use crate::check::{Checked, check};
use crate::fix::{ROUNDS, fix};
use crate::{CheckRequest, FixRequest, GraphText, Tools, testing};
use shibo_engine::eval::CancelToken;
use shibo_ide::fixes::Applies;

/// A graph with this many misspelt kinds.
fn graph(count: usize) -> GraphText {
    let nodes: String = (0..count).map(|node| format!("\"n{node}\": Perlim(),\n")).collect();
    GraphText { path: "text.ron".into(), text: format!("(nodes: {{\n{nodes}}})") }
}

fn checked(tools: &Tools, cancel: &CancelToken) -> Checked {
    check(&tools.until(cancel), &CheckRequest { graph: graph(20) })
}

#[test]
fn cancelled_checks_stop_their_trials() {
    let tools = testing::tools();
    let token = CancelToken::counting(0);
    let whole = checked(&tools, &token);
    assert_eq!(whole.diagnostics.len(), 20);
    assert!(whole.diagnostics.iter().all(|one| !one.fixes.is_empty()), "{:?}", whole.diagnostics);
    let asked = token.asked();
    assert!(asked > 20, "asked {asked} times");
    // Halfway, the rest is left out. Each error left asks once more.
    let token = CancelToken::counting(asked / 2);
    let half = checked(&tools, &token);
    assert!(!half.diagnostics[0].fixes.is_empty() && half.diagnostics[19].fixes.is_empty(), "{:?}", half.diagnostics);
    assert!(token.asked() < asked, "{} of {asked}", token.asked());
    let token = CancelToken::default();
    token.cancel();
    assert_eq!(checked(&tools, &token).diagnostics, [], "a load that is cancelled tells nothing");
}

#[test]
fn cancelled_fixes_leave_the_text() {
    let tools = testing::tools();
    let fixed = |token: &CancelToken| {
        let request = FixRequest { graph: graph(8), applies: Applies::Likely, rounds: ROUNDS };
        fix(&tools.until(token), &request)
    };
    let whole = fixed(&CancelToken::default());
    assert!(whole.applied.len() == 8 && whole.diagnostics.iter().all(|one| one.warning), "{whole:?}");
    // The eight errors of the first round ask at least twice each.
    for last in [1, 5, 10] {
        let left = fixed(&CancelToken::counting(last));
        assert_eq!((left.text, left.applied.len()), (graph(8).text, 0), "{last}");
    }
}
