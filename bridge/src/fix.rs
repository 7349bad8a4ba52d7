//! Applies fixes to a graph.
use crate::check::{Located, check_within, workspace};
use crate::{CheckRequest, GraphText, Tools};
use serde::{Deserialize, Serialize};
use shibo_graph::load_text;
use shibo_ide::Cx;
use shibo_ide::diagnose::{Finding, by_file};
use shibo_ide::fixes::{Applies, Budget, Errors, Fix, counted, errors, fixes};
use shibo_ide::rename::{Edit, apply};
use similar::TextDiff;
use std::collections::BTreeMap;

/// Most rounds of fixes, because a fix may bring other errors to light.
pub const ROUNDS: usize = 3;

/// A graph to fix.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FixRequest {
    /// The graph.
    pub graph: GraphText,
    /// The least certain fixes that are applied: `sure`, or `likely` for both. Choices are never applied.
    pub applies: Applies,
    /// Most rounds, at most [`ROUNDS`].
    pub rounds: usize,
}

/// A graph after fixes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fixed {
    /// The text: that of the request, if no fix helped.
    pub text: String,
    /// The remaining errors and warnings.
    pub diagnostics: Vec<Located>,
    /// Titles of the applied fixes, in their order.
    pub applied: Vec<String>,
    /// A sentence for people if not all fixes were tried.
    pub note: Option<String>,
}

/// The text of a graph after fixes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repaired {
    /// The text: that of the request, if no fix helped.
    pub text: String,
    /// Titles of the applied fixes, in their order.
    pub applied: Vec<String>,
}

/// Applies the best fix of each error until none is left, and checks the result. Comments stay. One budget bounds all trials.
pub fn fix(tools: &Tools, request: &FixRequest) -> Fixed {
    let mut budget = Budget::default();
    let Repaired { text, applied } = repair(tools, request, &mut budget);
    let graph = GraphText { path: request.graph.path.clone(), text };
    let checked = check_within(tools, &CheckRequest { graph }, &mut budget);
    Fixed { text: checked.text, diagnostics: checked.diagnostics, applied, note: checked.note }
}

/// Applies the best fix of each error until none is left. Comments stay. The result is the best of the texts after each round, and the
/// text of the request if none is better, see [`Errors::is_better_than`], or after a cancellation.
pub fn repair(tools: &Tools, request: &FixRequest, budget: &mut Budget) -> Repaired {
    let mut graph = request.graph.clone();
    let mut applied = Vec::new();
    let mut best: Option<(Errors, Repaired)> = None;
    for left in (0..=request.rounds.min(ROUNDS)).rev() {
        let found = Found::of(tools, &graph);
        if best.as_ref().is_none_or(|(best, _)| found.errors.is_better_than(best)) {
            best = Some((found.errors.clone(), Repaired { text: graph.text.clone(), applied: applied.clone() }));
        }
        let Some((text, titles)) = (left > 0).then(|| round(tools, &graph, request.applies, found, budget)).flatten()
        else {
            break;
        };
        graph.text = text;
        applied.extend(titles);
    }
    let unchanged = || Repaired { text: request.graph.text.clone(), applied: Vec::new() };
    let best = best.filter(|_| !tools.cancel.is_cancelled());
    best.map_or_else(unchanged, |(_, best)| best)
}

/// The result of checking a text.
struct Found {
    findings: Vec<Finding>,
    errors: Errors,
    /// Errors and warnings.
    all: Errors,
}

impl Found {
    fn of(tools: &Tools, graph: &GraphText) -> Self {
        let loaded = load_text(&graph.path, &graph.text, &tools.registry, &tools.options());
        let own = loaded.sources.sources().first().map(|source| source.path.clone());
        let findings = own.and_then(|own| by_file(&loaded.diagnostics, &loaded.sources).remove(&own));
        Self {
            findings: findings.unwrap_or_default(),
            errors: counted(loaded.diagnostics.iter().filter(|one| !one.warning)),
            all: counted(&loaded.diagnostics),
        }
    }
}

/// The text after one round, and titles of fixes; `None` if there are no fixes.
fn round(
    tools: &Tools,
    graph: &GraphText,
    applies: Applies,
    found: Found,
    budget: &mut Budget,
) -> Option<(String, Vec<String>)> {
    let Found { findings, errors: before, all } = found;
    let mut world = workspace(tools);
    let file = world.open(&graph.path, graph.text.as_str());
    let cx = Cx { world: &world, file: &file };
    let is_wanted = |fix: &Fix| fix.applies <= applies && fix.applies != Applies::Choice;
    let best = |fixes: Vec<Fix>| fixes.into_iter().find(is_wanted);
    // All fixes together must be tried, too.
    let aside = budget.set_aside(graph.text.len(), before.count());
    let wanted: Vec<Fix> = fixes(cx, &findings, Some(all), budget).into_iter().filter_map(best).collect();
    budget.give_back(aside);
    let (edits, titles) = joined(&wanted);
    if titles.len() > 1 {
        let text = apply(&graph.text, &edits);
        let is_good = |after: Errors| {
            let fewer = after.syntax() < before.syntax() || after.count() < before.count();
            (fewer || after.solved(&before) >= titles.len()) && after.is_better_than(&before)
        };
        if !errors(cx, &text, before.count(), budget).is_some_and(is_good) {
            return Some(some(cx, &wanted, &before, budget));
        }
    }
    (!titles.is_empty()).then(|| (apply(&graph.text, &edits), titles))
}

/// The edits of all fixes that do not overlap earlier ones, and their titles.
fn joined(fixes: &[Fix]) -> (Vec<Edit>, Vec<String>) {
    let (mut edits, mut titles): (Vec<Edit>, Vec<String>) = (Vec::new(), Vec::new());
    // Ends of the edits by their starts.
    let mut taken: BTreeMap<usize, usize> = BTreeMap::new();
    for fix in fixes {
        let meets =
            |edit: &Edit| taken.range(..=edit.range.end).next_back().is_some_and(|(_, end)| edit.range.start <= *end);
        if !fix.edits.iter().any(meets) {
            for edit in &fix.edits {
                let end = taken.entry(edit.range.start).or_default();
                *end = edit.range.end.max(*end);
            }
            edits.extend(fix.edits.iter().cloned());
            titles.push(fix.title.clone());
        }
    }
    (edits, titles)
}

/// Applies the fixes that help beside each other; the first one, which helps alone, always. Groups of fixes are tried before their
/// halves, so that a few bad ones among many take few trials.
fn some(cx: Cx<'_>, wanted: &[Fix], before: &Errors, budget: &mut Budget) -> (String, Vec<String>) {
    let text = |fixes: &[Fix]| apply(&cx.file.text, &joined(fixes).0);
    let (first, others) = wanted.split_at(1);
    let mut kept = first.to_vec();
    let mut now = errors(cx, &text(&kept), before.count(), budget);
    let mut groups = vec![others];
    while let (Some(group), Some(errors_now)) = (groups.pop(), &now) {
        if group.is_empty() {
            continue;
        }
        let with = [&kept[..], group].concat();
        // The budget has ended.
        let Some(after) = errors(cx, &text(&with), errors_now.count(), budget) else { break };
        // Each fix of a group must solve an error.
        let solved = after.solved(errors_now).max(errors_now.count().saturating_sub(after.count()));
        let helps = group.len() == 1 || solved >= group.len();
        if helps && after.is_better_than(errors_now) {
            (kept, now) = (with, Some(after));
        } else if group.len() > 1 {
            let (early, late) = group.split_at(group.len() / 2);
            groups.extend([late, early]);
        }
    }
    (text(&kept), joined(&kept).1)
}

/// The differences between two texts of a file, as `diff -u` prints them.
pub fn unified(name: &str, before: &str, after: &str) -> String {
    TextDiff::from_lines(before, after).unified_diff().header(name, name).to_string()
}
