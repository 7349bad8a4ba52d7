//! Errors of a merged graph that neither side had.
use super::tree::Path;
use crate::Tools;
use crate::shape::canonical;
use shibo_graph::syntax::{Node, Tree};
use shibo_graph::{LoadOptions, load_text};
use shibo_value::diagnostics::{Code, Diagnostic, FileId, SourceMap};
use std::path;

/// An error of a graph.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    code: Code,
    pub(super) message: String,
    /// Names from the root to the place of the error, and to other places that belong to it.
    pub(super) places: Vec<Path>,
    /// True if it comes from another file: an import, or a picture that cannot be read.
    pub(super) foreign: bool,
}

/// The errors of a graph.
pub(super) fn faults(tools: &Tools, path: &path::Path, text: &str) -> Vec<Fault> {
    let options = LoadOptions { import_paths: tools.import_paths.clone(), ..LoadOptions::default() };
    let loaded = load_text(path, text, &tools.registry, &options);
    let errors: Vec<&Diagnostic> = loaded.diagnostics.iter().filter(|error| !error.warning).collect();
    if errors.is_empty() {
        return Vec::new();
    }
    let tree = Tree::parse(text);
    errors.into_iter().map(|error| fault(error, &tree, &loaded.sources)).collect()
}

fn fault(error: &Diagnostic, tree: &Tree, sources: &SourceMap) -> Fault {
    let own = |file: FileId| file == FileId(0) && !sources.sources().is_empty();
    let related = error.related.iter().map(|related| related.span);
    let spans: Vec<_> = std::iter::once(error.span).chain(related).filter(|span| own(span.file)).collect();
    let place = |at: usize| path_of(tree.covering(at..at));
    Fault {
        code: error.code,
        message: error.message.clone(),
        places: spans.iter().map(|span| place(span.start)).collect(),
        foreign: !own(error.span.file) || is_foreign(error, tree),
    }
}

/// Names from the root to a node.
pub(super) fn path_of(node: Node<'_>) -> Path {
    let mut path: Path = node.ancestors().filter_map(Node::key_text).collect();
    path.reverse();
    path
}

/// Returns whether an error of the file comes from another file. A tool that merges may not have written that file yet.
fn is_foreign(error: &Diagnostic, tree: &Tree) -> bool {
    if matches!(error.code, Code::FileNotFound | Code::BadFile) {
        return true;
    }
    let node = tree.covering(error.span.start..error.span.start);
    let path = path_of(node);
    if path.first().is_some_and(|section| section == "imports") {
        return true;
    }
    let uses = |name: &str| {
        let nodes = tree.value().and_then(|top| top.entry("nodes")?.value());
        let kind = nodes.and_then(|nodes| nodes.entry(name)?.value()?.name());
        kind.is_some_and(|kind| matches!(kind, "Use" | "Each"))
    };
    match error.code {
        // The output of another graph.
        Code::UnknownPort => {
            let read = tree.text().get(error.span.start..error.span.end).unwrap_or_default().trim_start_matches('"');
            let named = uses(read.split('.').next().unwrap_or_default().trim_end_matches('"'));
            // The place may be the part after the dot alone.
            let before = tree.text()[..error.span.start].trim_end_matches('.');
            let start = before.rfind(|c: char| !(c == '_' || c.is_ascii_alphanumeric())).map_or(0, |at| at + 1);
            named || uses(before.get(start..).unwrap_or_default())
        }
        // A value that is given to another graph.
        Code::UnknownField | Code::UnknownParam | Code::UnknownVariant | Code::MissingInput | Code::OutOfRange => {
            path.first().is_some_and(|section| section == "nodes") && path.get(1).is_some_and(|name| uses(name))
        }
        _ => false,
    }
}

/// The smallest thing at a place of an error that is not the same in all versions.
pub(super) fn differing(fault: &Fault, versions: [&Tree; 3]) -> Option<Path> {
    let at = |tree: &Tree, path: &[String]| {
        let value = path.iter().try_fold(tree.value()?, |value, name| value.entry(name)?.value())?;
        Some(canonical(value))
    };
    let differs = |path: &&[String]| {
        let [base, ours, theirs] = versions.map(|tree| at(tree, path));
        base != ours || base != theirs
    };
    let parts = fault.places.iter().flat_map(|place| (2..=place.len()).rev().map(|len| &place[..len]));
    parts.into_iter().find(differs).map(<[String]>::to_vec)
}
