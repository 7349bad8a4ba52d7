//! Advice about outputs that do not tile although the canvas does.
use super::{Graph, GraphNode, Input};
use crate::diagnostics::{Code, Diagnostic};
use crate::value::Tiling;
use crate::value::expression::Growth;
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
        let repeats = self.repeats(&order);
        let outputs = self.outputs_of(&order, &repeats);
        let at_fault = &repeats.at_fault;
        let mut found: Vec<NodeIndex> =
            order.into_iter().filter(|node| at_fault[node.index()] && !outputs[node.index()].is_empty()).collect();
        found.sort_unstable();
        let warning = |node: NodeIndex| {
            let is_formula = repeats.knows[node.index()];
            self.breaks_tiling(&self.nodes[node], is_formula, &outputs[node.index()])
        };
        found.into_iter().map(|node| (node, warning(node))).collect()
    }

    /// Finds the nodes that do not tile as the canvas does, although all their inputs do. A formula that grows from one
    /// repeat to the next is one of them if an output or a node other than a formula reads it.
    fn repeats(&self, order: &[NodeIndex]) -> Repeats {
        let (wanted, count) = (self.canvas.tile, self.nodes.node_count());
        let mut tilings = vec![Tiling::BOTH; count];
        let mut found =
            Repeats { at_fault: vec![false; count], grown: vec![Vec::new(); count], knows: vec![false; count] };
        for &index in order {
            let node = &self.nodes[index];
            let inputs: Vec<Vec<Growth>> = node.inputs.iter().map(|input| found.growth_of(input)).collect();
            let growth = node.node.growth(&node.canvas, &inputs);
            found.knows[index.index()] = growth.is_some();
            let mut reads = Tiling::BOTH;
            for from in wires(node).map(NodeIndex::index) {
                let grows = !found.grown[from].is_empty();
                found.at_fault[from] |= grows && growth.is_none();
                reads = reads.and(if grows && growth.is_none() { Tiling::NONE } else { tilings[from] });
            }
            let own = match &growth {
                Some(growth) => where_all(growth, |by| by == Some(0.0)),
                None => node.node.tiling(&node.canvas),
            };
            let growth =
                growth.filter(|growth| !own.covers(wanted) && where_all(growth, |by| by.is_some()).covers(wanted));
            found.at_fault[index.index()] = growth.is_none() && !own.covers(wanted) && reads.covers(wanted);
            tilings[index.index()] = if growth.is_some() { reads } else { reads.and(own) };
            found.grown[index.index()] = growth.unwrap_or_default();
        }
        for node in self.outputs.iter().filter(|output| output.is_on_canvas()).map(|output| output.node.index()) {
            found.at_fault[node] |= !found.grown[node].is_empty();
        }
        found
    }

    /// For each node, the first few outputs that depend on it. Inputs of a node at fault are left out, since they tile,
    /// and so are growing inputs of formulas, which need not.
    fn outputs_of(&self, order: &[NodeIndex], repeats: &Repeats) -> Vec<Vec<usize>> {
        let mut outputs = vec![Vec::new(); self.nodes.node_count()];
        for (index, output) in self.outputs.iter().enumerate().filter(|(_, output)| output.is_on_canvas()) {
            add(&mut outputs[output.node.index()], &[index]);
        }
        let hands_on = |index: NodeIndex| !repeats.at_fault[index.index()];
        for &index in order.iter().rev().filter(|index| hands_on(**index)) {
            let of_reader = outputs[index.index()].clone();
            let counts = |from: &NodeIndex| !repeats.knows[index.index()] || repeats.grown[from.index()].is_empty();
            for from in wires(&self.nodes[index]).filter(counts) {
                add(&mut outputs[from.index()], &of_reader);
            }
        }
        outputs
    }

    fn breaks_tiling(&self, node: &GraphNode, is_formula: bool, outputs: &[usize]) -> Diagnostic {
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
        } else if is_formula {
            "let the position repeat a whole number of times: `sin(360 * 3 * u)`, `fract(4 * v)`, `noise(8 * u, 8 * v)`; \
             or close the seam by `MakeTileable`, or say `tile: None` in the canvas"
        } else {
            "make that node periodic, or say `tile: None` in the canvas"
        };
        Diagnostic::new(Code::Advice, node.span, message).help(help).as_warning()
    }
}

/// The nodes that repeat with the canvas.
struct Repeats {
    /// True for a node that prevents outputs from tiling.
    at_fault: Vec<bool>,
    /// The growth of the components of each node that grows evenly from one repeat to the next; empty for the others.
    grown: Vec<Vec<Growth>>,
    /// True for a node that finds its growth from that of its inputs.
    knows: Vec<bool>,
}

impl Repeats {
    fn growth_of(&self, input: &Input) -> Vec<Growth> {
        match input {
            Input::Wire { node, .. } => self.grown[node.index()].clone(),
            _ => Vec::new(),
        }
    }
}

/// The directions in which this holds for all components.
fn where_all(growth: &[Growth], holds: impl Fn(Option<f64>) -> bool) -> Tiling {
    let [x, y] = [0, 1].map(|axis| growth.iter().all(|by| holds(by[axis])));
    Tiling { x, y }
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
