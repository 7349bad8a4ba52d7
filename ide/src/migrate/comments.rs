//! Comments and blank lines between the entries of `nodes`.
use super::scope::Scope;
use shibo_graph::syntax::{Node, NodeKind};
use std::ops::Range;

/// The texts around an entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Surroundings {
    /// A comment of its own lines stands directly above.
    pub(super) comment_above: bool,
    /// A blank line or a comment separates it from the entry before, or it is the first one.
    pub(super) begins: bool,
    /// A comment follows in its last line.
    pub(super) comment_behind: bool,
    /// The paragraph, up to the blank line above, has a comment.
    pub(super) described: bool,
}

/// The surroundings of all entries of a graph.
pub(super) fn surroundings(scope: &Scope<'_>) -> Vec<Surroundings> {
    let tree = scope.body.tree();
    let text = tree.text();
    let mut found: Vec<Surroundings> = Vec::with_capacity(scope.entries.len());
    let mut end = scope.nodes.map_or(0, |nodes| nodes.range().start + 1);
    for entry in &scope.entries {
        let range = entry.node.range();
        let mut around = Surroundings::default();
        // The comma of the entry before stands in the gap.
        let gap = end.min(range.start)..range.start;
        let mut last = gap.start;
        let mut described = found.last().is_some_and(|before| before.described);
        for comment in tree.comments_in(gap.clone()) {
            let before = &text[last..comment.start];
            if !before.contains('\n') && last == gap.start && !found.is_empty() {
                if let Some(entry) = found.last_mut() {
                    entry.comment_behind = true;
                }
            } else {
                around.comment_above = true;
                around.begins = true;
            }
            described &= !is_blank(before);
            described |= around.comment_above;
            last = comment.end;
        }
        let blank = is_blank(&text[last..gap.end]);
        // A comment above a blank line describes what stands above it, or the whole section.
        around.comment_above &= !blank;
        around.begins |= blank || found.is_empty();
        around.described = described && !blank;
        found.push(around);
        end = range.end;
    }
    let close = scope.nodes.map_or(end, |nodes| nodes.range().end);
    let behind = |comment: Range<usize>| !text[end..comment.start].contains('\n');
    if let Some(last) = found.last_mut() {
        last.comment_behind = tree.comments_in(end..close.max(end)).next().is_some_and(behind);
    }
    found
}

/// True if a text has an empty line.
fn is_blank(gap: &str) -> bool {
    gap.matches('\n').count() > 1
}

/// The comments inside a value, and its note, as lines above it. Those inside other ranges stay there.
pub(super) fn lines_of(node: Node<'_>, others: &[Range<usize>]) -> Vec<String> {
    let tree = node.tree();
    let is_own = |comment: &Range<usize>| !others.iter().any(|other| other.contains(&comment.start));
    let comments = tree.comments_in(node.range()).filter(is_own);
    let mut lines: Vec<String> = comments.map(|range| tree.text()[range].trim_end().to_owned()).collect();
    let note = node.body().and_then(|body| body.entry("note")).and_then(Node::value);
    let note = note.filter(|note| note.kind() == NodeKind::Text).and_then(Node::string);
    lines.extend(note.iter().flat_map(|note| note.lines()).map(|line| format!("// {}", line.trim())));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_graph::syntax::Tree;

    #[test]
    fn sees_comments_and_paragraphs() {
        let text = r#"(nodes: { // first
    // All of it.

    "a": A(),
    "b": B(), // behind
    // Above.
    "c": C(
      // Inside.
      x: 1,
    ),
    "d": D(),

    "e": E(), // last
})"#;
        let tree = Tree::parse(text);
        let scope = Scope::new(tree.value().expect("a value"));
        let found = surroundings(&scope);
        let of = |f: fn(&Surroundings) -> bool| found.iter().map(f).collect::<Vec<_>>();
        assert_eq!(of(|s| s.comment_above), [false, false, true, false, false]);
        assert_eq!(of(|s| s.comment_behind), [false, true, false, false, true]);
        assert_eq!(of(|s| s.begins), [true, false, true, false, true]);
        assert_eq!(of(|s| s.described), [false, false, true, true, false]);
        assert_eq!(lines_of(scope.entries[2].value, &[]), ["// Inside."]);
    }
}
