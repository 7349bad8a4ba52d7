//! Finds the nodes that are replaced, and all places of a graph that read nodes.
use super::kinds::{Removed, Rewrite, removed};
use super::scope::{Scope, is_path, text_of};
use shibo_graph::syntax::{Node, NodeKind};
use shibo_node::registry::Registry;
use shibo_node::{FieldInfo, KindInfo, ParamInfo, Role};
use std::ops::Range;

/// Where a node that is replaced is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Spot {
    /// An entry of `nodes`, by its index.
    Entry(usize),
    /// In place of a wire.
    Place,
    /// As an operand of another node that becomes a formula.
    Operand,
}

/// A node that is replaced.
pub(super) struct Old<'t> {
    /// The call.
    pub(super) node: Node<'t>,
    /// Its row of the table.
    pub(super) removed: &'static Removed,
    /// Its place.
    pub(super) spot: Spot,
    /// Index of the entry of `nodes` that contains it.
    pub(super) entry: Option<usize>,
}

/// A text that reads a node, or a formula.
pub(super) struct Wire {
    /// The literal.
    pub(super) range: Range<usize>,
    /// Its text.
    pub(super) text: String,
    /// The place.
    pub(super) holds: Holds,
    /// Index of the entry of `nodes` that contains it.
    pub(super) entry: Option<usize>,
}

/// The values that a place may have instead of the name of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Holds {
    /// A formula.
    Formula,
    /// A formula; the place is an output of the graph.
    Output,
    /// The path of a value.
    Path,
}

/// The places of a graph.
#[derive(Default)]
pub(super) struct Places<'t> {
    /// Nodes that are replaced, in the order of the text.
    pub(super) old: Vec<Old<'t>>,
    /// Wires and formulas.
    pub(super) wires: Vec<Wire>,
}

/// The value that is expected at a place.
#[derive(Clone, Copy)]
enum Context<'r> {
    /// The value of an entry of `nodes`, by its index.
    Entry(usize),
    /// A wire, a literal, a node or a list of them.
    Port,
    /// A value of a parameter that is a list of structs.
    Structs(&'r ParamInfo),
    /// An operand of a formula.
    Operand,
    /// Any value; texts that are names of nodes refer to them.
    Unknown,
    /// An output of the graph.
    Output,
}

/// Finds the places of a graph.
pub(super) fn places<'t>(scope: &Scope<'t>, registry: &Registry) -> Places<'t> {
    let mut finder = Finder { scope, registry, found: Places::default(), waiting: Vec::new() };
    let section = |name: &str| scope.body.entry(name).and_then(Node::value).into_iter().flat_map(Node::entries);
    for input in section("inputs") {
        let default = input.value().and_then(Node::body).and_then(|body| body.entry("default")).and_then(Node::value);
        finder.find(default, Context::Port, None);
    }
    for (index, entry) in scope.entries.iter().enumerate() {
        finder.find(Some(entry.value), Context::Entry(index), Some(index));
    }
    for output in section("outputs") {
        finder.find(output.value(), Context::Output, None);
    }
    finder.found.old.sort_by_key(|old| old.node.index());
    finder.found
}

fn spot(context: Context<'_>, removed: &Removed) -> Spot {
    match context {
        Context::Entry(index) => Spot::Entry(index),
        Context::Operand if removed.is_formula() => Spot::Operand,
        _ => Spot::Place,
    }
}

struct Finder<'s, 't, 'r> {
    scope: &'s Scope<'t>,
    registry: &'r Registry,
    found: Places<'t>,
    waiting: Vec<(Node<'t>, Context<'r>)>,
}

impl<'t, 'r> Finder<'_, 't, 'r> {
    fn find(&mut self, value: Option<Node<'t>>, context: Context<'r>, entry: Option<usize>) {
        self.waiting.extend(value.map(|value| (value, context)));
        while let Some((value, context)) = self.waiting.pop() {
            match value.kind() {
                NodeKind::Call => self.call(value, context, entry),
                // A kind without brackets.
                NodeKind::Word if matches!(context, Context::Entry(_) | Context::Port) => {
                    if let Some(removed) = value.name().and_then(|kind| removed(kind, self.registry)) {
                        self.found.old.push(Old { node: value, removed, spot: spot(context, removed), entry });
                    }
                }
                NodeKind::Text => self.text(value, context, entry),
                NodeKind::List => {
                    let items = value.children();
                    match context {
                        Context::Structs(param) => {
                            for item in items {
                                self.fields(item, &param.fields);
                            }
                        }
                        _ => self.waiting.extend(items.map(|item| (item, context))),
                    }
                }
                NodeKind::Parens | NodeKind::Map if matches!(context, Context::Unknown | Context::Output) => {
                    let values = value.entries().filter_map(Node::value);
                    self.waiting.extend(values.map(|value| (value, Context::Unknown)));
                }
                _ => {}
            }
        }
    }

    fn call(&mut self, value: Node<'t>, context: Context<'r>, entry: Option<usize>) {
        let (Some(kind), Some(body)) = (value.name(), value.body()) else { return };
        let takes_nodes = !matches!(context, Context::Output);
        if let Some(removed) = removed(kind, self.registry).filter(|_| takes_nodes) {
            self.found.old.push(Old { node: value, removed, spot: spot(context, removed), entry });
            let inside = if removed.is_formula() { Context::Operand } else { Context::Port };
            for field in body.entries() {
                // The stops of a ramp are no wires.
                let is_port = !matches!(removed.rewrite, Rewrite::Kind { added, .. }
                    if field.key_text().is_some_and(|key| added.iter().any(|(name, _)| *name == key)));
                self.waiting.extend(field.value().filter(|_| is_port).map(|value| (value, inside)));
            }
            return;
        }
        match self.registry.info(kind).filter(|_| takes_nodes) {
            Some(info) => self.kind(body, info),
            None if matches!(kind, "Use" | "Each") => {
                for field in body.entries() {
                    let (Some(key), Some(value)) = (field.key_text(), field.value()) else { continue };
                    match key.as_str() {
                        "with" => {
                            let given = value.entries().filter_map(Node::value);
                            self.waiting.extend(given.map(|value| (value, Context::Port)));
                        }
                        "ids" => self.waiting.push((value, Context::Unknown)),
                        _ => {}
                    }
                }
            }
            None => {
                let values = body.entries().filter_map(Node::value);
                self.waiting.extend(values.map(|value| (value, Context::Unknown)));
            }
        }
    }

    fn kind(&mut self, body: Node<'t>, info: &'r KindInfo) {
        self.fields(body, &info.fields);
    }

    fn fields(&mut self, body: Node<'t>, fields: &'r [FieldInfo]) {
        for item in body.entries() {
            let (Some(key), Some(value)) = (item.key_text(), item.value()) else { continue };
            let Some(field) = fields.iter().find(|field| field.name == key) else { continue };
            match &field.role {
                Role::Port(_) => self.waiting.push((value, Context::Port)),
                Role::Param(param) if !param.fields.is_empty() => self.waiting.push((value, Context::Structs(param))),
                Role::Param(_) => {}
            }
        }
    }

    fn text(&mut self, value: Node<'t>, context: Context<'r>, entry: Option<usize>) {
        let holds = match context {
            Context::Operand => return,
            Context::Entry(_) | Context::Port | Context::Structs(_) => Holds::Formula,
            Context::Output => Holds::Output,
            Context::Unknown => Holds::Path,
        };
        let Some(text) = text_of(value) else { return };
        let name = text.split('.').next().unwrap_or_default();
        let is_formula = super::scope::formula_of(&text).is_some() && holds != Holds::Path;
        if is_formula || (is_path(&text) && self.scope.has(name)) {
            self.found.wires.push(Wire { range: value.range(), text, holds, entry });
        }
    }
}
