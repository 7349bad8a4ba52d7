//! Checks texts with edits before fixes are offered.
use super::super::diagnose::Finding;
use super::super::rename::{Edit, apply};
use super::super::world::Cx;
use super::budget::Budget;
use shibo_graph::{GRAPH_FILE, LoadOptions, NO_NODES, load_text};
use shibo_value::diagnostics::{Code, Diagnostic, FileId};
use std::collections::BTreeMap;
use std::ops::Range;

/// Most trials whose results are kept.
const KEPT: usize = 16;
/// Most errors that a fix may bring to light.
const HIDDEN: usize = 3;

/// The errors of a text, with the number of each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Errors(BTreeMap<(Code, String), usize>);

/// The number of stages of a check, see [`stage`].
const STAGES: usize = 7;
/// The number of stages whose errors hide a whole part of the text each: a bracket, a section, an import, or a node.
const WHOLE: usize = 3;

/// The stage at which a check finds an error. An error hides those of later stages behind it: the fields of a node of an unknown kind
/// are not checked, nor the value of an unknown field, nor the type of a wire from an unknown node.
fn stage(code: Code, message: &str) -> usize {
    match code {
        code if is_syntax(code) => 0,
        Code::MissingInput if message == NO_NODES => 1,
        Code::TypeMismatch | Code::UnknownField if message.starts_with(GRAPH_FILE) => 1,
        Code::UnknownKind
        | Code::UnknownVersion
        | Code::ChangedKind
        | Code::FileNotFound
        | Code::BadFile
        | Code::Outside
        | Code::TooLarge
        | Code::TooDeep => 2,
        Code::UnknownField => 3,
        Code::BadExpression => 4,
        Code::UnknownNode | Code::UnknownPort | Code::UnknownVariant | Code::UnknownParam => 5,
        _ => 6,
    }
}

impl Errors {
    /// Returns true if a text with these errors is better than one with the errors `before`: at the first stage of the check where
    /// the numbers differ, it has fewer. The number of all errors may only grow where a whole part of the text was hidden.
    pub fn is_better_than(&self, before: &Self) -> bool {
        let (new, old) = (self.stages(), before.stages());
        let first = (0..STAGES).find(|stage| new[*stage] != old[*stage]);
        first.is_some_and(|stage| new[stage] < old[stage] && (stage < WHOLE || self.count() <= before.count()))
    }

    /// The number of errors that are gone at the first stage where the numbers differ from those of `before`.
    pub fn solved(&self, before: &Self) -> usize {
        let mut stages = before.stages().into_iter().zip(self.stages());
        stages.find(|(old, new)| old != new).map_or(0, |(old, new)| old.saturating_sub(new))
    }

    /// The numbers of errors by stage.
    fn stages(&self) -> [usize; STAGES] {
        let mut stages = [0; STAGES];
        for ((code, message), count) in &self.0 {
            stages[stage(*code, message)] += count;
        }
        stages
    }

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

/// The errors that the file would have with another text; `None` if the budget does not allow the check, or after a cancellation.
/// `likely` is the number of errors that the text may have.
pub fn errors(cx: Cx<'_>, text: &str, likely: usize, budget: &mut Budget) -> Option<Errors> {
    let enough = !cx.world.is_cancelled() && budget.check(text.len(), likely);
    let found = enough.then(|| counted(diagnostics(cx, text).iter().filter(|one| !one.warning)));
    found.filter(|_| !cx.world.is_cancelled())
}

/// The errors and warnings of the file with another text. Their help is brief.
fn diagnostics(cx: Cx<'_>, text: &str) -> Vec<Diagnostic> {
    let options = LoadOptions { brief: true, ..cx.world.options() };
    load_text(&cx.file.path, text, cx.registry(), &options).diagnostics
}

/// Counts diagnostics.
pub fn counted<'d>(diagnostics: impl IntoIterator<Item = &'d Diagnostic>) -> Errors {
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

/// Returns true if a diagnostic is about a part of a text.
fn is_within(one: &Diagnostic, part: &Range<usize>) -> bool {
    one.span.file == FileId(0) && part.start <= one.span.start && one.span.end <= part.end
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
    /// The errors and warnings of the text.
    before: Errors,
    /// The last edits that were tried, with the errors and warnings after them: several findings may have one fix.
    told: Vec<(Vec<Edit>, Vec<Diagnostic>)>,
}

impl<'a> Trial<'a> {
    pub(super) fn new(cx: Cx<'a>) -> Self {
        Self::with(cx, counted(&diagnostics(cx, &cx.file.text)))
    }

    /// Trials of a text whose errors and warnings are known.
    pub(super) fn with(cx: Cx<'a>, before: Errors) -> Self {
        Self { cx, before, told: Vec::new() }
    }

    /// The number of errors that the edits bring to light and that speak against them; `None` if they do not help, or if they make
    /// more errors than the finding can hide.
    pub(super) fn made(
        &mut self,
        finding: &Finding,
        edits: &[Edit],
        against: Against,
        budget: &mut Budget,
    ) -> Option<usize> {
        let known = self.told.iter().position(|(tried, _)| tried == edits);
        if known.is_none() {
            if self.cx.world.is_cancelled() || !budget.check(self.cx.file.text.len(), self.before.count()) {
                return None;
            }
            let told = diagnostics(self.cx, &apply(&self.cx.file.text, edits));
            if self.cx.world.is_cancelled() {
                return None;
            }
            self.told.drain(..(self.told.len() + 1).saturating_sub(KEPT));
            self.told.push((edits.to_vec(), told));
        }
        let (_, told) = self.told.get(known.unwrap_or(self.told.len() - 1))?;
        let after = counted(told);
        if after.of(finding) >= self.before.of(finding).max(1) {
            return None;
        }
        let speaks = |one: &&Diagnostic| match against {
            Against::All => true,
            Against::Touching => is_syntax(one.code) || touches(one, edits),
            Against::Syntax => is_syntax(one.code),
        };
        let made = counted(told.iter().filter(speaks)).beyond(&self.before);
        let fewer = after.syntax() < self.before.syntax();
        let tidy = after.syntax() <= self.before.syntax();
        let again = after.has_new(&self.before, &finding.code);
        let may_hide = match finding.code.as_str() {
            "syntax" => fewer,
            // Where a section or a kind is not known, nothing in it was checked.
            "unknown-field" | "missing-input" if self.lacks_nodes() => tidy,
            "type-mismatch" => made <= HIDDEN && tidy && !again,
            // Nothing in the node was checked.
            "unknown-kind" => {
                let node = self.node(finding, edits);
                let is_outside = |one: &&Diagnostic| !is_within(one, &node);
                counted(told.iter().filter(speaks).filter(is_outside)).beyond(&self.before) <= HIDDEN && tidy
            }
            "unknown-variant" | "file-not-found" => made <= HIDDEN && tidy,
            // The value of a field is checked after its name, and a formula up to its first error.
            "unknown-field" | "bad-expression" => made <= 1 && tidy,
            _ => false,
        };
        (made == 0 || may_hide).then_some(made)
    }

    /// The bytes of the node of a finding in the text with edits inside of the node.
    fn node(&self, finding: &Finding, edits: &[Edit]) -> Range<usize> {
        let node = self.cx.file.tree.covering(finding.range.clone()).range();
        let (added, removed) = edits.iter().fold((0, 0), |(added, removed), edit| {
            let is_inside = node.start <= edit.range.start && edit.range.end <= node.end;
            let inside = usize::from(is_inside);
            (added + inside * edit.text.len(), removed + inside * edit.range.len())
        });
        node.start..(node.end + added).saturating_sub(removed)
    }

    fn lacks_nodes(&self) -> bool {
        !self.cx.file.is_graph()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::diagnostics::Span;

    fn of(codes: &[(Code, &str)]) -> Errors {
        let span = Span { file: FileId(0), start: 0, end: 0 };
        let found: Vec<Diagnostic> =
            codes.iter().map(|(code, message)| Diagnostic::new(*code, span, (*message).to_owned())).collect();
        counted(&found)
    }

    fn errors(codes: &[Code]) -> Errors {
        of(&codes.iter().map(|code| (*code, "")).collect::<Vec<_>>())
    }

    #[test]
    fn counts_early_stages_first() {
        use Code::{BadExpression, Cycle, MissingInput, Syntax, TypeMismatch, UnknownField, UnknownKind, UnknownNode};
        let better: [(&[Code], &[Code]); 8] = [
            (&[Syntax], &[]),
            (&[Syntax], &[UnknownKind, UnknownField, UnknownField]),
            (&[Syntax, Syntax], &[Syntax, UnknownKind, Cycle]),
            (&[UnknownKind], &[UnknownField, UnknownField, UnknownField, UnknownField, MissingInput]),
            (&[UnknownField], &[BadExpression]),
            (&[BadExpression], &[UnknownNode]),
            (&[UnknownNode], &[TypeMismatch]),
            (&[Cycle, TypeMismatch], &[Cycle]),
        ];
        for (before, after) in better {
            let (before, after) = (errors(before), errors(after));
            assert!(after.is_better_than(&before) && !before.is_better_than(&after), "{before:?} {after:?}");
        }
        // An error that is not hidden is not made, and the number of errors grows only where much was hidden.
        let not_better: [(&[Code], &[Code]); 4] = [
            (&[MissingInput], &[Cycle]),
            (&[TypeMismatch], &[Syntax]),
            (&[UnknownField], &[TypeMismatch, TypeMismatch]),
            (&[UnknownKind], &[UnknownKind]),
        ];
        for (before, after) in not_better {
            assert!(!errors(after).is_better_than(&errors(before)), "{before:?} {after:?}");
        }
        let hidden = errors(&[UnknownKind, UnknownKind, UnknownField]);
        assert!(hidden.is_better_than(&of(&[(MissingInput, NO_NODES)])));
        let section = format!("{GRAPH_FILE} has no field `parms`");
        assert!(hidden.is_better_than(&of(&[(UnknownField, section.as_str())])));
        assert_eq!(errors(&[UnknownKind, Cycle, Cycle]).solved(&errors(&[UnknownKind, UnknownKind, UnknownKind])), 2);
        assert_eq!(errors(&[Syntax]).solved(&errors(&[Cycle])), 0);
    }
}
