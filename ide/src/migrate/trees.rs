//! Rewrites the nodes of trees: skeleton, speeds and calendar, which each of them took, become one `Tree`.
//!
//! Nodes with the same skeleton and speeds share a `Tree`, which follows the node of the skeleton. A skeleton whose
//! speeds are the usual ones goes into the port `tree` itself.
use super::Change;
use super::edits::{Edits, with_line};
use super::scope::{graphs, is_path};
use shibo_graph::syntax::{Node, NodeKind, Tree};
use std::collections::{BTreeMap, BTreeSet};

/// The kinds that read a skeleton, and whether they read the growth in height and in radius.
const KINDS: [(&str, [bool; 2]); 8] = [
    ("TrunkTime", [true, true]),
    ("FiberSpace", [true, true]),
    ("BlendTimes", [true, true]),
    ("BranchTime", [true, false]),
    ("WoodPores", [true, true]),
    ("VaryGrowth", [false, false]),
    ("WoodRays", [false, false]),
    ("BudEyes", [false, false]),
];
/// The speeds, with the usual values.
const SPEEDS: [(&str, &str); 3] = [("elongation_speed", "230"), ("thickening_speed", "2.6"), ("ground", "0")];

/// The names of the fields that these kinds had besides the speeds.
const SKELETON: &str = "skeleton";
const CALENDAR: &str = "calendar";

/// True for a field of a kind that is rewritten.
pub(super) fn is_retired_field(kind: &str, field: &str) -> bool {
    let named = field == SKELETON || field == CALENDAR || SPEEDS.iter().any(|(speed, _)| *speed == field);
    named && KINDS.iter().any(|(known, _)| *known == kind)
}

/// What is rewritten.
#[derive(Default)]
pub(super) struct Trees {
    pub(super) edits: Edits,
    pub(super) changes: Vec<Change>,
    pub(super) warnings: Vec<Change>,
}

/// A node with old arguments.
struct Old<'t> {
    call: Node<'t>,
    reads: [bool; 2],
    skeleton: Option<Node<'t>>,
    /// The entries of the speeds and of the calendar.
    dropped: Vec<Node<'t>>,
    /// The speeds as written; `None` if not given.
    speeds: [Option<&'t str>; 3],
}

impl<'t> Old<'t> {
    /// `None` for a node without old arguments.
    fn of(call: Node<'t>) -> Option<Self> {
        let (_, reads) = KINDS.into_iter().find(|(kind, _)| call.name() == Some(*kind))?;
        let body = call.body()?;
        let written = |name: &str| body.entry(name).and_then(Node::value).map(Node::text);
        let names = SPEEDS.iter().map(|(name, _)| *name).chain([CALENDAR]);
        let dropped: Vec<_> = names.filter_map(|name| body.entry(name)).collect();
        let old = Self {
            call,
            reads,
            skeleton: body.entry(SKELETON),
            dropped,
            speeds: SPEEDS.map(|(name, _)| written(name)),
        };
        (old.skeleton.is_some() || !old.dropped.is_empty()).then_some(old)
    }

    fn skeleton_text(&self) -> Option<&'t str> {
        self.skeleton.and_then(Node::value).map(Node::text)
    }

    /// True if the speeds that it reads are the usual ones.
    fn is_usual(&self) -> bool {
        self.speeds.iter().zip(SPEEDS).all(|(speed, (_, usual))| speed.is_none_or(|speed| speed == usual))
    }

    /// True if a tree has the skeleton and the speeds that it reads.
    fn takes(&self, tree: &Group<'_>) -> bool {
        let same = |k: usize| self.speeds[k].unwrap_or(SPEEDS[k].1) == tree.speeds[k];
        let skeleton = self.skeleton_text().is_none_or(|skeleton| skeleton == tree.skeleton);
        skeleton && (!self.reads[0] || same(0) && same(2)) && (!self.reads[1] || same(1))
    }
}

/// A tree that nodes share.
struct Group<'t> {
    skeleton: &'t str,
    speeds: [&'t str; 3],
}

impl Group<'_> {
    /// The node in a graph file.
    fn text(&self) -> String {
        let mut text = format!("Tree(skeleton: {}", self.skeleton);
        for (speed, (name, usual)) in self.speeds.iter().zip(SPEEDS) {
            if *speed != usual {
                text += &format!(", {name}: {speed}");
            }
        }
        text + ")"
    }
}

/// Rewrites all graphs of a file.
pub(super) fn rewrite(tree: &Tree) -> Trees {
    let mut trees = Trees::default();
    for graph in graphs(tree) {
        if let Some(nodes) = graph.entry("nodes").and_then(Node::value) {
            trees.rewrite_nodes(tree, graph, nodes);
        }
    }
    trees
}

impl Trees {
    fn rewrite_nodes(&mut self, tree: &Tree, graph: Node<'_>, nodes: Node<'_>) {
        let calls = nodes.descendants().filter(|node| node.kind() == NodeKind::Call);
        let old: Vec<Old<'_>> = calls.filter_map(Old::of).collect();
        let groups = groups(&old);
        let names = self.name_groups(tree, graph, nodes, &groups);
        for node in &old {
            let message = format!("`{}` takes a tree", node.call.name().unwrap_or_default());
            let range = node.call.range();
            let group = groups.iter().position(|group| node.takes(group));
            let value = match (node.skeleton_text(), group) {
                (Some(skeleton), _) if node.is_usual() || !node.reads[0] => Some(skeleton.to_owned()),
                (None, _) if node.is_usual() => None,
                (_, Some(group)) => Some(names[group].clone()),
                (_, None) => {
                    let message = format!("not rewritten: no node gives the skeleton of this `{}`", message);
                    self.warnings.push(Change { range, message });
                    continue;
                }
            };
            self.changes.push(Change { range, message });
            self.replace(tree.text(), node, value.as_deref());
        }
    }

    /// Puts a tree in the place of the old arguments.
    fn replace(&mut self, text: &str, node: &Old<'_>, tree: Option<&str>) {
        let mut dropped = node.dropped.iter();
        if let Some(tree) = tree
            && let Some(entry) = node.skeleton.or_else(|| dropped.next().copied())
        {
            self.edits.replace(entry.range(), format!("tree: {tree}"));
        }
        for entry in dropped {
            self.edits.replace(with_line(text, entry.range()), "");
        }
    }

    /// The values for the trees: names of new nodes, or nodes in place.
    fn name_groups(&mut self, tree: &Tree, graph: Node<'_>, nodes: Node<'_>, groups: &[Group<'_>]) -> Vec<String> {
        let entries: BTreeMap<String, Node<'_>> =
            nodes.entries().filter_map(|entry| Some((entry.key_text()?, entry))).collect();
        let inputs = graph.entry("inputs").and_then(Node::value).into_iter().flat_map(Node::entries);
        let mut taken: BTreeSet<String> = entries.keys().cloned().chain(inputs.filter_map(Node::key_text)).collect();
        let mut names = Vec::new();
        for group in groups {
            let path = group.skeleton.trim_matches('"');
            let above = entries.get(path.split('.').next().unwrap_or(path)).filter(|_| is_path(path));
            let Some(above) = above else {
                names.push(group.text());
                continue;
            };
            let candidates = ["tree".to_owned(), format!("{}_tree", path.replace('.', "_"))].into_iter();
            let numbered = (2..).map(|number| format!("tree_{number}"));
            let name = candidates.chain(numbered).find(|name| !taken.contains(name)).unwrap_or_default();
            let text = tree.text();
            let end = above.range().end;
            let comma = text[end..].trim_start().starts_with(',');
            let at = if comma { end + text[end..].find(',').map_or(0, |at| at + 1) } else { end };
            let indent = super::edits::column(text, above.range().start);
            let line = format!("{}\n{}\"{name}\": {},", if comma { "" } else { "," }, " ".repeat(indent), group.text());
            self.edits.replace(at..at, line);
            names.push(format!("\"{name}\""));
            taken.insert(name);
        }
        names
    }
}

/// The trees with other than the usual speeds.
fn groups<'t>(old: &[Old<'t>]) -> Vec<Group<'t>> {
    let mut groups: Vec<Group<'t>> = Vec::new();
    let mut sorted: Vec<&Old<'t>> = old.iter().filter(|node| node.reads[0] && !node.is_usual()).collect();
    // Those that tell most of their tree come first.
    sorted.sort_by_key(|node| (node.skeleton.is_none(), !node.reads[1]));
    for node in sorted {
        let known = groups.iter().any(|group| node.takes(group));
        let Some(skeleton) = node.skeleton_text().or_else(|| groups.first().map(|group| group.skeleton)) else {
            continue;
        };
        if !known {
            let speed = |k: usize| node.speeds[k].unwrap_or(SPEEDS[k].1);
            groups.push(Group { skeleton, speeds: [speed(0), speed(1), speed(2)] });
        }
    }
    groups
}
