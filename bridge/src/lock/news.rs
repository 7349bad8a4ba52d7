//! Advice about later versions of the nodes of a pinned graph. Source: LASTING §1, *Commands*.
use shibo_graph::Graph;
use shibo_ide::actions::pinned_at;
use shibo_node::changes::{Look, Thing};
use shibo_node::registry::Registry;
use shibo_value::diagnostics::{Code, Diagnostic};

/// Advice for a pinned graph: nodes that are computed in an earlier version, and changes of at most 1/255, which count for
/// pinned graphs too. At most one for each change.
pub fn news(registry: &Registry, graph: &Graph) -> Vec<Diagnostic> {
    let Some(pins) = graph.sources.sources().first().and_then(|source| pinned_at(&source.text)) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for change in registry.changes().since(pins) {
        let Thing::Kind(kind) = change.thing() else { continue };
        let (number, version, what) = (change.change, change.version, &change.what);
        if change.look == Look::Roundings {
            if let Some(node) = graph.altered_by(change).next() {
                let message =
                    format!("`{kind}` differs by at most 1 of 255 since change {number}, in spite of the pin: {what}");
                let help = "`shibo pin FILE` takes the newest change";
                found.push(Diagnostic::new(Code::Advice, node.span, message).help(help).as_warning());
            }
        } else if let Some(node) =
            graph.nodes.node_weights().find(|node| node.kind == kind && node.node.version() < version)
        {
            let own = node.node.version();
            let message = format!("the pin keeps `{kind}` at version {own}; version {version}: {what}");
            let help = "`shibo migrate FILE` takes the newest version";
            found.push(Diagnostic::new(Code::Advice, node.span, message).help(help).as_warning());
        }
    }
    found
}
