//! Advice about outputs that do not tile although the canvas does.
use super::{Graph, GraphNode, Input};
use crate::diagnostics::{Code, Diagnostic};
use crate::value::Tiling;
use petgraph::graph::NodeIndex;

/// The most outputs named in a warning.
const NAMED: usize = 3;

impl Graph {
    /// Advice that needs the whole graph: a warning for each node that prevents outputs from tiling.
    pub fn advice(&self) -> Vec<Diagnostic> {
        self.breaks_in_tiling().into_iter().map(|(_, warning)| warning).collect()
    }

    /// The nodes that prevent outputs from tiling, each with a warning.
    pub fn breaks_in_tiling(&self) -> Vec<(NodeIndex, Diagnostic)> {
        let order = petgraph::algo::toposort(&self.nodes, None).unwrap_or_default();
        let at_fault = self.at_fault(&order);
        let outputs = self.outputs_of(&order, &at_fault);
        let mut found: Vec<NodeIndex> =
            order.into_iter().filter(|node| at_fault[node.index()] && !outputs[node.index()].is_empty()).collect();
        found.sort_unstable();
        found.into_iter().map(|node| (node, self.breaks_tiling(&self.nodes[node], &outputs[node.index()]))).collect()
    }

    /// For each node, true if it does not tile as the canvas does, although all its inputs do.
    fn at_fault(&self, order: &[NodeIndex]) -> Vec<bool> {
        let wanted = self.canvas.tile;
        let mut tilings = vec![Tiling::BOTH; self.nodes.node_count()];
        let mut at_fault = vec![false; self.nodes.node_count()];
        for &index in order {
            let node = &self.nodes[index];
            let reads = wires(node).fold(Tiling::BOTH, |tiling, from| tiling.and(tilings[from.index()]));
            let own = node.node.tiling(&node.canvas);
            at_fault[index.index()] = !own.covers(wanted) && reads.covers(wanted);
            tilings[index.index()] = reads.and(own);
        }
        at_fault
    }

    /// For each node, the first few outputs that depend on it. Inputs of a node at fault are left out, since they tile.
    fn outputs_of(&self, order: &[NodeIndex], at_fault: &[bool]) -> Vec<Vec<usize>> {
        let mut outputs = vec![Vec::new(); self.nodes.node_count()];
        for (index, output) in self.outputs.iter().enumerate() {
            add(&mut outputs[output.node.index()], &[index]);
        }
        let hands_on = |index: NodeIndex| !at_fault[index.index()];
        for &index in order.iter().rev().filter(|index| hands_on(**index)) {
            let of_reader = outputs[index.index()].clone();
            for from in wires(&self.nodes[index]) {
                add(&mut outputs[from.index()], &of_reader);
            }
        }
        outputs
    }

    fn breaks_tiling(&self, node: &GraphNode, outputs: &[usize]) -> Diagnostic {
        let names: Vec<_> = outputs.iter().take(NAMED).map(|&i| format!("`{}`", self.outputs[i].name)).collect();
        let what = match &names[..] {
            [name] => format!("the output {name} does"),
            names if outputs.len() > NAMED => format!("the outputs {} and others do", names.join(", ")),
            names => format!("the outputs {} do", names.join(", ")),
        };
        let message = format!("{what} not tile: node `{}` does not repeat with the canvas", node.name);
        // Names of nodes contain no dots, except names of layout nodes for outputs of instances.
        let help = if node.name.contains('.') {
            "turn it by a multiple of 90° and make it smaller by a whole number, or say `tile: None` in the canvas"
        } else {
            "make that node periodic, or say `tile: None` in the canvas"
        };
        Diagnostic::new(Code::Advice, node.span, message).help(help).as_warning()
    }
}

/// Inputs that must tile for the node to tile; inputs it makes tileable are skipped.
fn wires(node: &GraphNode) -> impl Iterator<Item = NodeIndex> {
    node.inputs.iter().zip(&node.slots).filter_map(|(input, port)| match input {
        Input::Wire { node: from, .. } if !node.node.makes_tile(port) => Some(*from),
        _ => None,
    })
}

/// Merges sorted outputs, limited to the number that a warning needs.
fn add(outputs: &mut Vec<usize>, more: &[usize]) {
    outputs.extend_from_slice(more);
    outputs.sort_unstable();
    outputs.dedup();
    outputs.truncate(NAMED + 1);
}
