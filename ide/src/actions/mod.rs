//! Code actions that an editor offers: fixes for findings, and refactorings of correct text.
mod answers;
mod assign;
mod extract;
mod fixes;
mod formula;
mod inline;
mod insert;
mod pin;
mod refactor;
mod retired;

pub use answers::{Answered, answered};
pub use assign::{add_preset, alike, assign, promote};
pub use pin::{pinned, pinned_at};

use super::diagnose::Finding;
use super::file::File;
use super::format::{is_laid_out, settled};
use super::rename::{Edit, Edits, sort};
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
}

impl Action {
    fn new(title: impl Into<String>, kind: ActionKind, file: &File, edits: Vec<Edit>) -> Self {
        let edits = Edits::from([(file.path.clone(), edits)]);
        Self { title: title.into(), kind, edits, creates: Vec::new(), mends: None }
    }
}

/// Actions for a selection and the findings in it.
pub fn actions(cx: Cx<'_>, selected: &Range<usize>, findings: &[Finding]) -> Vec<Action> {
    let at = selected.start;
    let file = cx.file.scope_at(at);
    let cx = cx.with(&file);
    let mut found = fixes::fixes(cx, findings);
    found.extend(retired::replace(cx, findings));
    found.extend(answers::newest(cx, findings));
    found.extend(fixes::missing_ports(cx, at, findings));
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

/// Applies edits that do not overlap to a text.
pub fn apply(text: &str, edits: &[Edit]) -> String {
    let mut edits: Vec<Edit> = edits.to_vec();
    sort(&mut edits);
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    for edit in edits {
        out.push_str(text.get(at..edit.range.start).unwrap_or_default());
        out.push_str(&edit.text);
        at = edit.range.end.max(at);
    }
    out.push_str(text.get(at..).unwrap_or_default());
    out
}
