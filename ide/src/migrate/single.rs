//! Rewrites one node without its graph.
use super::convert::convert;
use super::edits::Edits;
use super::formula::Formula;
use super::kinds::removed;
use super::operands::Converter;
use super::places::{Old, Spot};
use super::scope::Scope;
use super::terms::call;
use super::words::{Base, Name, Word, closing};
use super::write::kind_edits;
use shibo_graph::syntax::{Node, NodeKind};
use shibo_node::registry::Registry;

/// The replacement of a node; see [`rewrite_of`](super::rewrite_of).
pub(super) fn replacement(node: Node<'_>, registry: &Registry) -> Option<String> {
    let tree = node.tree();
    // No names: the graph around the node is not read.
    let scope = Scope::new(node);
    let mut converter = Converter::new(&scope, registry);
    // A kind may have no brackets.
    let is_node = |inner: &Node<'_>| inner.kind() == NodeKind::Call || inner.index() == node.index();
    let calls: Vec<Node<'_>> = node.descendants().filter(is_node).collect();
    let mut edits = Edits::default();
    for inner in calls.into_iter().rev() {
        let Some(removed) = inner.name().and_then(|kind| removed(kind, registry)) else { continue };
        let old = Old { node: inner, removed, spot: Spot::Operand, entry: None };
        if convert(&mut converter, &old).is_err() {
            return None;
        }
        match converter.made.get(&inner.index()).and_then(|outputs| outputs.first()) {
            Some(formula) => edits.replace(inner.range(), written(formula)),
            None => kind_edits(&old, &mut edits),
        }
    }
    removed(node.name()?, registry)?;
    edits.sort();
    Some(edits.apply(tree.text(), node.range()))
}

/// A formula in quotes, with all limits.
fn written(formula: &Formula) -> String {
    let mut words = formula.words.clone();
    let limit = |word: &Word| matches!(word, Word::Function(name) if name == "saturated" || name == "positive");
    while let Some(at) = words.iter().position(limit) {
        let Some(close) = closing(&words, at + 1) else { break };
        let inner = Formula { words: words[at + 2..close].to_vec() };
        let saturated = matches!(&words[at], Word::Function(name) if name == "saturated");
        let (zero, one) = (Formula::number("0"), Formula::number("1"));
        let limited = if saturated { call("clamp", vec![inner, zero, one]) } else { call("max", vec![inner, zero]) };
        words.splice(at..=close, limited.words);
    }
    let name_of = |name: &Name| match &name.base {
        Base::Text(text) | Base::New(text) => format!("{text}{}", name.rest),
        Base::Value(_) => String::new(),
    };
    format!("\"= {}\"", Formula { words }.text(&name_of))
}
