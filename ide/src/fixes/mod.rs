//! Fixes of findings, as edits of the text.
//!
//! Each file makes the fixes of one sort of mistakes. All fixes but choices are tried before they are offered: the text with the
//! edits is checked, and a fix that leaves its finding is dropped. A few new errors are allowed where the finding hid them. Other
//! faults nearby do not matter for a fix that replaces a value or writes another notation: only errors that it makes itself count.
mod budget;
mod conflicts;
mod dialects;
mod formulas;
mod imports;
mod insertions;
mod meanings;
mod missing;
mod scan;
mod structure;
mod trial;
mod values;
mod wires;
mod words;

use super::diagnose::{Finding, Severity};
use super::expect::Expect;
use super::rename::Edit;
use super::walk::{Spot, trail};
use super::world::Cx;
use dialects::Habit;
use serde::{Deserialize, Serialize};
use shibo_graph::syntax::{Marks, Tree, marks};
use std::cell::OnceCell;
use std::ops::Range;
use trial::{Against, Trial};

pub use budget::{Aside, Budget, FINDINGS, TRIALS};
pub(crate) use missing::fields as needed_fields;
pub use trial::{Errors, counted, errors};

/// Most fixes of a finding that are not choices.
const OFFERED: usize = 3;

/// Certainty of a fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Applies {
    /// Only one meaning is possible.
    Sure,
    /// The best guess.
    Likely,
    /// One of several; never applied without a person.
    Choice,
}

/// A fix of a finding: edits of the file of the finding that do not overlap.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// Title, a few words.
    pub title: String,
    /// Its certainty.
    pub applies: Applies,
    /// The edits, in the order of the text.
    pub edits: Vec<Edit>,
}

impl Fix {
    fn new(title: impl Into<String>, applies: Applies, mut edits: Vec<Edit>) -> Self {
        super::rename::sort(&mut edits);
        Self { title: title.into(), applies, edits }
    }

    /// Replaces a range.
    fn replace(applies: Applies, range: Range<usize>, text: impl Into<String>) -> Self {
        let text = text.into();
        let shown: String = text.chars().take(60).collect();
        Self::new(format!("Change to `{}`", shown), applies, vec![Edit { range, text }])
    }
}

/// The fixes of each finding of a file, best first. Findings must be those of the file's present text. Only the first [`FINDINGS`]
/// get fixes, and only as many as the budget allows; none after a cancellation. `before` are all errors and warnings of the text, if
/// they are known.
pub fn fixes(cx: Cx<'_>, findings: &[Finding], before: Option<Errors>, budget: &mut Budget) -> Vec<Vec<Fix>> {
    let mut trial = before.map(|before| Trial::with(cx, before));
    let known = Known { text: &cx.file.text, marks: OnceCell::new(), habits: OnceCell::new() };
    let mut left = FINDINGS;
    let mut of = |finding: &Finding| {
        // The versions of a conflict are found at once.
        let enough = left > 0 && (finding.code == "conflict" || budget.search(cx.file.text.len()));
        if !enough {
            budget.end();
            return Vec::new();
        }
        left -= 1;
        let file = cx.file.scope_at(finding.range.start);
        let mut found = candidates(cx.with(&file), &known, finding, budget);
        if finding.code != "conflict" {
            found.retain(|(fix, _)| !known.in_conflict(&fix.edits));
        }
        if found.iter().all(|(fix, _)| fix.applies == Applies::Choice) {
            return found.into_iter().map(|(fix, _)| fix).collect();
        }
        offered(trial.get_or_insert_with(|| Trial::new(cx)), finding, found, budget)
    };
    let has_fixes = |finding: &Finding| {
        finding.severity != Severity::Hint && may_have_fixes(&finding.code) && !cx.world.is_cancelled()
    };
    findings.iter().map(|finding| if has_fixes(finding) { of(finding) } else { Vec::new() }).collect()
}

/// Facts about a text that its findings share.
struct Known<'t> {
    text: &'t str,
    marks: OnceCell<Vec<Marks>>,
    habits: OnceCell<Vec<Habit>>,
}

impl Known<'_> {
    /// The conflicts of the text, the last one first.
    fn marks(&self) -> &[Marks] {
        self.marks.get_or_init(|| marks(self.text))
    }

    fn habits(&self) -> &[Habit] {
        self.habits.get_or_init(|| dialects::habits(self.text))
    }

    /// Returns true if an edit touches a conflict: its marks, and the versions between them.
    fn in_conflict(&self, edits: &[Edit]) -> bool {
        let marks = self.marks();
        edits.iter().any(|edit| {
            // The last conflict that begins before the edit ends.
            let before = marks.partition_point(|marks| marks.first.start > edit.range.end);
            marks.get(before).is_some_and(|marks| edit.range.start <= marks.rest.end)
        })
    }
}

/// Returns true for the codes of findings that [`candidates`] can mend.
fn may_have_fixes(code: &str) -> bool {
    code.starts_with("unknown-")
        || matches!(
            code,
            "conflict"
                | "syntax"
                | "cycle"
                | "duplicate-key"
                | "missing-input"
                | "type-mismatch"
                | "out-of-range"
                | "bad-value"
                | "bad-name"
                | "not-finite"
                | "bad-expression"
                | "file-not-found"
        )
}

/// All fixes that a finding may have, best first, and the new errors that speak against each.
fn candidates(cx: Cx<'_>, known: &Known<'_>, finding: &Finding, budget: &mut Budget) -> Vec<(Fix, Against)> {
    if finding.range.end > cx.file.text.len() {
        return Vec::new();
    }
    let all = |fixes: Vec<Fix>| fixes.into_iter().map(|fix| (fix, Against::All)).collect::<Vec<_>>();
    let mut found = match finding.code.as_str() {
        "conflict" => return all(conflicts::fixes(cx, known.marks(), finding)),
        "syntax" => Vec::new(),
        "cycle" => return all(structure::cuts(cx, finding)),
        "duplicate-key" => return all(structure::duplicates(cx, finding)),
        "missing-input" => all(missing::fixes(cx, finding)),
        "unknown-kind" if cx.registry().is_retired(cx.file.at(&finding.range)) => {
            all(structure::successor(cx, finding))
        }
        "type-mismatch" | "out-of-range" | "bad-value" | "bad-name" | "not-finite" => {
            values::fixes(cx, finding).into_iter().map(|fix| (fix, Against::Touching)).collect()
        }
        code if code.starts_with("unknown-") || matches!(code, "bad-expression" | "file-not-found") => {
            all(words::fixes(cx, finding))
        }
        _ => return Vec::new(),
    };
    found.extend(dialects::fixes(cx, known.habits(), finding).into_iter().map(|fix| (fix, Against::Syntax)));
    match finding.code.as_str() {
        "syntax" => found.extend(all(insertions::fixes(cx, finding, budget))),
        "type-mismatch" => found.extend(all(wires::fixes(cx, finding))),
        // A name may only look unknown beside a lost bracket.
        "bad-expression" => found = all(formulas::fixes(cx, finding, budget)).into_iter().chain(found).collect(),
        _ => {}
    }
    found
}

/// Drops fixes that do not help. The best one keeps its certainty, unless a better one was dropped; the others are choices.
fn offered(trial: &mut Trial<'_>, finding: &Finding, found: Vec<(Fix, Against)>, budget: &mut Budget) -> Vec<Fix> {
    let mut tried: Vec<(usize, usize, Fix)> = Vec::new();
    for (rank, (fix, against)) in found.into_iter().enumerate() {
        if tried.iter().any(|(.., other)| other.edits == fix.edits) {
            continue;
        }
        let made = match fix.applies {
            Applies::Choice => Some(usize::MAX),
            _ => trial.made(finding, &fix.edits, against, budget),
        };
        tried.extend(made.map(|made| (made, rank, fix)));
    }
    tried.sort_by_key(|(made, rank, _)| (*made, *rank));
    let sole = tried.get(1).is_none_or(|(made, ..)| *made > 0);
    let first = tried.first().is_some_and(|(made, rank, _)| *made == 0 && (*rank == 0 || sole));
    tried.truncate(OFFERED);
    let level = |(index, (_, _, mut fix)): (usize, (usize, usize, Fix))| {
        fix.applies = match fix.applies {
            _ if index > 0 => Applies::Choice,
            Applies::Sure if !first => Applies::Likely,
            applies => applies,
        };
        fix
    };
    tried.into_iter().enumerate().map(level).collect()
}

/// The value at the start of a finding, and the values that its place takes.
fn value_at<'a>(cx: Cx<'a>, at: usize) -> Option<(Expect<'a>, &'a super::view::Value)> {
    match trail(cx, at).spot {
        Spot::Value(expect, value) => Some((expect, value)),
        _ => None,
    }
}

/// Number of syntax errors in a text.
fn mistakes(text: &str) -> usize {
    Tree::parse(text).errors().len()
}
