//! The graph as pages draw it, level by level: a sub-graph is one box that opens into a level of its own.
use super::groups;
use super::layout::layout;
use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use serde_json::{Value as Json, json};
use shibo_graph::{Graph, GraphNode, GraphUse, Input};
use std::collections::{BTreeMap, BTreeSet};

/// Content of a box.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    /// A node.
    Node(usize),
    /// A sub-graph, by its name.
    Use(String),
    /// A node or sub-graph outside this level, by its name.
    Outside(String),
}

/// The boxes of a level, and the box of each graph node.
struct Level<'g> {
    graph: &'g Graph,
    path: &'g str,
    uses: BTreeMap<&'g str, &'g GraphUse>,
    boxes: Vec<What>,
    of_node: Vec<Option<usize>>,
}

/// Draws the level of the sub-graph `path`, or of the whole graph if `path` is empty; `None` if there is no such
/// sub-graph.
pub fn level(graph: &Graph, path: &str) -> Option<Json> {
    if !path.is_empty() && !graph.uses.iter().any(|found| found.name == path) {
        return None;
    }
    // Boxes must not form cycles, so sub-graphs that feed back into themselves through other nodes are drawn node by
    // node.
    let mut open = BTreeSet::new();
    loop {
        let level = Level::of(graph, path, &open);
        let circles = level.circles();
        if circles.is_empty() {
            return Some(level.draw());
        }
        open.extend(circles);
    }
}

impl<'g> Level<'g> {
    fn of(graph: &'g Graph, path: &'g str, open: &BTreeSet<String>) -> Self {
        let uses = graph.uses.iter().map(|found| (found.name.as_str(), found)).collect();
        let mut level = Self { graph, path, uses, boxes: Vec::new(), of_node: vec![None; graph.nodes.node_count()] };
        let mut known: BTreeMap<What, usize> = BTreeMap::new();
        let inside: Vec<Option<What>> =
            graph.nodes.node_indices().map(|index| level.inside(index.index(), open)).collect();
        for (node, what) in inside.iter().enumerate() {
            level.of_node[node] = what.clone().map(|what| level.number(&mut known, what));
        }
        // An outside node or sub-graph gets a box if a wire connects it with this level.
        for (from, to, ..) in wires(graph) {
            for (outer, inner) in [(from, to), (to, from)] {
                if inside[outer].is_none() && inside[inner].is_some() {
                    let what = level.outside(outer);
                    level.of_node[outer] = Some(level.number(&mut known, what));
                }
            }
        }
        level
    }

    fn number(&mut self, known: &mut BTreeMap<What, usize>, what: What) -> usize {
        *known.entry(what.clone()).or_insert_with(|| {
            self.boxes.push(what);
            self.boxes.len() - 1
        })
    }

    /// Returns the box of a node if the node is in this level.
    fn inside(&self, node: usize, open: &BTreeSet<String>) -> Option<What> {
        let name = self.graph.nodes[NodeIndex::new(node)].name.as_str();
        let start = match self.path {
            "" => 0,
            path if name.strip_prefix(path)?.starts_with(['/', '.']) => path.len() + 1,
            _ => return None,
        };
        // Finds the outermost sub-graph that is drawn as one box.
        for (at, _) in name.match_indices(['/', '.']).filter(|(at, _)| *at > start) {
            let outer = &name[..at];
            if self.uses.contains_key(outer) && !open.contains(outer) {
                return Some(What::Use(outer.to_owned()));
            }
        }
        Some(What::Node(node))
    }

    /// Returns the box of a node outside this level, named as in the closest level that contains both.
    fn outside(&self, node: usize) -> What {
        let name = &self.graph.nodes[NodeIndex::new(node)].name;
        let shared = name.split('/').zip(self.path.split('/')).take_while(|(a, b)| a == b).count();
        let end = name.match_indices('/').nth(shared).map_or(name.len(), |(at, _)| at);
        What::Outside(name[..end].to_owned())
    }

    fn ends(&self) -> impl Iterator<Item = (usize, usize, (usize, usize, usize, usize))> {
        wires(self.graph).filter_map(|wire| {
            let (from, to) = (self.of_node[wire.0]?, self.of_node[wire.1]?);
            let both_outside = |n: usize| matches!(self.boxes[n], What::Outside(_));
            (from != to && !(both_outside(from) && both_outside(to))).then_some((from, to, wire))
        })
    }

    /// Names of the sub-graphs on a cycle. Outside boxes on a cycle are skipped.
    fn circles(&self) -> Vec<String> {
        let mut net: DiGraph<usize, ()> = DiGraph::new();
        let nodes: Vec<_> = (0..self.boxes.len()).map(|number| net.add_node(number)).collect();
        for (from, to, _) in self.ends() {
            net.add_edge(nodes[from], nodes[to], ());
        }
        let circles = kosaraju_scc(&net).into_iter().filter(|circle| circle.len() > 1).flatten();
        let name = |number: usize| match &self.boxes[number] {
            What::Use(name) => Some(name.clone()),
            _ => None,
        };
        circles.filter_map(|node| name(net[node])).collect()
    }

    fn draw(&self) -> Json {
        // An outside box that both feeds this level and reads from it would close a cycle.
        let feeds: BTreeSet<usize> = self.ends().map(|(from, ..)| from).collect();
        let is_back = |to: usize| matches!(self.boxes[to], What::Outside(_)) && feeds.contains(&to);
        let mut seen = BTreeSet::new();
        let mut found = Vec::new();
        for (from, to, (a, b, output, slot)) in self.ends() {
            let ty = self.graph.nodes[NodeIndex::new(a)].outputs.get(output).copied();
            let port = self.graph.nodes[NodeIndex::new(b)].slots.get(slot).cloned().unwrap_or_default();
            let color = ty.map(|ty| ty.color());
            if !is_back(to)
                && seen.insert((from, to, color, matches!(self.boxes[to], What::Node(_)).then(|| port.clone())))
            {
                let read =
                    self.graph.nodes[NodeIndex::new(a)].node.outputs().get(output).map_or("", |output| output.name);
                found.push((from, to, port, color, read, ty.map(|ty| ty.to_string())));
            }
        }
        let ends: Vec<(usize, usize)> = found.iter().map(|wire| (wire.0, wire.1)).collect();
        let layout = layout(self.boxes.len(), &ends, |_| false);
        let wires = found.iter().zip(&layout.bends).map(|((from, to, port, color, read, ty), bends)| {
            let bends: Vec<_> = bends.iter().map(|p| json!([p.column, p.row])).collect();
            json!({ "from": from, "to": to, "output": read, "port": port, "type": ty, "color": color, "bends": bends })
        });
        let breaks: BTreeMap<usize, String> =
            self.graph.breaks_in_tiling().into_iter().map(|(node, why)| (node.index(), why.message)).collect();
        let boxes = self.boxes.iter().zip(&layout.places).enumerate().map(|(number, (what, place))| {
            let mut drawn = self.describe(number, what, &breaks);
            drawn["column"] = place.column.into();
            drawn["row"] = place.row.into();
            drawn
        });
        json!({
            "path": self.path,
            "nodes": boxes.collect::<Vec<_>>(),
            "wires": wires.collect::<Vec<_>>(),
            "names": self.graph.nodes.node_weights().map(|node| &node.name).collect::<Vec<_>>(),
            "columns": layout.columns,
            "rows": layout.rows,
        })
    }

    /// A node in whose text the sub-graphs of this level stand, too.
    fn beside(&self) -> Option<&'g GraphNode> {
        let is_here = |name: &str| !label(name, self.path).contains(['/', '.']);
        let nodes = self.boxes.iter().filter_map(|what| match what {
            What::Node(index) => Some(&self.graph.nodes[NodeIndex::new(*index)]),
            _ => None,
        });
        nodes.into_iter().find(|node| is_here(&node.name))
    }

    fn describe(&self, number: usize, what: &What, breaks: &BTreeMap<usize, String>) -> Json {
        let graph = self.graph;
        let members = || self.of_node.iter().enumerate().filter(|(_, of)| **of == Some(number)).map(|(node, _)| node);
        let is_output = |node: usize| graph.outputs.iter().any(|output| output.node.index() == node);
        let broken = members().find_map(|node| breaks.get(&node));
        match what {
            What::Node(index) => {
                let node = &graph.nodes[NodeIndex::new(*index)];
                let ports = node.node.outputs().iter().zip(&node.outputs);
                json!({
                    "name": node.name,
                    "label": label(&node.name, self.path),
                    "kind": node.kind,
                    "index": index,
                    "output": 0,
                    "ports": ports.map(|(o, ty)| json!({ "name": o.name, "type": ty.to_string() })).collect::<Vec<_>>(),
                    "color": node.outputs.first().map(|ty| ty.color()),
                    "shown": is_output(*index),
                    "line": graph.sources.position(node.span.file, node.span.start).line,
                    "members": [index],
                    "group": groups::group(node, &graph.sources),
                    "broken": broken,
                })
            }
            What::Use(name) => {
                let found = self.uses.get(name.as_str());
                let main = found.and_then(|found| found.outputs.first());
                let stem = found.and_then(|found| found.path.file_stem()).unwrap_or_default().to_string_lossy();
                let ports = found.into_iter().flat_map(|found| &found.outputs).map(|(port, node, output)| {
                    let ty = graph.nodes[*node].outputs.get(*output).map(ToString::to_string);
                    json!({ "name": port, "type": ty, "node": graph.nodes[*node].name, "output": output })
                });
                let ty = main.and_then(|(_, node, output)| graph.nodes[*node].outputs.get(*output));
                let members: Vec<usize> = members().collect();
                json!({
                    "name": name,
                    "label": label(name, self.path),
                    "kind": format!("Use {stem}"),
                    "use": true,
                    "index": main.map(|(_, node, _)| node.index()),
                    "output": main.map_or(0, |(_, _, output)| *output),
                    "ports": ports.collect::<Vec<_>>(),
                    "color": ty.map(|ty| ty.color()),
                    "shown": members.iter().any(|node| is_output(*node)),
                    "members": members,
                    "group": self.beside().and_then(|node| {
                        groups::group_of_use(label(name, self.path), node, &graph.sources)
                    }),
                    "broken": broken,
                })
            }
            What::Outside(name) => {
                let index = members().next();
                let kind = index.map_or("", |index| graph.nodes[NodeIndex::new(index)].kind.as_str());
                json!({
                    "name": name, "label": name, "kind": kind, "outside": true, "index": index, "output": 0, "ports": [],
                    "members": [],
                })
            }
        }
    }
}

/// Name of a node relative to the level `path`.
fn label<'n>(name: &'n str, path: &str) -> &'n str {
    if path.is_empty() { name } else { name.get(path.len() + 1..).unwrap_or(name) }
}

/// All wires, as source node, target node, output of the source and slot of the target.
fn wires(graph: &Graph) -> impl Iterator<Item = (usize, usize, usize, usize)> {
    graph.nodes.node_indices().flat_map(move |index| {
        graph.nodes[index].inputs.iter().enumerate().filter_map(move |(slot, input)| match input {
            Input::Wire { node, output } => Some((node.index(), index.index(), *output, slot)),
            Input::Constant(_) => None,
        })
    })
}
