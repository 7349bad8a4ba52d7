//! Changes that an editor offers at a place: fixes for what is wrong, and other forms of what is right.
mod assign;
mod extract;
mod fixes;
mod inline;
mod insert;
mod refactor;

pub(crate) use assign::{add_preset, alike, assign, promote};

use super::diagnose::Finding;
use super::file::File;
use super::rename::{Edit, Edits, sort};
use super::world::Cx;
use std::ops::Range;
use std::path::PathBuf;

/// What sort of change it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ActionKind {
    /// It mends something that is reported.
    Fix,
    /// It moves something into a place of its own.
    Extract,
    /// It puts something where it is used.
    Inline,
    /// It writes the same in another way.
    Rewrite,
    /// It tidies the whole file.
    Tidy,
}

/// A change that is offered.
#[derive(Clone, Debug)]
pub(crate) struct Action {
    /// What it does, in a few words.
    pub(crate) title: String,
    /// What sort of change it is.
    pub(crate) kind: ActionKind,
    /// What is changed.
    pub(crate) edits: Edits,
    /// Files that are made first, with their texts.
    pub(crate) creates: Vec<(PathBuf, String)>,
    /// Which of the findings it mends.
    pub(crate) mends: Option<usize>,
}

impl Action {
    fn new(title: impl Into<String>, kind: ActionKind, file: &File, edits: Vec<Edit>) -> Self {
        let edits = Edits::from([(file.path.clone(), edits)]);
        Self { title: title.into(), kind, edits, creates: Vec::new(), mends: None }
    }
}

/// What is offered for a selection, and for what was found there.
pub(crate) fn actions(cx: Cx<'_>, selected: &Range<usize>, findings: &[Finding]) -> Vec<Action> {
    let mut found = fixes::fixes(cx, findings);
    let at = selected.start;
    found.extend(fixes::missing_ports(cx, at, findings));
    found.extend(refactor::name_literal(cx, at));
    found.extend(refactor::relative_path(cx, at));
    found.extend(extract::extract(cx, selected));
    found.extend(inline::inline(cx, at));
    found.extend(refactor::remove_unused(cx, findings));
    found.extend(refactor::sort_presets(cx, at));
    found
}

/// A text with edits applied. None of them overlap.
pub(crate) fn apply(text: &str, edits: &[Edit]) -> String {
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
