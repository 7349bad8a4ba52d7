//! Nodes that cut solids.
use petgraph::Direction;
use petgraph::graph::NodeIndex;
use shibo_graph::{Graph, Input};
use shibo_value::Type;
use std::collections::{HashSet, VecDeque};

/// A node that cuts a solid or a material of solids, and its slot for it.
pub type Cutter = (NodeIndex, usize);

/// Upstream nodes that cut a solid or a material of solids, the nearest first.
pub fn cutters(graph: &Graph, from: NodeIndex) -> Vec<Cutter> {
    let solid = |input: &Input| match input {
        Input::Wire { node, output } => graph.nodes[*node].outputs.get(*output).is_some_and(|ty| ty.is_in_space()),
        Input::Constant(_) => false,
    };
    let slot = |index: NodeIndex| {
        let node = &graph.nodes[index];
        let drawn = node.outputs.first().is_some_and(|ty| ty.is_field() || *ty == Type::Material);
        node.inputs.iter().position(solid).filter(|_| drawn).map(|slot| (index, slot))
    };
    upstream(graph, from).into_iter().filter_map(slot).collect()
}

/// A node and its upstream nodes, the nearest first.
pub fn upstream(graph: &Graph, from: NodeIndex) -> Vec<NodeIndex> {
    let mut queue = VecDeque::from([from]);
    let (mut found, mut seen) = (Vec::new(), HashSet::from([from]));
    while let Some(index) = queue.pop_front() {
        found.push(index);
        let mut before: Vec<NodeIndex> = graph.nodes.neighbors_directed(index, Direction::Incoming).collect();
        before.sort();
        queue.extend(before.into_iter().filter(|next| seen.insert(*next)));
    }
    found
}
