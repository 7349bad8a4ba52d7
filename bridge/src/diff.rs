//! The changes from one version of a graph to another. Comments, layout and order do not count.
use crate::renames::{Rename, name_in, new_names, renames, symbol};
use crate::shape::{Fields, canonical, elements};
use crate::side::Side;
use crate::{GraphText, Tools};
use serde::{Deserialize, Serialize};
use shibo_graph::syntax::{Node, NodeKind, Tree};
use shibo_node::Role;
use similar::{Algorithm, DiffOp, TextDiff, capture_diff_slices};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Two versions of a graph.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DiffRequest {
    /// The version before; `None` for a new graph.
    pub before: Option<GraphText>,
    /// The version after; `None` for a removed graph.
    pub after: Option<GraphText>,
    /// True to list changes of comments too.
    #[serde(default)]
    pub comments: bool,
}

/// The changes of a graph.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraphDiff {
    /// The changes: by section, in the order of the text after, then the removed things.
    pub changes: Vec<Change>,
    /// Syntax errors of both versions, each as `before:LINE: message` or `after:LINE: message`. Text around them is compared as
    /// far as it can be read.
    pub unreadable: Vec<String>,
}

/// A change of one thing. A new or removed thing is one change.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// Names from the root to the thing; elements of lists have their index, counted from 0. Empty for the whole graph.
    pub path: Vec<String>,
    /// The sort of the change.
    pub change: ChangeKind,
    /// The text before: the value, or the name of a renamed thing, or the comment.
    pub before: Option<String>,
    /// The text after.
    pub after: Option<String>,
    /// The line in the version before, counted from 1.
    pub line_before: Option<usize>,
    /// The line in the version after, counted from 1.
    pub line_after: Option<usize>,
    /// The effect on pictures.
    pub effect: Effect,
    /// The unit of the value, for a parameter that has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// For a removed field of a node: the default value that counts now.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<String>,
    /// For a renamed thing: the number of references to it in the version after.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub references: Option<usize>,
}

/// Sort of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChangeKind {
    /// The value changed.
    Changed,
    /// The thing is new.
    Added,
    /// The thing is gone.
    Removed,
    /// The thing has another name and the same content.
    Renamed,
    /// A comment changed; the path is that of the thing that it belongs to.
    Comment,
}

/// Effect of a change on pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Effect {
    /// Pictures may change.
    Picture,
    /// No picture changes.
    None,
}

/// Lists the changes of a graph.
pub fn diff(tools: &Tools, request: &DiffRequest) -> GraphDiff {
    let (before, after) = match (&request.before, &request.after) {
        (Some(before), Some(after)) => (Side::new(tools, before), Side::new(tools, after)),
        (None, Some(graph)) => return whole(&Side::new(tools, graph), ChangeKind::Added),
        (Some(graph), None) => return whole(&Side::new(tools, graph), ChangeKind::Removed),
        (None, None) => return GraphDiff::default(),
    };
    let renames = renames(&before, &after, false);
    // With the new names in the version before, renamed things and their readers are equal.
    let named = new_names(&renames);
    let text = if renames.is_empty() { None } else { before.renamed(&named) };
    let renames = if text.is_some() { renames } else { Vec::new() };
    let tree = text.map_or_else(|| Tree::parse(before.text()), Tree::parse);
    let mut found = Compare {
        tools,
        before: Lines::of(&tree),
        after: Lines::of(after.tree()),
        renames: &renames,
        changes: Vec::new(),
        path: Vec::new(),
    };
    if let (Some(before), Some(now)) = (tree.value(), after.tree().value()) {
        found.values(before, now);
        found.renamed(before, now, &after);
    }
    let mut changes = found.changes;
    for change in &mut changes {
        change.unit = unit(&change.path, after.tree()).or_else(|| unit(&change.path, before.tree()));
    }
    if request.comments {
        changes.extend(comments(before.tree(), after.tree()));
    }
    let mut unreadable = unreadable("before", &before);
    unreadable.extend(self::unreadable("after", &after));
    GraphDiff { changes, unreadable }
}

/// Returns true if a text looks like a graph, that is, has nodes.
pub fn is_graph(text: &str) -> bool {
    Tree::parse(text).value().is_some_and(|top| top.entry("nodes").is_some())
}

/// The files that the imports of a graph name, as far as they are found.
pub fn imports(tools: &Tools, graph: &GraphText) -> Vec<PathBuf> {
    Side::new(tools, graph).imports()
}

/// The changed lines of a text that is not a graph, as `diff -u` prints them; empty for equal texts.
pub fn lines(before: &str, after: &str) -> String {
    TextDiff::from_lines(before, after).unified_diff().to_string()
}

fn unreadable(version: &str, side: &Side) -> Vec<String> {
    let errors = side.tree().errors().iter();
    errors.map(|error| format!("{version}:{}: {}", side.line(error.range.start), error.message)).collect()
}

/// The only change of a graph that is new or gone.
fn whole(side: &Side, change: ChangeKind) -> GraphDiff {
    let text = Some(side.text().to_owned());
    let (before, after) = if change == ChangeKind::Added { (None, text) } else { (text, None) };
    let line = |text: &Option<String>| text.as_ref().map(|_| 1);
    let (line_before, line_after) = (line(&before), line(&after));
    let change = Change {
        path: Vec::new(),
        change,
        before,
        after,
        line_before,
        line_after,
        effect: Effect::Picture,
        unit: None,
        default: None,
        references: None,
    };
    GraphDiff { changes: vec![change], unreadable: unreadable("after", side) }
}

/// Starts of the lines of a text.
struct Lines(Vec<usize>);

impl Lines {
    fn of(tree: &Tree) -> Self {
        Self(tree.text().match_indices('\n').map(|(at, _)| at).collect())
    }

    /// The line of a value, counted from 1.
    fn at(&self, node: Node<'_>) -> usize {
        self.0.partition_point(|&newline| newline < node.range().start) + 1
    }
}

struct Compare<'a> {
    tools: &'a Tools,
    before: Lines,
    after: Lines,
    renames: &'a [Rename],
    changes: Vec<Change>,
    path: Vec<String>,
}

impl Compare<'_> {
    fn values(&mut self, before: Node<'_>, after: Node<'_>) {
        if canonical(before) == canonical(after) {
            return;
        }
        if let (Some(was), Some(is)) = (Fields::readable(before), Fields::readable(after))
            && was.is_like(&is)
        {
            let removed = was.entries.iter().filter(|field| is.get(&field.name).is_none());
            for field in &is.entries {
                self.path.push(field.name.clone());
                match was.get(&field.name) {
                    Some(old) => self.values(old.value, field.value),
                    None => self.push(None, Some(field.value)),
                }
                self.path.pop();
            }
            for field in removed {
                self.path.push(field.name.clone());
                self.push(Some(field.value), None);
                if let Some(change) = self.changes.last_mut() {
                    change.default = default(self.tools, was.word, &self.path);
                }
                self.path.pop();
            }
            return;
        }
        match (elements(before), elements(after)) {
            (Some(was), Some(is)) => self.lists(&was, &is),
            _ => self.push(Some(before), Some(after)),
        }
    }

    /// Compares two lists. Elements pair by content, and those that are left by their place.
    fn lists(&mut self, was: &[Node<'_>], is: &[Node<'_>]) {
        let texts = |list: &[Node<'_>]| list.iter().map(|node| canonical(*node)).collect::<Vec<_>>();
        for op in capture_diff_slices(Algorithm::Myers, &texts(was), &texts(is)) {
            let (old, new) = (op.old_range(), op.new_range());
            if matches!(op, DiffOp::Equal { .. }) {
                continue;
            }
            let pairs = old.len().min(new.len());
            for index in 0..old.len().max(new.len()) {
                let before = was.get(old.start + index).filter(|_| index < old.len()).copied();
                let after = is.get(new.start + index).filter(|_| index < new.len()).copied();
                let place = if after.is_some() { new.start + index } else { old.start + index };
                self.path.push(place.to_string());
                match (before, after) {
                    (Some(before), Some(after)) if index < pairs => self.values(before, after),
                    _ => self.push(before, after),
                }
                self.path.pop();
            }
        }
    }

    fn push(&mut self, before: Option<Node<'_>>, after: Option<Node<'_>>) {
        let change = match (before, after) {
            (Some(_), Some(_)) => ChangeKind::Changed,
            (None, _) => ChangeKind::Added,
            _ => ChangeKind::Removed,
        };
        let text = |node: Node<'_>| node.text().to_owned();
        self.changes.push(Change {
            path: self.path.clone(),
            change,
            before: before.map(text),
            after: after.map(text),
            line_before: before.map(|node| self.before.at(node)),
            line_after: after.map(|node| self.after.at(node)),
            effect: effect(&self.path),
            unit: None,
            default: None,
            references: None,
        });
    }

    /// Adds the renamed things.
    fn renamed(&mut self, before: Node<'_>, after: Node<'_>, side: &Side) {
        let mut names = BTreeMap::new();
        for rename in self.renames {
            let found = names.entry(rename.local.clone()).or_insert_with(|| side.names(rename.local.as_deref()));
            let new = symbol(rename.section, rename.after.clone());
            let references = found.iter().filter(|found| !found.declares && found.symbol == new).count();
            let mut path: Vec<String> =
                rename.local.iter().flat_map(|local| ["graphs".to_owned(), local.clone()]).collect();
            path.push(rename.section.key().to_owned());
            let line = |lines: &Lines, graph| declaration(graph, &path, rename).map(|node| lines.at(node));
            let (line_before, line_after) = (line(&self.before, before), line(&self.after, after));
            path.push(rename.after.clone());
            self.changes.push(Change {
                path,
                change: ChangeKind::Renamed,
                before: Some(rename.before.clone()),
                after: Some(rename.after.clone()),
                line_before,
                line_after,
                effect: Effect::None,
                unit: None,
                default: None,
                references: Some(references),
            });
        }
    }
}

/// The entry of a renamed thing in its section, by its new name.
fn declaration<'t>(graph: Node<'t>, path: &[String], rename: &Rename) -> Option<Node<'t>> {
    let section = path.iter().try_fold(graph, |value, name| value.entry(name)?.value())?;
    section.entries().find(|entry| entry.key_text().is_some_and(|key| name_in(rename.section, &key) == rename.after))
}

/// The default value of a removed field of a node.
fn default(tools: &Tools, kind: Option<&str>, path: &[String]) -> Option<String> {
    let info = tools.registry.info(kind?)?;
    let field = info.fields.iter().find(|field| Some(&field.name) == path.last())?;
    match &field.role {
        Role::Param(param) if !param.required => Some(param.written.clone()),
        _ => None,
    }
}

/// Returns the effect of a change at a place.
fn effect(path: &[String]) -> Effect {
    let is = |index: usize, name: &str| path.get(index).is_some_and(|part| part == name);
    let local = if is(0, "graphs") { 2 } else { 0 };
    let told = ["doc", "range", "unit", "group"].iter().any(|name| is(local + 2, name));
    let params = is(local, "params") || is(local, "inputs");
    if params && told { Effect::None } else { Effect::Picture }
}

/// The unit of the parameter whose value is at a path.
fn unit(path: &[String], tree: &Tree) -> Option<String> {
    let path: Vec<&str> = path.iter().map(String::as_str).collect();
    let name = match path[..] {
        ["params", name, "default"] | ["presets", _, name] => name,
        _ => return None,
    };
    tree.value()?.entry("params")?.value()?.entry(name)?.value()?.body()?.entry("unit")?.value()?.string()
}

/// Changes of comments, in the order of the text.
fn comments(before: &Tree, after: &Tree) -> Vec<Change> {
    let all = |tree: &Tree| {
        let (lines, ranges) = (Lines::of(tree), tree.comments().collect::<Vec<_>>());
        let line = |at: usize| lines.0.partition_point(|&newline| newline < at) + 1;
        let found = ranges.into_iter().map(|range| {
            (tree.text()[range.clone()].trim_end().to_owned(), line(range.start), owner(tree, range.start))
        });
        found.collect::<Vec<_>>()
    };
    let (was, is) = (all(before), all(after));
    let texts = |list: &[(String, usize, Vec<String>)]| list.iter().map(|(text, ..)| text.clone()).collect::<Vec<_>>();
    let mut changes = Vec::new();
    for op in capture_diff_slices(Algorithm::Myers, &texts(&was), &texts(&is)) {
        let (old, new) = (op.old_range(), op.new_range());
        if matches!(op, DiffOp::Equal { .. }) {
            continue;
        }
        for index in 0..old.len().max(new.len()) {
            let old = was.get(old.start + index).filter(|_| index < old.len());
            let new = is.get(new.start + index).filter(|_| index < new.len());
            changes.push(Change {
                path: new.or(old).map(|(.., path)| path.clone()).unwrap_or_default(),
                change: ChangeKind::Comment,
                before: old.map(|(text, ..)| text.clone()),
                after: new.map(|(text, ..)| text.clone()),
                line_before: old.map(|(_, line, _)| *line),
                line_after: new.map(|(_, line, _)| *line),
                effect: Effect::None,
                unit: None,
                default: None,
                references: None,
            });
        }
    }
    changes
}

/// The path of the thing that a comment belongs to: the thing before it on its line, or else the thing below it.
fn owner(tree: &Tree, at: usize) -> Vec<String> {
    let line = tree.text()[..at].rfind('\n').map_or(0, |newline| newline + 1);
    let around = tree.covering(at..at);
    let around = around.ancestors().find(|node| node.kind() != NodeKind::Entry).unwrap_or(around);
    let beside = around.entries().filter(|entry| (line..at).contains(&entry.range().start)).last();
    let thing = beside.or_else(|| around.entries().find(|entry| entry.range().start > at));
    let mut path: Vec<String> = thing.unwrap_or(around).ancestors().filter_map(Node::key_text).collect();
    path.reverse();
    path
}
