//! Code actions that an editor offers: fixes for findings, and refactorings of correct text.
mod answers;
mod assign;
mod extract;
mod formula;
mod inline;
mod keep;
mod pin;
mod refactor;
mod retired;

pub use super::rename::apply;
pub use answers::{Answered, MIGRATE, answered};
pub use assign::{add_preset, alike, assign, promote};
pub use keep::{driven, put_preset};
pub use pin::{is_held, pinned, pinned_at};

use super::diagnose::Finding;
use super::file::File;
use super::fixes::{Applies, Budget, fixes, needed_fields};
use super::format::{is_laid_out, settled};
use super::rename::{Edit, Edits};
use super::world::Cx;
use std::ops::Range;
use std::path::PathBuf;

/// The largest text in bytes whose layout actions keep; larger ones would delay the editor.
const LARGEST_LAID_OUT: usize = 200_000;

/// Kind of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActionKind {
    /// Fixes a finding.
    Fix,
    /// Moves text to a new file or entry.
    Extract,
    /// Replaces a reference by its definition.
    Inline,
    /// Writes the same thing in another way.
    Rewrite,
    /// Tidies the whole file.
    Tidy,
}

/// A code action.
#[derive(Clone, Debug)]
pub struct Action {
    /// Title, a few words.
    pub title: String,
    /// Kind of the action.
    pub kind: ActionKind,
    /// Edits by file.
    pub edits: Edits,
    /// Files to create first, with their texts.
    pub creates: Vec<(PathBuf, String)>,
    /// Index of the finding that it fixes.
    pub mends: Option<usize>,
    /// True for a fix that is no choice among several.
    pub is_preferred: bool,
}

impl Action {
    fn new(title: impl Into<String>, kind: ActionKind, file: &File, edits: Vec<Edit>) -> Self {
        let edits = Edits::from([(file.path.clone(), edits)]);
        Self {
            title: title.into(),
            kind,
            edits,
            creates: Vec::new(),
            mends: None,
            is_preferred: kind == ActionKind::Fix,
        }
    }
}

/// Actions for a selection and the findings in it.
pub fn actions(cx: Cx<'_>, selected: &Range<usize>, findings: &[Finding]) -> Vec<Action> {
    let at = selected.start;
    let (whole, file) = (cx, cx.file.scope_at(at));
    let cx = cx.with(&file);
    let mut found = mending(whole, findings);
    found.extend(answers::newest(cx, findings));
    found.extend(retired::replace_all(cx, findings));
    found.extend(required(cx, at, findings));
    found.extend(refactor::name_literal(cx, at));
    found.extend(refactor::relative_path(cx, at));
    found.extend(extract::extract(cx, selected));
    found.extend(formula::name_part(cx, selected));
    found.extend(formula::put_in_place(cx, at));
    found.extend(inline::inline(cx, at));
    found.extend(refactor::remove_unused(cx, findings));
    found.extend(refactor::sort_presets(cx, at));
    keep_layout(&file, &mut found);
    found
}

/// The fixes of findings.
fn mending(cx: Cx<'_>, findings: &[Finding]) -> Vec<Action> {
    let mut found = Vec::new();
    for (index, fixes) in fixes(cx, findings, None, &mut Budget::default()).into_iter().enumerate() {
        for fix in fixes {
            let action = Action::new(fix.title, ActionKind::Fix, cx.file, fix.edits);
            let is_preferred = fix.applies != Applies::Choice;
            found.push(Action { mends: Some(index), is_preferred, ..action });
        }
    }
    found
}

/// Adds what the node at the cursor needs, unless a finding has that fix.
fn required(cx: Cx<'_>, at: usize, findings: &[Finding]) -> Option<Action> {
    if findings.iter().any(|finding| finding.code == "missing-input") {
        return None;
    }
    let fix = needed_fields(cx, at)?;
    Some(Action::new(fix.title, ActionKind::Fix, cx.file, fix.edits))
}

/// Lays out what actions write, if the file is laid out.
fn keep_layout(file: &File, actions: &mut [Action]) {
    if actions.is_empty() || file.text.len() > LARGEST_LAID_OUT || !is_laid_out(&file.text) {
        return;
    }
    for action in actions {
        if let Some(edits) = action.edits.get_mut(&file.path) {
            let edited = apply(&file.text, edits);
            if let Some(edit) = settled(&file.text, &edited) {
                *edits = vec![edit];
            }
        }
        for (_, text) in &mut action.creates {
            if let Ok(formatted) = shibo_graph::syntax::format(text) {
                *text = formatted;
            }
        }
    }
}
