//! Rewrites graph files from kinds and arguments that are replaced to formulas and to other kinds.
//!
//! The rewriting is from text to text: what does not change stays byte for byte. `kinds` is the table of the kinds and
//! of the formulas that they become, so a later change of a kind is a row there. `words`, `formula`, `fold`, `terms` and
//! `bounds` compute with formulas. `scope`, `places` and `comments` read a graph. `operands`, `numbers` and `convert`
//! make the formula of a node. `trees` rewrites the nodes of trees. `readers` and `plan` decide which formulas are
//! written where they are read. `graph`, `write` and `edits` write the result.
//!
//! A formula keeps the order of the operations of the nodes, so that pictures keep their bits. A node becomes a part of
//! the only formula that reads it if its result is always finite (a result that is not counts as 0 at its node), if it
//! has no comment, and if the whole stays short.
mod bounds;
mod comments;
mod convert;
mod edits;
mod fold;
mod formula;
mod graph;
mod kinds;
mod numbers;
mod operands;
mod places;
mod plan;
mod readers;
mod scope;
mod single;
mod terms;
#[cfg(test)]
mod tests;
mod trees;
mod words;
mod write;

use shibo_graph::syntax::{self, Node, SyntaxError, Tree};
use shibo_node::registry::Registry;
use std::ops::Range;

/// True for a field that nodes of a kind had in earlier versions, and that [`migrate`] replaces.
pub fn is_retired_field(kind: &str, field: &str) -> bool {
    trees::is_retired_field(kind, field)
}

/// A rewritten file.
#[derive(Clone, Debug, PartialEq)]
pub struct Migration {
    /// The new text.
    pub text: String,
    /// A rewritten part, with its place in the old text.
    pub changes: Vec<Change>,
    /// A part that was not rewritten, or that has another result than before.
    pub warnings: Vec<Change>,
}

/// Something about a place of the old text.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The place.
    pub range: Range<usize>,
    /// The message.
    pub message: String,
}

/// Rewrites a graph file. A text without kinds that are replaced stays as it is. A text that was laid out is laid out
/// again.
///
/// # Errors
/// The mistakes of a text that is not valid RON.
pub fn migrate(text: &str, registry: &Registry) -> Result<Migration, Vec<SyntaxError>> {
    let tree = Tree::parse(text);
    if !tree.errors().is_empty() {
        return Err(tree.errors().to_vec());
    }
    let mut migration = Migration { text: text.to_owned(), changes: Vec::new(), warnings: Vec::new() };
    // Local graphs lie inside the graph of the file, and no edit of one touches another.
    let mut graphs = scope::graphs(&tree);
    graphs.sort_by_key(|body| std::cmp::Reverse(body.range().start));
    let mut all = edits::Edits::default();
    for body in graphs {
        let rewritten = graph::rewrite(body, registry);
        migration.changes.extend(rewritten.changes);
        migration.warnings.extend(rewritten.warnings);
        all.extend(rewritten.edits);
    }
    all.sort();
    let mut rewritten = all.apply(text, 0..text.len());
    // Trees are rewritten in the new text; their messages name places of the old one.
    let trees = trees::rewrite(&tree);
    migration.changes.extend(trees.changes);
    migration.warnings.extend(trees.warnings);
    if !trees.edits.is_empty() {
        let mut edits = trees::rewrite(&Tree::parse(&*rewritten)).edits;
        edits.sort();
        rewritten = edits.apply(&rewritten, 0..rewritten.len());
    }
    if rewritten == text {
        return Ok(migration);
    }
    let laid_out = syntax::format(text).is_ok_and(|formatted| formatted == text);
    migration.text = if laid_out { syntax::format(&rewritten).unwrap_or(rewritten) } else { rewritten };
    migration.changes.sort_by_key(|change| change.range.start);
    migration.warnings.sort_by_key(|warning| warning.range.start);
    Ok(migration)
}

/// The replacement of a node, given its text; see [`rewrite_of`].
pub fn successor(node: &str, registry: &Registry) -> Option<String> {
    let tree = Tree::parse(node);
    if tree.errors().is_empty() { rewrite_of(tree.value()?, registry) } else { None }
}

/// The replacement of a node, as it stands in a file: a formula in quotes, or another node. `None` if the
/// kind is not replaced, or if the node cannot be rewritten.
pub fn rewrite_of(node: Node<'_>, registry: &Registry) -> Option<String> {
    single::replacement(node, registry)
}
