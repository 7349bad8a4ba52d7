//! Applies fixes to a graph.
use crate::check::{Located, check, workspace};
use crate::{CheckRequest, GraphText, Tools};
use serde::{Deserialize, Serialize};
use shibo_graph::{LoadOptions, load_text};
use shibo_ide::Cx;
use shibo_ide::diagnose::by_file;
use shibo_ide::fixes::{Applies, Errors, Fix, errors, fixes};
use shibo_ide::rename::{Edit, apply};
use similar::TextDiff;

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
}

/// Applies the best fix of each error until none is left. Comments stay. A cancelled call leaves the text as it is.
pub fn fix(tools: &Tools, request: &FixRequest) -> Fixed {
    let mut graph = request.graph.clone();
    let mut applied = Vec::new();
    for _ in 0..request.rounds.min(ROUNDS) {
        let Some((text, titles)) = round(tools, &graph, request.applies) else { break };
        if tools.cancel.is_cancelled() {
            break;
        }
        graph.text = text;
        applied.extend(titles);
    }
    if tools.cancel.is_cancelled() || !improves(tools, &request.graph, &graph.text) {
        graph.text.clone_from(&request.graph.text);
        applied.clear();
    }
    let checked = check(tools, &CheckRequest { graph });
    Fixed { text: checked.text, diagnostics: checked.diagnostics, applied }
}

/// Returns true if a text has fewer errors than the graph. Errors that a graph without nodes hides do not count.
fn improves(tools: &Tools, graph: &GraphText, text: &str) -> bool {
    let mut world = workspace(tools);
    let file = world.open(&graph.path, graph.text.as_str());
    let cx = Cx { world: &world, file: &file };
    let (before, after) = (errors(cx, &graph.text), errors(cx, text));
    is_better(&before, &after) || (!file.is_graph() && after.syntax() <= before.syntax())
}

/// The text after one round, and titles of fixes; `None` if there are no fixes.
fn round(tools: &Tools, graph: &GraphText, applies: Applies) -> Option<(String, Vec<String>)> {
    let options =
        LoadOptions { import_paths: tools.import_paths.clone(), gate: tools.gate.clone(), ..LoadOptions::default() };
    let loaded = load_text(&graph.path, &graph.text, &tools.registry, &options);
    let own = loaded.sources.sources().first()?.path.clone();
    let findings = by_file(&loaded.diagnostics, &loaded.sources).remove(&own)?;
    let mut world = workspace(tools);
    let file = world.open(&graph.path, graph.text.as_str());
    let cx = Cx { world: &world, file: &file };
    let is_wanted = |fix: &Fix| fix.applies <= applies && fix.applies != Applies::Choice;
    let best = |fixes: Vec<Fix>| fixes.into_iter().find(is_wanted);
    let wanted: Vec<Fix> = fixes(cx, &findings).into_iter().filter_map(best).collect();
    let (edits, titles) = joined(&wanted);
    let before = errors(cx, &graph.text);
    let text = apply(&graph.text, &edits);
    if titles.len() == 1 || is_better(&before, &errors(cx, &text)) {
        return (!titles.is_empty()).then_some((text, titles));
    }
    one_by_one(cx, &wanted, before)
}

/// The edits of all fixes that do not overlap earlier ones, and their titles.
fn joined(fixes: &[Fix]) -> (Vec<Edit>, Vec<String>) {
    let (mut edits, mut titles): (Vec<Edit>, Vec<String>) = (Vec::new(), Vec::new());
    for fix in fixes {
        let meets = |edit: &Edit| {
            edits.iter().any(|other| edit.range.start <= other.range.end && other.range.start <= edit.range.end)
        };
        if !fix.edits.iter().any(meets) {
            edits.extend(fix.edits.iter().cloned());
            titles.push(fix.title.clone());
        }
    }
    (edits, titles)
}

fn is_better(before: &Errors, after: &Errors) -> bool {
    after.syntax() < before.syntax() || (after.syntax() == before.syntax() && after.count() < before.count())
}

/// Applies fixes one after the other. Fixes that help only alone are left out.
fn one_by_one(cx: Cx<'_>, wanted: &[Fix], mut before: Errors) -> Option<(String, Vec<String>)> {
    let mut kept: Vec<Fix> = Vec::new();
    for fix in wanted {
        if cx.world.is_cancelled() {
            break;
        }
        kept.push(fix.clone());
        let after = errors(cx, &apply(&cx.file.text, &joined(&kept).0));
        if is_better(&before, &after) || kept.len() == 1 {
            before = after;
        } else {
            kept.pop();
        }
    }
    let (edits, titles) = joined(&kept);
    (!titles.is_empty()).then(|| (apply(&cx.file.text, &edits), titles))
}

/// The differences between two texts of a file, as `diff -u` prints them.
pub fn unified(name: &str, before: &str, after: &str) -> String {
    TextDiff::from_lines(before, after).unified_diff().header(name, name).to_string()
}
