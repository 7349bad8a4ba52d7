//! Advice about graphs without errors. The language server and `shibo check` show the same. Source: LASTING §1, *Commands*.
use super::actions::{MIGRATE, is_held, pinned_at};
use super::file::{File, Section};
use shibo_graph::{Graph, GraphNode};
use shibo_node::changes::{Change, Look, Thing};
use shibo_node::registry::Registry;
use shibo_value::diagnostics::{Code, Diagnostic, FileId, Span};

/// All advice that needs the whole graph: about untiled outputs and other things of the picture, and about later versions.
pub fn advice(registry: &Registry, graph: &Graph) -> Vec<Diagnostic> {
    let mut found = graph.advice();
    found.extend(news(registry, graph));
    found
}

/// Advice for a pinned graph: nodes that are computed in an earlier version, and changes of at most 1/255, which count for
/// pinned graphs too. At most one for each change; none for versions that the pins hold.
fn news(registry: &Registry, graph: &Graph) -> Vec<Diagnostic> {
    let Some(source) = graph.sources.sources().first() else { return Vec::new() };
    let Some(pins) = pinned_at(&source.text) else { return Vec::new() };
    let file = File::new(&source.path, source.text.clone());
    let is_free = |change: &&Change| !matches!(change.thing(), Thing::Kind(kind) if is_held(&file, kind));
    registry.changes().since(pins).filter(is_free).filter_map(|change| one(graph, &file, change)).collect()
}

/// The place of a node. A node of a shipped graph has the place of the node that uses the graph.
fn place(graph: &Graph, file: &File, node: &GraphNode) -> Span {
    let head = node.name.split('/').next().unwrap_or_default();
    let user = file.entry(Section::Nodes, head).and_then(|item| item.value.as_ref()).and_then(|value| value.word());
    match user.filter(|_| graph.sources.path(node.span.file).starts_with("shibo:")) {
        Some(word) => Span { file: FileId(0), start: word.start, end: word.end },
        None => node.span,
    }
}

/// The advice about one change.
fn one(graph: &Graph, file: &File, change: &Change) -> Option<Diagnostic> {
    let (number, version, what) = (change.change, change.version, &change.what);
    if change.look == Look::Roundings {
        let thing = match change.thing() {
            Thing::Kind(kind) => format!("`{kind}` differs"),
            Thing::Graph(name) => format!("`shibo:{}` differs", name.rsplit('/').next().unwrap_or(name)),
            Thing::All => "all pictures differ".to_owned(),
        };
        let node = graph.altered_by(change).next()?;
        let message = format!("{thing} by at most 1 of 255 since change {number}, in spite of the pin: {what}");
        let advice = Diagnostic::new(Code::Advice, place(graph, file, node), message);
        return Some(advice.help("`shibo pin FILE` takes the newest change").as_warning());
    }
    let Thing::Kind(kind) = change.thing() else { return None };
    let node = graph.kept_from(change).next()?;
    let own = node.node.version();
    let message = format!("the pin keeps `{kind}` at version {own}; version {version}: {what}");
    Some(Diagnostic::new(Code::Advice, place(graph, file, node), message).help(MIGRATE).as_warning())
}
