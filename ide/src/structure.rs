//! Structure of a file: outline, folding ranges, selection ranges, and links.
use super::expect::Expect;
use super::file::{File, Section};
use super::formula::FormulaText;
use super::names::{Symbol, occurrences};
use super::types::Types;
use super::view::{Item, Value, plain};
use super::walk::trail;
use super::world::{Cx, is_use};
use shibo_value::Accepts;
use std::ops::Range;
use std::path::PathBuf;

/// Most names of one section in an outline, and most that get lenses: damaged texts may have tens of thousands.
pub(crate) const LISTED: usize = 4000;

/// Most parts of a formula around a position: a long sum has one for each sign, and editors read the ranges by recursion.
const PARTS: usize = 100;

/// An entry of the outline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Name.
    pub name: String,
    /// Kind or type, a few words.
    pub detail: String,
    /// Section of the entry; `None` for a section itself.
    pub section: Option<Section>,
    /// True if it uses another graph.
    pub uses: bool,
    /// Range of the whole entry.
    pub range: Range<usize>,
    /// Range of its name.
    pub name_range: Range<usize>,
    /// Entries inside it.
    pub children: Vec<Entry>,
}

/// The outline of a file.
pub fn outline(cx: Cx<'_>) -> Vec<Entry> {
    let file = cx.file.whole();
    let locals: Vec<File> = file.scopes().skip(1).collect();
    let mut all = sections(cx.with(&file));
    if let Some(graphs) = all.iter_mut().find(|entry| entry.name == Section::Graphs.key()) {
        // A local graph has sections of its own.
        for entry in &mut graphs.children {
            let own = |local: &&File| local.value().is_some_and(|value| entry.range.end == value.range.end);
            entry.children = locals.iter().find(own).map_or(Vec::new(), |local| sections(cx.with(local)));
        }
    }
    all
}

/// The sections of a graph with their entries.
fn sections(cx: Cx<'_>) -> Vec<Entry> {
    let types = Types::new(cx);
    let Some(body) = cx.file.body() else { return Vec::new() };
    let entry = |item: &Item| {
        let key = item.key.as_ref()?;
        let section = Section::ALL.into_iter().find(|section| section.key() == key.name);
        let inner = item.value.as_ref().and_then(Value::body);
        let children = match (section, inner) {
            (Some(section), Some(inner)) => {
                inner.items.iter().filter_map(|item| child(cx, &types, section, item)).take(LISTED).collect()
            }
            _ => Vec::new(),
        };
        Some(Entry {
            name: key.name.clone(),
            detail: String::new(),
            section: None,
            uses: false,
            range: item.range.clone(),
            name_range: key.range.clone(),
            children,
        })
    };
    body.items.iter().filter_map(entry).collect()
}

/// An entry of a section.
pub(crate) fn child(cx: Cx<'_>, types: &Types<'_>, section: Section, item: &Item) -> Option<Entry> {
    let key = item.key.as_ref()?;
    let head = cx.file.head(item).unwrap_or_default();
    let detail = match section {
        Section::Nodes => {
            let ty = types.ports(&key.name).first().and_then(|port| port.ty);
            let what = if head.is_empty() { "formula" } else { head };
            ty.map_or(what.to_owned(), |ty| format!("{what} → {}", Accepts::name(ty)))
        }
        Section::Params | Section::Inputs => head.to_owned(),
        _ => {
            let value = item.value.as_ref();
            value.and_then(Value::text).unwrap_or(head).to_owned()
        }
    };
    Some(Entry {
        name: key.name.clone(),
        detail,
        section: Some(section),
        uses: is_use(head),
        range: item.range.clone(),
        name_range: key.range.clone(),
        children: Vec::new(),
    })
}

/// Folding ranges, each with whether it is a comment.
pub fn folds(cx: Cx<'_>) -> Vec<(Range<usize>, bool)> {
    let text = &cx.file.text;
    let mut folds = Vec::new();
    let whole = cx.file.whole();
    if let Some(root) = whole.value() {
        brackets(text, root, &mut folds);
    }
    comments(cx, &mut folds);
    for file in whole.scopes() {
        if let Some(nodes) = file.section(Section::Nodes) {
            groups(text, &nodes.inside(), &nodes.items, &mut folds);
        }
    }
    folds.sort_by_key(|(range, _)| (range.start, range.end));
    folds.dedup();
    folds
}

fn brackets(text: &str, value: &Value, folds: &mut Vec<(Range<usize>, bool)>) {
    let Some(body) = value.body() else { return };
    if text[body.range.clone()].contains('\n') {
        folds.push((body.range.clone(), false));
    }
    for inner in body.items.iter().filter_map(|item| item.value.as_ref()) {
        brackets(text, inner, folds);
    }
}

/// Folds of consecutive whole-line comments.
fn comments(cx: Cx<'_>, folds: &mut Vec<(Range<usize>, bool)>) {
    let text = &cx.file.text;
    let mut run: Option<Range<usize>> = None;
    // The start of the line, and the end of the part whose lines are known.
    let (mut line, mut known) = (0, 0);
    for comment in cx.file.tree.comments() {
        line = text[known..comment.start].rfind('\n').map_or(line, |i| known + i + 1);
        known = comment.start;
        let alone = text[line..comment.start].trim().is_empty();
        match &mut run {
            Some(run) if alone && text[run.end..comment.start].matches('\n').count() == 1 => run.end = comment.end,
            _ => {
                let done = std::mem::replace(&mut run, alone.then_some(comment));
                folds.extend(done.map(|run| (run, true)));
            }
        }
    }
    folds.extend(run.map(|run| (run, true)));
    folds.retain(|(range, _)| text[range.clone()].contains('\n'));
}

/// Folds of nodes below a comment, up to the next comment that follows a blank line or a node.
fn groups(text: &str, inside: &Range<usize>, items: &[Item], folds: &mut Vec<(Range<usize>, bool)>) {
    let in_item = |at: usize| {
        let index = items.partition_point(|item| item.range.start <= at).checked_sub(1);
        index.is_some_and(|index| at < items[index].range.end)
    };
    let mut heads: Vec<usize> = Vec::new();
    let mut before_comment = true;
    for (start, line) in lines_of(text).filter(|(start, _)| inside.contains(start)) {
        let comment = line.trim_start().starts_with("//") && !in_item(start);
        if comment && before_comment {
            heads.push(start);
        }
        before_comment = !comment;
    }
    for (i, head) in heads.iter().enumerate() {
        let end = heads.get(i + 1).copied().unwrap_or(inside.end);
        let last = items.partition_point(|item| item.range.end <= end).checked_sub(1).map(|last| &items[last]);
        if let Some(last) = last.filter(|item| item.range.start > *head) {
            folds.push((*head..last.range.end, false));
        }
    }
}

fn lines_of(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut at = 0;
    text.split_inclusive('\n').map(move |line| {
        let start = at;
        at += line.len();
        (start, line)
    })
}

/// Selection ranges around a position, the smallest first.
pub fn selections(cx: Cx<'_>, at: usize) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    let text = &cx.file.text;
    let part = |c: char| c == '_' || c.is_alphanumeric();
    if let (Some(before), Some(after)) = (text.get(..at), text.get(at..)) {
        let start = before.trim_end_matches(part).len();
        found.push(start..at + after.find(|c: char| !part(c)).unwrap_or(after.len()));
    }
    let file = cx.file.whole();
    let inner = file.scope_at(at);
    // A position in a local graph has the brackets of the graph around it, and those of the file around these.
    let trail = trail(cx.with(&inner), at);
    if let super::walk::Spot::Value(expect, value) = trail.spot {
        found.extend(parts(cx.with(&inner), expect, value, at));
        // A text that is still being typed has no closing quote.
        let inner = value.range.start + 1..value.range.end.saturating_sub(1);
        if let Some(says) = value.text() {
            let inner = plain(text, &value.range, says).unwrap_or(inner);
            found.extend(Some(inner).filter(|inner| text.get(inner.clone()).is_some()));
        }
        found.push(value.range.clone());
    }
    let outer = super::walk::trail(cx.with(&file), at);
    let around = outer.levels.iter().filter(|_| inner.local_name().is_some());
    for level in trail.levels.iter().rev().chain(around.rev()) {
        if let Some(item) = level.item {
            found.extend(item.key.as_ref().filter(|key| at <= key.range.end).map(|key| key.range.clone()));
            found.push(item.range.clone());
        }
        found.push(level.body.inside());
        found.push(level.body.range.clone());
        found.push(level.value.range.clone());
    }
    found.push(0..text.len());
    // Keeps only ranges that contain the previous one.
    let mut nested: Vec<Range<usize>> = Vec::new();
    for range in found {
        let fits =
            nested.last().is_none_or(|last| range.start <= last.start && last.end <= range.end && range != *last);
        if fits && range.start <= at && at <= range.end && !range.is_empty() {
            nested.push(range);
        }
    }
    nested
}

/// Ranges of the parts of a formula around a position.
fn parts<'a>(cx: Cx<'a>, expect: Expect<'a>, value: &'a Value, at: usize) -> Vec<Range<usize>> {
    let Some(text) = FormulaText::of(cx, expect, value) else { return Vec::new() };
    let Some(offset) = text.offset(at) else { return Vec::new() };
    let formula = text.parse();
    let around = formula.parts().iter().filter(|part| part.range.start <= offset && offset <= part.range.end);
    // Each part comes after its own parts, so these are the smallest.
    around.take(PARTS).filter_map(|part| text.in_file(&part.range)).collect()
}

/// Links from file paths to their files.
pub fn links(cx: Cx<'_>) -> Vec<(Range<usize>, PathBuf)> {
    let target = |symbol: &Symbol| match symbol {
        Symbol::Graph(name) => cx.world.import(&cx.file.path, name),
        Symbol::File(name) => Some(cx.file.folder().join(name)).filter(|path| path.is_file()),
        _ => None,
    };
    let all: Vec<_> = cx.file.scopes().flat_map(|file| occurrences(cx.with(&file))).collect();
    let found = all.into_iter().filter_map(|one| Some((one.range.clone(), target(&one.symbol)?)));
    found.filter(|(_, path)| !path.to_string_lossy().starts_with("shibo:")).collect()
}
