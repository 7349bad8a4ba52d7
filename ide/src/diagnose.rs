//! Diagnostics of a graph: errors, warnings and hints.
use super::capture;
use super::docs;
use super::expect::Expect;
use super::file::Section;
use super::names::{Symbol, occurrences};
use super::view::{Item, Value};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_value::diagnostics::{Diagnostic, SourceMap, Span};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;
use std::path::PathBuf;

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Severity {
    /// The graph cannot be rendered.
    Error,
    /// The graph can be rendered, but is probably not as intended.
    Warning,
    /// Nothing needs fixing, see [`Finding::unneeded`] and [`Finding::deprecated`].
    Hint,
}

/// A diagnostic for a range of the text.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Finding {
    /// Its bytes.
    pub range: Range<usize>,
    /// Its severity.
    pub severity: Severity,
    /// Its code, as `check` prints it.
    pub code: String,
    /// Description of the problem.
    pub message: String,
    /// Suggested fix.
    pub help: Option<String>,
    /// Related places: file, range and message.
    pub related: Vec<(PathBuf, Range<usize>, String)>,
    /// True if the text could be removed.
    pub unneeded: bool,
    /// True if the text uses something deprecated.
    pub deprecated: bool,
}

/// Findings of one run of the checks, by file.
pub fn by_file(diagnostics: &[Diagnostic], sources: &SourceMap) -> BTreeMap<PathBuf, Vec<Finding>> {
    let path = |span: Span| sources.path(span.file).to_owned();
    let mut found: BTreeMap<PathBuf, Vec<Finding>> = BTreeMap::new();
    for one in diagnostics {
        let related = one.related.iter().map(|r| (path(r.span), r.span.start..r.span.end, r.message.clone()));
        found.entry(path(one.span)).or_default().push(Finding {
            range: one.span.start..one.span.end,
            severity: if one.warning { Severity::Warning } else { Severity::Error },
            code: one.code.as_str().to_owned(),
            message: one.message.clone(),
            help: one.help.clone(),
            related: related.collect(),
            unneeded: false,
            deprecated: false,
        });
    }
    found
}

/// Most hints of a file: damaged texts may have hundreds of thousands.
const HINTS: usize = 1000;

/// Nodes that no output needs, names that hide others in formulas, and uses of deprecated things; at most 1,000.
pub fn hints(cx: Cx<'_>) -> Vec<Finding> {
    cx.file.scopes().flat_map(|file| hints_of(cx.with(&file))).take(HINTS).collect()
}

/// Hints of one graph of a file.
fn hints_of(cx: Cx<'_>) -> Vec<Finding> {
    let mut hints = Vec::new();
    for (range, message) in hiding(cx) {
        let help = Some("give it another name".to_owned());
        hints.push(Finding { severity: Severity::Warning, help, ..hint(range, "advice", message) });
    }
    let entries = cx.file.entries(Section::Nodes);
    for index in unused(cx) {
        let Some(name) = entries[index].name() else { continue };
        let message = format!("no output needs `{name}`");
        hints.push(Finding { unneeded: true, ..hint(entries[index].range.clone(), "unused", message) });
    }
    let mut old = Deprecated { cx, hints: Vec::new() };
    walk(cx, &mut old);
    hints.extend(old.hints);
    hints
}

/// Nodes and inputs that hide the position, the canvas or a constant in a formula: the bytes of the name, and a message.
pub fn hiding(cx: Cx<'_>) -> Vec<(Range<usize>, String)> {
    capture::hiding(cx)
}

fn hint(range: Range<usize>, code: &str, message: String) -> Finding {
    Finding {
        range,
        severity: Severity::Hint,
        code: code.to_owned(),
        message,
        help: None,
        related: Vec::new(),
        unneeded: false,
        deprecated: false,
    }
}

/// Entries of `nodes` that no output needs; none if the graph has no outputs. A file does not include its local graphs.
/// Nodes whose name begins with `_` are exempt.
pub fn unused(cx: Cx<'_>) -> Vec<usize> {
    let entries = cx.file.entries(Section::Nodes);
    if cx.file.entries(Section::Outputs).is_empty() {
        return Vec::new();
    }
    let inside = |at: usize| {
        let index = entries.partition_point(|item| item.range.start <= at).checked_sub(1)?;
        (at < entries[index].range.end).then_some(index)
    };
    let mut reads: HashMap<usize, Vec<usize>> = HashMap::new();
    let mut queue = Vec::new();
    for found in occurrences(cx).into_iter().filter(|found| !found.declares) {
        let Symbol::Node(name) = &found.symbol else { continue };
        let Some(node) = cx.file.position(Section::Nodes, name) else { continue };
        match inside(found.range.start) {
            Some(reader) => reads.entry(reader).or_default().push(node),
            None => queue.push(node),
        }
    }
    let mut needed = HashSet::new();
    while let Some(node) = queue.pop() {
        if needed.insert(node) {
            queue.extend(reads.get(&node).into_iter().flatten());
        }
    }
    let is_told = |item: &Item| item.key.as_ref().is_some_and(|key| !key.name.starts_with('_'));
    (0..entries.len()).filter(|index| !needed.contains(index) && is_told(&entries[*index])).collect()
}

struct Deprecated<'a> {
    cx: Cx<'a>,
    hints: Vec<Finding>,
}

impl Deprecated<'_> {
    fn add(&mut self, range: Range<usize>, doc: &str) {
        if docs::deprecated(doc) {
            let message = crate::manual::doc::summary(doc);
            self.hints.push(Finding { deprecated: true, ..hint(range, "deprecated", message) });
        }
    }
}

impl<'a> Visit<'a> for Deprecated<'a> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        let field = docs::fields(inside).iter().find(|field| item.name() == Some(&field.name));
        if let (Some(field), Some(key)) = (field, &item.key) {
            self.add(key.range.clone(), &field.doc);
        }
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        let Some(word) = value.word().filter(|_| expect.takes_nodes()) else { return };
        if let Some(info) = self.cx.kind(self.cx.file.at(&word)) {
            self.add(word, &info.doc);
        }
    }
}
