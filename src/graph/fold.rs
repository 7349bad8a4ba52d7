//! Folds each sub-graph of a drawing to one box.
use super::{Drawing, Item, Shape, Wire};
use petgraph::algo::kosaraju_scc;
use petgraph::graph::DiGraph;
use shibo_graph::Graph;
use std::collections::{BTreeMap, BTreeSet};

/// The drawing of a graph with its sub-graphs as boxes.
pub(super) fn folded(graph: &Graph, drawing: Drawing) -> Drawing {
    // Boxes must not form cycles, so sub-graphs that feed back into themselves through other nodes are drawn node by
    // node.
    let mut open = BTreeSet::new();
    loop {
        let boxes = Boxes::of(graph, &drawing, &open);
        let circles = boxes.circles(&drawing);
        if circles.is_empty() {
            return boxes.draw(graph, drawing);
        }
        open.extend(circles);
    }
}

/// Assignment of the items of a drawing to boxes.
struct Boxes {
    /// For each item, the index of its box.
    of_item: Vec<usize>,
    /// For each box, the sub-graph that it stands for, if any.
    names: Vec<Option<String>>,
}

impl Boxes {
    fn of(graph: &Graph, drawing: &Drawing, open: &BTreeSet<String>) -> Self {
        let uses: BTreeSet<&str> = graph.uses.iter().map(|found| found.name.as_str()).collect();
        let mut known: BTreeMap<&str, usize> = BTreeMap::new();
        let mut boxes = Self { of_item: Vec::new(), names: Vec::new() };
        for item in &drawing.items {
            let outer = item.name.split(['/', '.']).next().unwrap_or_default();
            let inside = item.shape == Shape::Node && outer.len() < item.name.len() && uses.contains(outer);
            let name = Some(outer).filter(|outer| inside && !open.contains(*outer));
            let next = boxes.names.len();
            let number = name.map_or(next, |name| *known.entry(name).or_insert(next));
            if number == next {
                boxes.names.push(name.map(str::to_owned));
            }
            boxes.of_item.push(number);
        }
        boxes
    }

    /// Boxes at the ends of a wire; `None` within one box.
    fn ends(&self, wire: &Wire) -> Option<(usize, usize)> {
        let (from, to) = (self.of_item[wire.from], self.of_item[wire.to]);
        (from != to).then_some((from, to))
    }

    /// Names of the sub-graphs on a cycle.
    fn circles(&self, drawing: &Drawing) -> Vec<String> {
        let mut net: DiGraph<usize, ()> = DiGraph::new();
        let nodes: Vec<_> = (0..self.names.len()).map(|number| net.add_node(number)).collect();
        for (from, to) in drawing.wires.iter().filter_map(|wire| self.ends(wire)) {
            net.add_edge(nodes[from], nodes[to], ());
        }
        let circles = kosaraju_scc(&net).into_iter().filter(|circle| circle.len() > 1).flatten();
        circles.filter_map(|node| self.names[net[node]].clone()).collect()
    }

    fn draw(&self, graph: &Graph, drawing: Drawing) -> Drawing {
        // Names of all nodes; a wire into a folded box ends at a port named after its inner node.
        let inner: Vec<String> = drawing.items.iter().map(|item| item.name.clone()).collect();
        let mut items: Vec<Option<Item>> = self.names.iter().map(|_| None).collect();
        for (item, number) in drawing.items.into_iter().zip(&self.of_item) {
            items[*number].get_or_insert_with(|| match &self.names[*number] {
                Some(name) => Item { name: name.clone(), kind: kind(graph, name), shape: Shape::Use },
                None => item,
            });
        }
        let mut seen = BTreeSet::new();
        let mut wires = Vec::new();
        for wire in drawing.wires {
            let Some((from, to)) = self.ends(&wire) else { continue };
            let output = match &self.names[from] {
                Some(name) => output(graph, name, wire.from, wire.output.as_deref()),
                None => wire.output,
            };
            let port = match &self.names[to] {
                Some(name) => inner[wire.to][name.len() + 1..].to_owned(),
                None => wire.port,
            };
            if seen.insert((from, to, output.clone(), port.clone())) {
                wires.push(Wire { from, to, output, port, ty: wire.ty });
            }
        }
        Drawing { title: drawing.title, items: items.into_iter().flatten().collect(), wires }
    }
}

/// Text below the name of a sub-graph.
fn kind(graph: &Graph, name: &str) -> String {
    let path = graph.uses.iter().find(|found| found.name == name).map(|found| &found.path);
    let stem = path.and_then(|path| path.file_stem()).map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    format!("Use {stem}")
}

/// Name of the sub-graph output made by an inner node; `None` for the main output.
fn output(graph: &Graph, name: &str, node: usize, port: Option<&str>) -> Option<String> {
    let found = graph.uses.iter().find(|found| found.name == name)?;
    let is = |(_, index, output): &(String, petgraph::graph::NodeIndex, usize)| {
        let outputs = graph.nodes[*index].node.outputs();
        index.index() == node && outputs.get(*output).map(|o| o.name).filter(|_| *output > 0) == port
    };
    let at = found.outputs.iter().position(is)?;
    (at > 0).then(|| found.outputs[at].0.clone())
}
