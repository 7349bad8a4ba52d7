//! The tree of a text.
use super::fault::SyntaxError;
use super::lex::{Token, TokenKind};
use super::nodes::{NodeData, NodeKind};
use super::{MAX_NESTING, literal, parse};
use std::ops::Range;
use std::sync::Arc;

/// A text and its tree.
#[derive(Debug)]
pub struct Tree {
    text: Arc<str>,
    tokens: Vec<Token>,
    comments: Vec<(u32, u32)>,
    nodes: Vec<NodeData>,
    errors: Vec<SyntaxError>,
}

/// Kind of a piece of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceKind {
    /// Spaces and ends of lines.
    Blank,
    /// A comment, without its line break.
    Comment,
    /// A token.
    Token(TokenKind),
}

/// A piece of text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextPiece {
    /// The kind.
    pub kind: PieceKind,
    /// The bytes of the piece.
    pub range: Range<usize>,
}

impl Tree {
    /// Parses a text.
    pub fn parse(text: impl Into<Arc<str>>) -> Self {
        Self::parse_nested(text, MAX_NESTING)
    }

    /// Parses with a different limit for the depth of brackets, at most [`MAX_NESTING`].
    pub fn parse_nested(text: impl Into<Arc<str>>, nesting: usize) -> Self {
        let text = text.into();
        let parsed = parse::parse(&text, nesting.min(MAX_NESTING));
        let (tokens, comments) = (parsed.tokens, parsed.comments);
        Self { text, tokens, comments, nodes: parsed.nodes, errors: parsed.errors }
    }

    /// The text.
    pub fn text(&self) -> &Arc<str> {
        &self.text
    }

    /// The mistakes, in the order of the text; none if and only if the text is RON.
    pub fn errors(&self) -> &[SyntaxError] {
        &self.errors
    }

    /// The tokens. Blanks and comments stand between them.
    pub fn tokens(&self) -> &[Token] {
        &self.tokens
    }

    /// The bytes of the comments, in order. A comment does not include its line break.
    pub fn comments(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.comments.iter().map(|&(start, end)| start as usize..end as usize)
    }

    /// The comments within a range of the text.
    pub fn comments_in(&self, range: Range<usize>) -> impl Iterator<Item = Range<usize>> + '_ {
        let first = self.comments.partition_point(|&(start, _)| (start as usize) < range.start);
        let comments = self.comments[first..].iter().map(|&(start, end)| start as usize..end as usize);
        comments.take_while(move |comment| comment.end <= range.end)
    }

    /// All pieces of the text in order; their concatenation is the text.
    pub fn pieces(&self) -> Vec<TextPiece> {
        let tokens = self.tokens.iter().map(|token| (PieceKind::Token(token.kind()), token.range()));
        let mut solid: Vec<_> = tokens.chain(self.comments().map(|range| (PieceKind::Comment, range))).collect();
        solid.sort_by_key(|(_, range)| range.start);
        let mut pieces = Vec::with_capacity(solid.len() * 2 + 1);
        let mut end = 0;
        for (kind, range) in solid {
            if end < range.start {
                pieces.push(TextPiece { kind: PieceKind::Blank, range: end..range.start });
            }
            end = range.end;
            pieces.push(TextPiece { kind, range });
        }
        if end < self.text.len() {
            pieces.push(TextPiece { kind: PieceKind::Blank, range: end..self.text.len() });
        }
        pieces
    }

    /// The index of the token that contains the byte at `offset`.
    pub fn token_at(&self, offset: usize) -> Option<usize> {
        let index = self.tokens.partition_point(|token| token.end() <= offset);
        self.tokens.get(index).filter(|token| token.start() <= offset).map(|_| index)
    }

    /// The index of the last token that begins before `offset`.
    pub fn token_before(&self, offset: usize) -> Option<usize> {
        self.tokens.partition_point(|token| token.start() < offset).checked_sub(1)
    }

    /// Returns true if `offset` is inside a comment, or at the end of a `//` comment.
    pub fn is_comment(&self, offset: usize) -> bool {
        let index = self.comments.partition_point(|&(_, end)| (end as usize) < offset);
        self.comments.get(index).is_some_and(|&(start, end)| {
            let line = self.text[start as usize..].starts_with("//");
            (start as usize) < offset && (offset < end as usize || line)
        })
    }

    /// The root.
    pub fn root(&self) -> Node<'_> {
        Node { tree: self, index: 0 }
    }

    /// The value of the whole text.
    pub fn value(&self) -> Option<Node<'_>> {
        self.root().children().find(|child| child.kind() != NodeKind::Attribute)
    }

    /// All nodes, parents before their children, in the order of the text.
    pub fn nodes(&self) -> impl Iterator<Item = Node<'_>> {
        (0..self.nodes.len()).map(|index| self.node(index))
    }

    /// The node with this index.
    pub fn node(&self, index: usize) -> Node<'_> {
        Node { tree: self, index: super::lex::short(index.min(self.nodes.len().saturating_sub(1))) }
    }

    /// The smallest node that covers a range, which may be empty.
    pub fn covering(&self, range: Range<usize>) -> Node<'_> {
        // Nodes are ordered by their start.
        let (mut low, mut high) = (0, self.nodes.len());
        while low < high {
            let middle = low + (high - low) / 2;
            if self.node(middle).range().start <= range.start {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        let last = self.node(low.saturating_sub(1));
        let covers = |node: &Node<'_>| node.range().end >= range.end && node.range().start <= range.start;
        std::iter::successors(Some(last), |node| node.parent()).find(covers).unwrap_or(self.root())
    }
}

/// A node of a tree.
#[derive(Clone, Copy)]
pub struct Node<'t> {
    tree: &'t Tree,
    index: u32,
}

impl PartialEq for Node<'_> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.tree, other.tree) && self.index == other.index
    }
}

impl Eq for Node<'_> {}

impl std::fmt::Debug for Node<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}@{:?}", self.kind(), self.range())
    }
}

impl<'t> Node<'t> {
    fn data(self) -> &'t NodeData {
        &self.tree.nodes[self.index as usize]
    }

    /// The tree it belongs to.
    pub fn tree(self) -> &'t Tree {
        self.tree
    }

    /// Its index in [`Tree::nodes`].
    pub fn index(self) -> usize {
        self.index as usize
    }

    /// The kind of the node.
    pub fn kind(self) -> NodeKind {
        self.data().kind
    }

    /// Returns true if the node contains a mistake.
    pub fn is_broken(self) -> bool {
        self.data().broken
    }

    /// Returns true if an unreadable part is a direct child.
    pub fn is_torn(self) -> bool {
        self.is_broken() && self.children().any(|child| child.kind() == NodeKind::Error)
    }

    /// The bytes from its first to its last token. A missing value covers the blank in its place.
    pub fn range(self) -> Range<usize> {
        let (lo, hi) = (self.data().lo as usize, self.data().hi as usize);
        let (tokens, len) = (&self.tree.tokens, self.tree.text.len());
        if self.kind() == NodeKind::Root {
            return 0..len;
        }
        if lo == hi {
            let next = tokens.get(lo).map_or(len, |token| token.start());
            // A node does not begin before its parent.
            let first = self.parent().is_some_and(|outer| outer.index > 0 && outer.data().lo == self.data().lo);
            return lo.checked_sub(1).filter(|_| !first).map_or(next, |before| tokens[before].end())..next;
        }
        tokens[lo].start()..tokens[hi - 1].end()
    }

    /// Its text, including the text between its tokens.
    pub fn text(self) -> &'t str {
        &self.tree.text[self.range()]
    }

    /// The indices of its tokens.
    pub fn token_range(self) -> Range<usize> {
        self.data().lo as usize..self.data().hi as usize
    }

    /// Its tokens.
    pub fn tokens(self) -> &'t [Token] {
        &self.tree.tokens[self.token_range()]
    }

    /// The parent.
    pub fn parent(self) -> Option<Self> {
        (self.index > 0).then(|| Self { index: self.data().parent, ..self })
    }

    /// The node itself, its parent, and so on.
    pub fn ancestors(self) -> impl Iterator<Item = Self> {
        std::iter::successors(Some(self), |node| node.parent())
    }

    /// The direct children.
    pub fn children(self) -> impl Iterator<Item = Self> {
        let end = self.data().next;
        let within = move |index: u32| (index < end).then_some(Self { index, ..self });
        std::iter::successors(within(self.index + 1), move |child| within(child.data().next))
    }

    /// The node and all nodes inside it.
    pub fn descendants(self) -> impl Iterator<Item = Self> {
        (self.index..self.data().next).map(move |index| Self { index, ..self })
    }

    /// The direct children that are entries.
    pub fn entries(self) -> impl Iterator<Item = Self> {
        self.children().filter(|child| child.kind() == NodeKind::Entry)
    }

    /// The entry with this key.
    pub fn entry(self, key: &str) -> Option<Self> {
        self.entries().find(|entry| entry.key_text().as_deref() == Some(key))
    }

    /// The key of an entry.
    pub fn key(self) -> Option<Self> {
        self.children().next().filter(|_| self.kind() == NodeKind::Entry)
    }

    /// The key of an entry without its quotes.
    pub fn key_text(self) -> Option<String> {
        let key = self.key()?;
        key.string().or_else(|| Some(key.text().trim_start_matches("r#").to_owned()))
    }

    /// The value of an entry. It may be [`Missing`](NodeKind::Missing), or an [`Error`](NodeKind::Error) that contains
    /// the value.
    pub fn value(self) -> Option<Self> {
        self.children().nth(1).filter(|_| self.kind() == NodeKind::Entry)
    }

    /// The word of a call, or of a single word.
    pub fn name(self) -> Option<&'t str> {
        let token = self.tokens().first().filter(|_| matches!(self.kind(), NodeKind::Call | NodeKind::Word))?;
        Some(&self.tree.text[token.range()])
    }

    /// The brackets of a call.
    pub fn body(self) -> Option<Self> {
        self.children().next().filter(|_| self.kind() == NodeKind::Call)
    }

    /// The decoded text of a string.
    pub fn string(self) -> Option<String> {
        (self.kind() == NodeKind::Text).then(|| literal::decode(self.text())).flatten()
    }
}
