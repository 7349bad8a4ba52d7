//! Brackets as pieces of text: things with their comments and commas.
use shibo_graph::syntax::{Node, TokenKind};
use std::ops::Range;

/// A thing between brackets, with everything up to the next thing.
#[derive(Clone, Debug)]
pub(super) struct Item<'t> {
    /// Blanks and comments above the thing.
    pub(super) lead: &'t str,
    /// The comments above it.
    pub(super) comments: Vec<&'t str>,
    /// The thing.
    pub(super) core: &'t str,
    /// Text between the thing and its comma.
    pub(super) gap: &'t str,
    /// True if a comma follows.
    pub(super) comma: bool,
    /// Text after the comma on the same line: comments.
    pub(super) trail: &'t str,
}

/// The text between two brackets.
#[derive(Clone, Debug)]
pub(super) struct Bracket<'t> {
    /// Text up to the opening bracket, which ends it: the word of a node.
    pub(super) open: &'t str,
    pub(super) items: Vec<Item<'t>>,
    /// Blanks and comments above the closing bracket.
    pub(super) tail: &'t str,
    /// The comments in it.
    pub(super) tail_comments: Vec<&'t str>,
    /// The closing bracket.
    pub(super) close: &'t str,
    /// Blanks at the beginning of the line with the opening bracket.
    pub(super) indent: &'t str,
}

impl<'t> Bracket<'t> {
    /// The pieces of a value with brackets, which must be readable.
    pub(super) fn of(value: Node<'t>) -> Option<Self> {
        let (tree, text) = (value.tree(), value.tree().text());
        let body = value.body().unwrap_or(value);
        let (first, last) = (body.tokens().first()?, body.tokens().last()?);
        if first.kind() != TokenKind::Open || last.kind() != TokenKind::Close || first == last {
            return None;
        }
        let comments = |range: Range<usize>| tree.comments_in(range).collect::<Vec<_>>();
        let texts =
            |ranges: Vec<Range<usize>>| ranges.into_iter().map(|range| text[range].trim_end()).collect::<Vec<_>>();
        let things: Vec<Node<'t>> = body.children().collect();
        let mut items = Vec::with_capacity(things.len());
        let mut at = first.end();
        for (index, thing) in things.iter().enumerate() {
            let range = thing.range();
            let next = things.get(index + 1).map_or(last.start(), |next| next.range().start);
            let comma = tree.tokens().get(thing.token_range().end).filter(|token| token.kind() == TokenKind::Comma);
            let gap = comma.map_or(range.end, |comma| comma.start());
            let after = comma.map_or(range.end, |comma| comma.end());
            // Comments that begin on the line of the comma.
            let same_line = |end: usize, comment: &Range<usize>| !text[end..comment.start].contains('\n');
            let end = comments(after..next)
                .iter()
                .fold(after, |end, comment| if same_line(end, comment) { comment.end } else { end });
            items.push(Item {
                lead: &text[at..range.start],
                comments: texts(comments(at..range.start)),
                core: &text[range.clone()],
                gap: &text[range.end..gap],
                comma: comma.is_some(),
                trail: &text[after..end],
            });
            at = end;
        }
        let line = text[..value.range().start].rfind('\n').map_or(0, |newline| newline + 1);
        Some(Self {
            open: &text[value.range().start..first.end()],
            items,
            tail: &text[at..last.start()],
            tail_comments: texts(comments(at..last.start())),
            close: &text[last.range()],
            indent: blanks(&text[line..]),
        })
    }

    /// The blanks in front of a thing that begins a line.
    pub(super) fn inner_indent(&self) -> String {
        let of = |item: &Item<'t>| item.lead.rfind('\n').map(|newline| blanks(&item.lead[newline + 1..]).to_owned());
        self.items.iter().find_map(of).unwrap_or_else(|| format!("{}  ", self.indent))
    }
}

/// The blanks at the beginning of a line.
fn blanks(line: &str) -> &str {
    &line[..line.len() - line.trim_start_matches([' ', '\t']).len()]
}

/// Merges the comments of a thing. Comments that one side removed are left out; of a comment that both changed, both versions
/// stay. `None` if those of ours stay as they are.
pub(super) fn merged<'t>(base: &[&'t str], ours: &[&'t str], theirs: &[&'t str]) -> Option<Vec<&'t str>> {
    if theirs == base || theirs == ours {
        return None;
    }
    if ours == base {
        return Some(theirs.to_vec());
    }
    let kept = ours.iter().filter(|comment| !base.contains(comment) || theirs.contains(comment));
    let new = theirs.iter().filter(|comment| !base.contains(comment) && !ours.contains(comment));
    let all: Vec<&str> = kept.chain(new).copied().collect();
    (all != ours).then_some(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_graph::syntax::Tree;

    #[test]
    fn divides_text_between_brackets() {
        let text = "(\n  // one\n  a: 1, // of a\n  b: 2 /* x */, c: 3\n  // end\n)";
        let tree = Tree::parse(text);
        let bracket = Bracket::of(tree.value().unwrap()).unwrap();
        let items: Vec<_> =
            bracket.items.iter().map(|item| (item.comments.len(), item.core, item.gap, item.trail)).collect();
        assert_eq!(items, [(1, "a: 1", "", " // of a"), (0, "b: 2", " /* x */", ""), (0, "c: 3", "", "")]);
        assert_eq!((bracket.open, bracket.inner_indent().as_str()), ("(", "  "));
        assert_eq!(bracket.tail_comments, ["// end"]);
        let joined = bracket.items.iter().fold(bracket.open.to_owned(), |out, item| {
            out + item.lead + item.core + item.gap + if item.comma { "," } else { "" } + item.trail
        });
        assert_eq!(joined + bracket.tail + bracket.close, text);
    }

    #[test]
    fn keeps_comments_of_both_sides() {
        assert_eq!(merged(&["a"], &["a"], &["a", "b"]), Some(vec!["a", "b"]));
        assert_eq!(merged(&["a"], &["b"], &["a"]), None);
        assert_eq!(merged(&["a"], &["b"], &["c"]), Some(vec!["b", "c"]));
        assert_eq!(merged(&["a"], &["b"], &[]), None);
        assert_eq!(merged(&["a", "x"], &["a", "b", "x"], &["x"]), Some(vec!["b", "x"]));
    }
}
