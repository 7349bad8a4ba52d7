//! From `NODE[.PORT]` to an output of a graph.
use crate::quit::Quit;
use petgraph::graph::NodeIndex;
use shibo_engine::diagnostics::suggest;
use shibo_engine::graph::{Graph, GraphNode};

/// The output that is meant.
pub(super) fn output(graph: &Graph, name: &str) -> Result<(NodeIndex, usize), Quit> {
    let (node, port) = split(graph, name);
    let Some(index) = graph.nodes.node_indices().find(|&i| graph.nodes[i].name == node) else {
        let inside = format!("{node}/");
        if let Some(inner) = graph.nodes.node_weights().find(|n| n.name.starts_with(&inside)) {
            let message = format!("`{node}` is a sub-graph; its nodes are `{node}/NODE`, such as `{}`", inner.name);
            return Err(Quit::Usage(message));
        }
        let names: Vec<&str> = graph.nodes.node_weights().map(|n| n.name.as_str()).collect();
        return Err(Quit::Usage(format!("the graph has no node `{node}`; {}", suggest(node, "node", &names))));
    };
    let Some(port) = port else { return Ok((index, 0)) };
    Ok((index, output_of(&graph.nodes[index], port)?))
}

/// The node and the port that a name means. A node without a name of its own is called after its place, `node.port`; an output of
/// that name comes first.
fn split<'n>(graph: &Graph, name: &'n str) -> (&'n str, Option<&'n str>) {
    let find = |name: &str| graph.nodes.node_weights().find(|node| node.name == name);
    if let Some((node, port)) = name.rsplit_once('.')
        && let Some(found) = find(node)
        && (find(name).is_none() || found.node.outputs().iter().any(|output| output.name == port))
    {
        return (node, Some(port));
    }
    match find(name) {
        Some(_) => (name, None),
        None => name.split_once('.').map_or((name, None), |(node, port)| (node, Some(port))),
    }
}

fn output_of(node: &GraphNode, port: &str) -> Result<usize, Quit> {
    let outputs = node.node.outputs();
    outputs.iter().position(|output| output.name == port).ok_or_else(|| {
        let names: Vec<&str> = outputs.iter().map(|output| output.name).collect();
        let (name, kind) = (&node.name, &node.kind);
        Quit::Usage(format!("`{name}`, a {kind}, has no output `{port}`; {}", suggest(port, "output", &names)))
    })
}
