//! Resolves `NODE`, `NODE.PORT`, `USE/NODE` or `USE.OUTPUT` to an output of a graph.
use crate::quit::Quit;
use petgraph::graph::NodeIndex;
use shibo_graph::Graph;
use shibo_node::Output;
use shibo_value::diagnostics::suggest;

/// Finds an output by name. Names of sub-graphs are followed by a slash or a dot; after a dot, an output of the
/// sub-graph takes precedence over a node of the same name.
pub(crate) fn output(graph: &Graph, name: &str) -> Result<(NodeIndex, usize), Quit> {
    let path = name.replace('.', "/");
    if !name.contains('.')
        && let Some(node) = node(graph, &path)
    {
        return Ok((node, 0));
    }
    if let Some(found) = of_use(graph, &path, None) {
        return Ok(found);
    }
    if let Some(found) = inline(graph, name) {
        return Ok(found);
    }
    let Some((owner, last)) = path.rsplit_once('/') else { return Err(unknown(graph, name)) };
    if let Some(found) = of_use(graph, owner, Some(last)) {
        return Ok(found);
    }
    if let Some(index) = node(graph, &path) {
        return Ok((index, 0));
    }
    let Some(index) = node(graph, owner) else { return Err(unknown(graph, name)) };
    let node = &graph.nodes[index];
    let outputs = node.node.outputs();
    let found = Output::position(outputs, last);
    found.map(|output| (index, output)).ok_or_else(|| {
        let names: Vec<&str> = outputs.iter().map(|output| output.name).collect();
        let (name, kind) = (&node.name, &node.kind);
        Quit::Usage(format!("`{name}`, a {kind}, has no output `{last}`; {}", suggest(last, "output", &names)))
    })
}

/// Finds a node without a name, which is called by its position `node.port`, with an optional output. An output of that
/// name takes precedence.
fn inline(graph: &Graph, name: &str) -> Option<(NodeIndex, usize)> {
    let output = |owner: NodeIndex, last: &str| Output::position(graph.nodes[owner].node.outputs(), last);
    let (owner, last) = name.rsplit_once('.')?;
    match (node(graph, owner).and_then(|owner| Some((owner, output(owner, last)?))), node(graph, name)) {
        (None, Some(index)) => Some((index, 0)),
        (Some(found), _) if owner.contains('.') => Some(found),
        _ => None,
    }
}

fn node(graph: &Graph, path: &str) -> Option<NodeIndex> {
    graph.nodes.node_indices().find(|&index| graph.nodes[index].name == path)
}

/// Finds an output of a sub-graph; the main one by default.
fn of_use(graph: &Graph, path: &str, output: Option<&str>) -> Option<(NodeIndex, usize)> {
    let found = graph.uses.iter().find(|found| found.name == path)?;
    let mut outputs = found.outputs.iter();
    let (_, node, port) = match output {
        Some(output) => outputs.find(|(name, ..)| name == output),
        None => outputs.next(),
    }?;
    Some((*node, *port))
}

fn unknown(graph: &Graph, name: &str) -> Quit {
    // If the sub-graph exists, the error is in the last name of the path.
    let path = name.replace('.', "/");
    if let Some((owner, last)) = path.rsplit_once('/')
        && graph.uses.iter().any(|found| found.name == owner)
    {
        let prefix = format!("{owner}/");
        let inside = graph.nodes.node_weights().filter_map(|node| node.name.strip_prefix(&prefix));
        let outputs = graph.uses.iter().filter(|found| found.name == owner).flat_map(|found| &found.outputs);
        let mut names: Vec<&str> = inside.filter(|name| !name.contains('/')).collect();
        names.extend(outputs.map(|(name, ..)| name.as_str()));
        let help = suggest(last, "node", &names);
        // Outputs of these sub-graphs are made only if something reads them.
        let note = "of `Each`, and of a `Use` with `canvas`, there are the outputs that something reads";
        return Quit::Usage(format!("`{owner}` is a sub-graph without `{last}`; {help} ({note})"));
    }
    let nodes = graph.nodes.node_weights().map(|node| node.name.as_str());
    let names: Vec<&str> = nodes.chain(graph.uses.iter().map(|found| found.name.as_str())).collect();
    Quit::Usage(format!("the graph has no node `{name}`; {}", suggest(name, "node", &names)))
}
