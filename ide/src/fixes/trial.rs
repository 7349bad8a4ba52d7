//! Checks texts with edits before fixes are offered.
use super::super::diagnose::Finding;
use super::super::rename::{Edit, apply};
use super::super::world::Cx;
use shibo_graph::load_text;
use shibo_value::diagnostics::{Code, Diagnostic, FileId};
use std::collections::BTreeMap;

/// Text that all trials of a run may read together, in bytes.
const BYTES: usize = 4_000_000;
/// Fewest trials of a run.
const FEWEST: usize = 8;
/// Most errors that a fix may bring to light.
const HIDDEN: usize = 3;

/// The errors of a text, with the number of each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Errors(BTreeMap<(Code, String), usize>);

impl Errors {
    /// The number of errors.
    pub fn count(&self) -> usize {
        self.0.values().sum()
    }

    /// The number of errors in the syntax.
    pub fn syntax(&self) -> usize {
        self.0.iter().filter(|((code, _), _)| is_syntax(*code)).map(|(_, count)| count).sum()
    }

    /// The number of errors that `before` has not.
    pub fn beyond(&self, before: &Self) -> usize {
        let more = |(said, count): (&(Code, String), &usize)| {
            count.saturating_sub(before.0.get(said).copied().unwrap_or_default())
        };
        self.0.iter().map(more).sum()
    }

    /// Returns true if there are errors of a code that `before` has not.
    fn has_new(&self, before: &Self, code: &str) -> bool {
        let more = |said: &(Code, String), count: usize| count > before.0.get(said).copied().unwrap_or_default();
        self.0.iter().any(|(said, count)| said.0.as_str() == code && more(said, *count))
    }

    fn of(&self, finding: &Finding) -> usize {
        let is_it = |(code, message): &(Code, String)| code.as_str() == finding.code && *message == finding.message;
        self.0.iter().filter(|(said, _)| is_it(said)).map(|(_, count)| count).sum()
    }
}

fn is_syntax(code: Code) -> bool {
    matches!(code, Code::Syntax | Code::Conflict)
}

/// The errors that the file would have with another text.
pub fn errors(cx: Cx<'_>, text: &str) -> Errors {
    found(cx, text, false)
}

fn found(cx: Cx<'_>, text: &str, warnings: bool) -> Errors {
    counted(&diagnostics(cx, text, warnings))
}

fn diagnostics(cx: Cx<'_>, text: &str, warnings: bool) -> Vec<Diagnostic> {
    let loaded = load_text(&cx.file.path, text, cx.registry(), &cx.world.options());
    loaded.diagnostics.into_iter().filter(|one| warnings || !one.warning).collect()
}

fn counted(diagnostics: &[Diagnostic]) -> Errors {
    let mut errors = Errors::default();
    for one in diagnostics {
        *errors.0.entry((one.code, one.message.clone())).or_default() += 1;
    }
    errors
}

/// Returns true if a diagnostic of a text touches the parts that edits have written.
fn touches(one: &Diagnostic, edits: &[Edit]) -> bool {
    let mut written = 0;
    let mut read = 0;
    one.span.file == FileId(0)
        && edits.iter().any(|edit| {
            written += edit.range.start - read;
            let start = written;
            written += edit.text.len();
            read = edit.range.end;
            one.span.start <= written && start <= one.span.end
        })
}

/// The new errors that speak against a fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Against {
    /// All of them: the fix is the best of several places or names.
    All,
    /// Those that touch its edits: the fix replaces a value, and others were only hidden.
    Touching,
    /// Those of the syntax: the fix writes the same in the notation of graphs.
    Syntax,
}

/// Trials of fixes for one text.
pub(super) struct Trial<'a> {
    cx: Cx<'a>,
    before: Errors,
    left: usize,
}

impl<'a> Trial<'a> {
    pub(super) fn new(cx: Cx<'a>) -> Self {
        let left = (BYTES / cx.file.text.len().max(1)).max(FEWEST);
        Self { cx, before: found(cx, &cx.file.text, true), left }
    }

    /// The number of errors that the edits bring to light and that speak against them; `None` if they do not help, or if they make
    /// more errors than the finding can hide.
    pub(super) fn made(&mut self, finding: &Finding, edits: &[Edit], against: Against) -> Option<usize> {
        if self.cx.world.is_cancelled() {
            return None;
        }
        self.left = self.left.checked_sub(1)?;
        let told = diagnostics(self.cx, &apply(&self.cx.file.text, edits), true);
        let after = counted(&told);
        if after.of(finding) >= self.before.of(finding).max(1) {
            return None;
        }
        let speaks = |one: &&Diagnostic| match against {
            Against::All => true,
            Against::Touching => is_syntax(one.code) || touches(one, edits),
            Against::Syntax => is_syntax(one.code),
        };
        let speaking: Vec<Diagnostic> = told.iter().filter(speaks).cloned().collect();
        let made = counted(&speaking).beyond(&self.before);
        let fewer = after.syntax() < self.before.syntax();
        let tidy = after.syntax() <= self.before.syntax();
        let again = after.has_new(&self.before, &finding.code);
        let may_hide = match finding.code.as_str() {
            "syntax" => fewer,
            // Where a section or a kind is not known, nothing in it was checked.
            "unknown-field" | "missing-input" if self.lacks_nodes() => tidy,
            "type-mismatch" => made <= HIDDEN && tidy && !again,
            "unknown-kind" | "unknown-variant" | "file-not-found" => made <= HIDDEN && tidy,
            // The value of a field is checked after its name, and a formula up to its first error.
            "unknown-field" | "bad-expression" => made <= 1 && tidy,
            _ => false,
        };
        (made == 0 || may_hide).then_some(made)
    }

    fn lacks_nodes(&self) -> bool {
        !self.cx.file.is_graph()
    }
}
