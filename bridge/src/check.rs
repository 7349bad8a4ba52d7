//! All errors and warnings of a graph, each with its fixes.
use crate::{GraphText, Tools};
use serde::{Deserialize, Serialize};
use shibo_graph::{Graph, load_text};
use shibo_ide::diagnose::{self, by_file};
use shibo_ide::fixes::{Applies, Budget, fixes};
use shibo_ide::{Cx, Section, Workspace, news};
use shibo_value::diagnostics::{Code, Diagnostic, FileId, SourceMap, Span};
use std::ops::Range;
use std::path::PathBuf;

/// A graph to check.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CheckRequest {
    /// The graph.
    pub graph: GraphText,
}

/// The result of a check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checked {
    /// Errors and warnings of the graph and its imports, in the order of the text.
    pub diagnostics: Vec<Located>,
    /// The text that they are about.
    pub text: String,
    /// A sentence for people if not all fixes were tried.
    pub note: Option<String>,
}

/// An error or a warning with its place, as `check --format json` prints it. Lines and columns count from 1, columns in characters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Located {
    /// Path of the file.
    pub file: PathBuf,
    /// First line.
    pub line: usize,
    /// First column.
    pub column: usize,
    /// Last line.
    pub end_line: usize,
    /// One past the last column.
    pub end_column: usize,
    /// The class of the error.
    pub code: String,
    /// The fault and the requirement.
    pub message: String,
    /// Advice in words.
    pub help: Option<String>,
    /// Other places.
    pub related: Vec<RelatedPlace>,
    /// Fixes, best first; empty where no edit helps.
    pub fixes: Vec<Fix>,
    /// True for a warning.
    #[serde(skip)]
    pub warning: bool,
}

/// Another place that belongs to a diagnostic.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RelatedPlace {
    /// Path of the file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Note about the place.
    pub message: String,
}

/// A fix: edits that do not overlap.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fix {
    /// Title, a few words.
    pub title: String,
    /// Its certainty.
    pub applies: Applies,
    /// The edits, in the order of the text.
    pub edits: Vec<FixEdit>,
}

/// Replacement of a part of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FixEdit {
    /// Path of the file.
    pub file: PathBuf,
    /// First line.
    pub line: usize,
    /// First column.
    pub column: usize,
    /// Last line.
    pub end_line: usize,
    /// One past the last column.
    pub end_column: usize,
    /// The new text.
    pub text: String,
}

/// Checks a graph. A cancelled check is incomplete: it leaves out fixes and advice, or everything.
pub fn check(tools: &Tools, request: &CheckRequest) -> Checked {
    check_within(tools, request, &mut Budget::default())
}

/// Checks a graph, with the rest of a budget for fixes.
pub(crate) fn check_within(tools: &Tools, request: &CheckRequest, budget: &mut Budget) -> Checked {
    let GraphText { path, text } = &request.graph;
    let loaded = load_text(path, text, &tools.registry, &tools.options());
    let mut diagnostics = loaded.diagnostics;
    if let Some(graph) = loaded.graph.as_ref().filter(|_| !tools.cancel.is_cancelled()) {
        diagnostics.extend(advice(tools, graph));
    }
    let diagnostics = located_within(tools, &diagnostics, &loaded.sources, budget);
    Checked { diagnostics, text: text.clone(), note: budget.note() }
}

/// Advice about a graph without errors: untiled outputs, later versions of pinned nodes, unused nodes, hidden names in formulas.
pub fn advice(tools: &Tools, graph: &Graph) -> Vec<Diagnostic> {
    let mut found = news::advice(&tools.registry, graph);
    let Some(source) = graph.sources.sources().first() else { return found };
    let mut workspace = workspace(tools);
    let file = workspace.open(&source.path, source.text.clone());
    let at = |range: &Range<usize>| Span { file: FileId(0), start: range.start, end: range.end };
    for scope in file.scopes() {
        let cx = Cx { world: &workspace, file: &scope };
        let entries = scope.entries(Section::Nodes);
        for key in diagnose::unused(cx).into_iter().filter_map(|index| entries[index].key.as_ref()) {
            let message = format!("no output needs `{}`", key.name);
            let help = format!("leave it out, or call it `_{}` if it shall stay", key.name);
            found.push(Diagnostic::new(Code::Advice, at(&key.range), message).help(help).as_warning());
        }
        for (range, message) in diagnose::hiding(cx) {
            let warning = Diagnostic::new(Code::Advice, at(&range), message).help("give it another name");
            found.push(warning.as_warning());
        }
    }
    found
}

pub(crate) fn workspace(tools: &Tools) -> Workspace {
    let workspace = Workspace::new(tools.registry.clone(), Vec::new());
    let workspace = workspace.with_import_paths(tools.import_paths.clone()).with_gate(tools.gate.clone());
    workspace.with_cancel(tools.asked())
}

/// The places and fixes of diagnostics. Those of imports and of the command line have no fixes.
pub fn located(tools: &Tools, diagnostics: &[Diagnostic], sources: &SourceMap) -> Vec<Located> {
    located_within(tools, diagnostics, sources, &mut Budget::default())
}

/// The places of diagnostics, and as many fixes as the budget allows.
pub fn located_within(
    tools: &Tools,
    diagnostics: &[Diagnostic],
    sources: &SourceMap,
    budget: &mut Budget,
) -> Vec<Located> {
    let mut made = of_graph(tools, diagnostics, sources, budget).into_iter();
    let entry = |one: &Diagnostic| {
        let place = place(sources, one.span);
        let fixes = if is_own(one) { made.next().unwrap_or_default() } else { Vec::new() };
        let related = one.related.iter().map(|related| {
            let start = sources.position(related.span.file, related.span.start);
            let file = sources.path(related.span.file).to_owned();
            RelatedPlace { file, line: start.line, column: start.column, message: related.message.clone() }
        });
        Located {
            code: one.code.as_str().to_owned(),
            message: one.message.clone(),
            help: one.help.clone(),
            related: related.collect(),
            fixes,
            warning: one.warning,
            file: place.file,
            line: place.line,
            column: place.column,
            end_line: place.end_line,
            end_column: place.end_column,
        }
    };
    diagnostics.iter().map(entry).collect()
}

fn is_own(one: &Diagnostic) -> bool {
    one.span.file == FileId(0)
}

fn place(sources: &SourceMap, span: Span) -> FixEdit {
    let (start, end) = (sources.position(span.file, span.start), sources.position(span.file, span.end));
    FixEdit {
        file: sources.path(span.file).to_owned(),
        line: start.line,
        column: start.column,
        end_line: end.line,
        end_column: end.column,
        text: String::new(),
    }
}

/// The fixes of the diagnostics of the graph's own text.
fn of_graph(tools: &Tools, diagnostics: &[Diagnostic], sources: &SourceMap, budget: &mut Budget) -> Vec<Vec<Fix>> {
    let own: Vec<Diagnostic> = diagnostics.iter().filter(|one| is_own(one)).cloned().collect();
    let Some(source) = sources.sources().first().filter(|_| !own.is_empty()) else { return Vec::new() };
    let mut workspace = workspace(tools);
    let file = workspace.open(&source.path, source.text.clone());
    let findings = by_file(&own, sources).remove(&source.path).unwrap_or_default();
    let of = |edit: shibo_ide::rename::Edit| {
        let span = Span { file: FileId(0), start: edit.range.start, end: edit.range.end };
        FixEdit { text: edit.text, ..place(sources, span) }
    };
    let fix = |fix: shibo_ide::fixes::Fix| {
        let edits = fix.edits.into_iter().map(of).collect();
        Fix { title: fix.title, applies: fix.applies, edits }
    };
    let made = fixes(Cx { world: &workspace, file: &file }, &findings, None, budget);
    made.into_iter().map(|fixes| fixes.into_iter().map(fix).collect()).collect()
}
