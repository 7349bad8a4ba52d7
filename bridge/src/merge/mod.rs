//! The three-way merge of graphs.
//!
//! Trees are merged, not lines: named things match by name and have no order, and a value is merged as a whole. The result is the
//! text of ours with the changes of theirs inserted as typed. It is checked like any graph: an error that neither side had
//! is a conflict, too.
mod bracket;
mod check;
#[cfg(test)]
mod tests;
mod tree;
mod write;

use crate::lock::{self, LOCK, Lock};
use crate::renames::{Rename, name_in, new_names, renames};
use crate::side::Side;
use crate::three::lines;
use crate::{GraphText, Tools};
use check::{Fault, differing, faults, path_of};
use serde::{Deserialize, Serialize};
use shibo_graph::syntax::{Tree, marks};
use shibo_ide::Section;
use std::collections::BTreeSet;
use std::path::PathBuf;
use tree::{Merger, Path};
use write::{Form, Pick};

/// The fewest characters of a mark.
const MARKER: usize = 7;
/// The most times that a result is checked and marked again.
const ROUNDS: usize = 8;

/// Three versions of a graph.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MergeRequest {
    /// The common version.
    pub base: String,
    /// Our version.
    pub ours: String,
    /// Their version.
    pub theirs: String,
    /// Path of the result. Imports are searched from its folder.
    pub path: PathBuf,
    /// Characters of a conflict mark, at least 7.
    pub marker_size: usize,
}

/// The result of a merge.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Merged {
    /// The text, with marks around conflicts.
    pub text: String,
    /// The conflicts, in the order of the text.
    pub conflicts: Vec<Conflict>,
    /// The reason why lines were merged instead of trees. The result needs a look even without conflicts.
    pub by_lines: Option<String>,
    /// The reason why nothing was merged: the text is that of ours, and both versions need a look.
    pub refused: Option<String>,
    /// Errors of the result that come from other files, and errors that no mark could show.
    pub notes: Vec<String>,
}

/// A place with two versions.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conflict {
    /// Names from the root to the thing.
    pub path: Vec<String>,
    /// Line of the first mark, counted from 1.
    pub line: usize,
    /// The error that the result would have, if each change alone could be taken.
    pub error: Option<String>,
}

impl Merged {
    /// Returns true if the result needs no look.
    pub fn is_clean(&self) -> bool {
        self.conflicts.is_empty() && self.by_lines.is_none() && self.refused.is_none()
    }
}

/// Merges the changes of two sides.
pub fn merge(tools: &Tools, request: &MergeRequest) -> Merged {
    let whole = |text: &str| Merged { text: text.to_owned(), ..Merged::default() };
    match request {
        MergeRequest { base, ours, theirs, .. } if theirs == base || theirs == ours => return whole(ours),
        MergeRequest { base, ours, theirs, .. } if ours == base => return whole(theirs),
        _ => {}
    }
    if request.path.file_name().is_some_and(|name| name == LOCK) {
        return locks(request).unwrap_or_else(|reason| Merged { refused: Some(reason), ..whole(&request.ours) });
    }
    let eol = if request.ours.contains("\r\n") { "\r\n" } else { "\n" };
    let typed = |text: &str| {
        let text = text.replace("\r\n", "\n");
        if eol == "\n" { text } else { text.replace('\n', eol) }
    };
    let texts = [typed(&request.base), typed(&request.ours), typed(&request.theirs)];
    let sides = texts.clone().map(|text| Side::new(tools, &GraphText { path: request.path.clone(), text }));
    let marker = request.marker_size.max(MARKER);
    trees(tools, request, sides, Form { pick: Pick::Marks, marker, eol }).unwrap_or_else(|reason| {
        let [base, ours, theirs] = texts;
        let (text, _) = lines(&base, &ours, &theirs, marker);
        Merged { conflicts: conflicts(&text, &[]), text, by_lines: Some(reason), ..Merged::default() }
    })
}

/// Merges locks. Returns the reason if a version cannot be read: its lines mean nothing by themselves, so they cannot be merged
/// either.
fn locks(request: &MergeRequest) -> Result<Merged, String> {
    let read = |side: &str, text: &str| {
        Lock::read(text).map_err(|error| format!("{side} is no lock that this program reads ({error})"))
    };
    // Two sides may add the file.
    let added = request.base.trim().is_empty();
    let base = if added { Lock::default() } else { read("the base", &request.base)? };
    let (ours, theirs) = (read("our version", &request.ours)?, read("their version", &request.theirs)?);
    Ok(Merged { text: lock::merge(&base, &ours, &theirs).written(), ..Merged::default() })
}

/// Merges trees; returns the reason if that is not possible.
fn trees(tools: &Tools, request: &MergeRequest, sides: [Side; 3], form: Form) -> Result<Merged, String> {
    for (side, name) in sides.iter().zip(["the base", "our version", "their version"]) {
        if let Some(error) = side.tree().errors().first() {
            return Err(format!("{name} cannot be read: line {}: {}", side.line(error.range.start), error.message));
        }
    }
    let mut forced = BTreeSet::new();
    let [base, ours, theirs] = with_new_names(sides, &mut forced);
    let trees = [&base, &ours, &theirs].map(|text| Tree::parse(text.as_str()));
    let all = [&trees[0], &trees[1], &trees[2]];
    let mut found: Vec<(Path, String)> = Vec::new();
    let mut unmarked = Vec::new();
    for _ in 0..ROUNDS {
        let new = new_faults(tools, request, all, &form, &forced)?;
        let count = forced.len();
        unmarked.clear();
        for fault in new.into_iter().filter(|fault| !fault.foreign) {
            match differing(&fault, all) {
                Some(path) => {
                    forced.insert(path.clone());
                    found.push((path, fault.message));
                }
                None => unmarked.push(fault.message),
            }
        }
        if forced.len() == count {
            break;
        }
    }
    let (text, _) = tree_text(all, &form, &forced)?;
    let notes = faults(tools, &request.path, &picked(all, &form, &forced, Pick::Ours)?);
    let notes = notes.into_iter().filter(|fault| fault.foreign).map(|fault| fault.message).chain(unmarked.clone());
    let by_lines = (!unmarked.is_empty()).then(|| format!("the result has an error: {}", unmarked.join("; ")));
    Ok(Merged { conflicts: conflicts(&text, &found), text, by_lines, notes: notes.collect(), refused: None })
}

/// Errors of the result that neither side has. Where the result has conflicts, errors with each choice count.
fn new_faults(
    tools: &Tools,
    request: &MergeRequest,
    trees: [&Tree; 3],
    form: &Form,
    forced: &BTreeSet<Path>,
) -> Result<Vec<Fault>, String> {
    let ours = picked(trees, form, forced, Pick::Ours)?;
    let mut new = faults(tools, &request.path, &ours);
    if new.is_empty() {
        return Ok(new);
    }
    let theirs = picked(trees, form, forced, Pick::Theirs)?;
    if theirs != ours {
        let other = faults(tools, &request.path, &theirs);
        new.retain(|fault| other.contains(fault));
    }
    for side in [trees[1], trees[2]] {
        if !new.is_empty() {
            let known = faults(tools, &request.path, side.text());
            new.retain(|fault| !known.contains(fault));
        }
    }
    Ok(new)
}

fn picked(trees: [&Tree; 3], form: &Form, forced: &BTreeSet<Path>, pick: Pick) -> Result<String, String> {
    tree_text(trees, &Form { pick, ..form.clone() }, forced).map(|(text, _)| text)
}

/// The merged text, and the things that conflict.
fn tree_text(trees: [&Tree; 3], form: &Form, forced: &BTreeSet<Path>) -> Result<(String, Vec<Path>), String> {
    let [Some(base), Some(ours), Some(theirs)] = trees.map(Tree::value) else {
        return Err("a version is empty".to_owned());
    };
    let mut merger = Merger::new(form, forced);
    let value = merger.value(Some(base), ours, theirs).ok_or("the versions have not the same form")?;
    // Text around the value: comments, and attributes.
    let around = [(trees[0], base), (trees[1], ours), (trees[2], theirs)]
        .map(|(tree, value)| (&tree.text()[..value.range().start], &tree.text()[value.range().end..]));
    let outer = |part: [&str; 3]| {
        let [base, ours, theirs] = part;
        match () {
            () if theirs == base || ours == theirs => Ok(ours.to_owned()),
            () if ours == base => Ok(theirs.to_owned()),
            // Comments that both changed stay, both of them.
            () if !part.iter().any(|text| text.contains("#!")) => {
                let split = part.map(|text| text.lines().collect::<Vec<_>>());
                let merged = bracket::merged(&split[0], &split[1], &split[2]);
                Ok(merged
                    .map_or(ours.to_owned(), |lines| lines.iter().map(|line| format!("{line}{}", form.eol)).collect()))
            }
            () => Err("both sides changed the attributes".to_owned()),
        }
    };
    let (above, below) = (outer(around.map(|(above, _)| above))?, outer(around.map(|(_, below)| below))?);
    Ok((format!("{above}{value}{below}"), merger.conflicts))
}

/// The texts of the three versions with the new names of both sides. Things whose names conflict are added to `forced`.
fn with_new_names([base, ours, theirs]: [Side; 3], forced: &mut BTreeSet<Path>) -> [String; 3] {
    let (mut our, mut their) = (renames(&base, &ours, true), renames(&base, &theirs, true));
    let mut clash: Vec<Rename> = Vec::new();
    let is_taken = |rename: &Rename, others: &[Rename], side: &Side| {
        let both = others.iter().find(|other| other.local == rename.local && other.symbol() == rename.symbol());
        match both {
            Some(other) => other.after != rename.after,
            None => declares(side, rename),
        }
    };
    let taken_ours: Vec<bool> = our.iter().map(|rename| is_taken(rename, &their, &theirs)).collect();
    let taken_theirs: Vec<bool> = their.iter().map(|rename| is_taken(rename, &our, &ours)).collect();
    for (renames, taken) in [(&mut our, taken_ours), (&mut their, taken_theirs)] {
        let mut taken = taken.into_iter();
        renames.retain(|rename| {
            let keep = taken.next() != Some(true);
            clash.extend((!keep).then(|| rename.clone()));
            keep
        });
    }
    let both = |list: &[Rename], others: &[Rename]| {
        list.iter().filter(|rename| !others.contains(rename)).cloned().collect::<Vec<_>>()
    };
    let all: Vec<Rename> = our.iter().chain(&both(&their, &our)).cloned().collect();
    let texts = [
        base.renamed(&new_names(&all)),
        ours.renamed(&new_names(&both(&their, &our))),
        theirs.renamed(&new_names(&both(&our, &their))),
    ];
    let texts = match texts {
        [Some(base), Some(ours), Some(theirs)] => [base, ours, theirs],
        _ => {
            clash.extend(all);
            [base, ours, theirs].map(|side| side.text().to_owned())
        }
    };
    for rename in clash {
        let local = rename.local.iter().flat_map(|local| ["graphs".to_owned(), local.clone()]);
        forced.insert(local.chain([rename.section.key().to_owned(), rename.after]).collect());
    }
    texts
}

/// Returns whether a version declares the new name of a thing, among the names that share a set with it.
fn declares(side: &Side, rename: &Rename) -> bool {
    let sections: &[Section] = match rename.section {
        Section::Nodes => &[Section::Nodes, Section::Inputs],
        Section::Inputs => &[Section::Nodes, Section::Inputs, Section::Params],
        Section::Params => &[Section::Params, Section::Inputs],
        Section::Imports | Section::Graphs => &[Section::Imports, Section::Graphs],
        Section::Functions => &[Section::Functions],
        Section::Presets => &[Section::Presets],
        Section::Outputs => &[Section::Outputs],
    };
    let graphs = side.graphs();
    let graph = graphs.iter().find(|(local, _)| *local == rename.local);
    graph.is_some_and(|(_, graph)| {
        let keys = |section: &Section| graph.entry(section.key()).and_then(|entry| entry.value());
        let name = |key: String| name_in(rename.section, &key) == rename.after;
        sections.iter().filter_map(keys).any(|value| value.entries().filter_map(|entry| entry.key_text()).any(name))
    })
}

/// The conflicts that are marked in a text, with the errors that caused them.
fn conflicts(text: &str, errors: &[(Path, String)]) -> Vec<Conflict> {
    let tree = Tree::parse(text);
    let mut found = Vec::new();
    for marks in marks(text).into_iter().rev() {
        let mut path = path_of(tree.covering(marks.first.start..marks.first.start));
        path.extend(first_name(&text[marks.first.end..marks.rest.end]));
        let error = errors.iter().find(|(at, _)| *at == path).map(|(_, error)| error.clone());
        found.push(Conflict { path, line: text[..marks.first.start].matches('\n').count() + 1, error });
    }
    found
}

/// The first name between the marks of a conflict.
fn first_name(between: &str) -> Option<String> {
    let lines: Vec<&str> = between.lines().filter(|line| !line.starts_with(['|', '=', '>'])).collect();
    let text = lines.join("\n");
    // Names in quotes stand in braces, names of fields in round brackets.
    [format!("({text}\n)"), format!("{{{text}\n}}")].into_iter().map(Tree::parse).find_map(|tree| {
        let first = tree.value()?.entries().next()?;
        tree.errors().is_empty().then(|| first.key_text())?
    })
}
