//! The graph as pages draw it: boxes in columns, and wires.
use crate::graph::layout::layout;
use serde_json::{Value as Json, json};
use shibo_engine::diagnostics::{SourceMap, Span};
use shibo_engine::graph::{Graph, GraphNode, Input};
use std::collections::BTreeSet;

/// Longer texts of nodes are cut, in bytes.
const TEXT: usize = 2000;

/// Nodes with their places, and wires with their bends.
pub(super) fn wiring(graph: &Graph) -> Json {
    let mut wires = Vec::new();
    for index in graph.nodes.node_indices() {
        for (slot, input) in graph.nodes[index].inputs.iter().enumerate() {
            if let Input::Wire { node, output } = input {
                wires.push((node.index(), index.index(), *output, slot));
            }
        }
    }
    let ends: Vec<(usize, usize)> = wires.iter().map(|w| (w.0, w.1)).collect();
    let layout = layout(graph.nodes.node_count(), &ends, |_| false);
    let outputs: BTreeSet<usize> = graph.outputs.iter().map(|o| o.node.index()).collect();
    let nodes = graph.nodes.node_indices().map(|index| {
        let node = &graph.nodes[index];
        let place = layout.places[index.index()];
        let ports = node.node.outputs().iter().zip(&node.outputs);
        json!({
            "name": node.name,
            "kind": node.kind,
            "column": place.column,
            "row": place.row,
            "ports": ports.map(|(o, ty)| json!({ "name": o.name, "type": ty.to_string() })).collect::<Vec<_>>(),
            "color": node.outputs.first().map(|ty| ty.color()),
            "output": outputs.contains(&index.index()),
            "line": graph.sources.position(node.span.file, node.span.start).line,
        })
    });
    let wires = wires.iter().zip(&layout.bends).map(|((from, to, output, slot), bends)| {
        let bends: Vec<_> = bends.iter().map(|p| json!([p.column, p.row])).collect();
        let from_node = &graph.nodes[petgraph::graph::NodeIndex::new(*from)];
        let ty = from_node.outputs.get(*output);
        let port = graph.nodes[petgraph::graph::NodeIndex::new(*to)].slots.get(*slot);
        json!({ "from": from, "to": to, "port": port, "color": ty.map(|ty| ty.color()), "bends": bends })
    });
    json!({
        "nodes": nodes.collect::<Vec<_>>(),
        "wires": wires.collect::<Vec<_>>(),
        "columns": layout.columns,
        "rows": layout.rows,
    })
}

/// The text of a node in its file, from its kind to the bracket that ends it.
pub(super) fn text(node: &GraphNode, sources: &SourceMap) -> String {
    let Span { file, start, .. } = node.span;
    let text = sources.text(file);
    let end = node.fields.iter().filter(|(_, s)| s.file == file && s.end > start).map(|(_, s)| s.end).max();
    let after = end.unwrap_or(node.span.end);
    let close = text.get(after..).and_then(|rest| rest.find(')')).map_or(after, |at| after + at + 1);
    let shown = text.get(start..close).unwrap_or(&node.kind);
    if shown.len() > TEXT { node.kind.clone() } else { shown.to_owned() }
}
