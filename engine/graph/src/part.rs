//! Values of a text that know their places.
use crate::diagnostics::{Code, Diagnostic, FileId, Span};
use crate::syntax::{self, Node, NodeKind, Token, TokenKind as Kind, Tree};
use std::sync::Arc;

/// A text with its tree. The text may be made from another text by substituting values of parameters; places always
/// refer to the original text.
#[derive(Debug)]
pub(super) struct Src {
    file: FileId,
    tree: Tree,
    /// The origins of the pieces of the text; empty for an original text.
    pieces: Vec<PieceOrigin>,
}

/// The origin of a range of bytes in a made text.
#[derive(Clone, Debug)]
pub(super) struct PieceOrigin {
    /// End of the range in the made text, exclusive.
    pub(super) end: usize,
    /// Place in the original text.
    pub(super) span: Span,
    /// True if copied byte by byte.
    pub(super) copied: bool,
    /// Other relevant places, if the value came from elsewhere.
    pub(super) related: Vec<(Span, &'static str)>,
    /// The value was given outside the graph file that uses it.
    pub(super) given: bool,
}

impl Src {
    /// An original text.
    pub(super) fn new(file: FileId, tree: Tree) -> Arc<Self> {
        Arc::new(Self { file, tree, pieces: Vec::new() })
    }

    /// A made text.
    pub(super) fn made(file: FileId, text: String, pieces: Vec<PieceOrigin>) -> Arc<Self> {
        Arc::new(Self { file, tree: Tree::parse(text), pieces })
    }

    /// The tree of the text.
    pub(super) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The value of the whole text; `None` if it is empty.
    pub(super) fn whole(self: &Arc<Self>) -> Option<SyntaxValue> {
        let value = self.tree.value().filter(|value| value.kind() != NodeKind::Missing)?;
        Some(SyntaxValue::of(self, value))
    }

    fn piece(&self, offset: usize) -> Option<(&PieceOrigin, usize)> {
        let index = self.pieces.partition_point(|p| p.end <= offset).min(self.pieces.len().checked_sub(1)?);
        let start = if index == 0 { 0 } else { self.pieces[index - 1].end };
        Some((&self.pieces[index], start))
    }

    fn span(&self, start: usize, end: usize) -> Span {
        let (Some((first, first_start)), Some((last, last_start))) =
            (self.piece(start), self.piece(end.saturating_sub(1).max(start)))
        else {
            return Span { file: self.file, start, end };
        };
        let from = if first.copied { first.span.start + (start - first_start) } else { first.span.start };
        if first.span.file != last.span.file {
            return first.span;
        }
        let to = if last.copied { last.span.start + (end - last_start) } else { last.span.end };
        Span { file: first.span.file, start: from, end: to.max(from) }
    }
}

/// A value, key or word of a text: a range of tokens.
#[derive(Clone, Debug)]
pub(super) struct SyntaxValue {
    src: Arc<Src>,
    lo: usize,
    hi: usize,
    /// The index of its node; `None` for a single token.
    node: Option<usize>,
    /// The bytes of a literal that errors refer to, if not all.
    within: Option<(usize, usize)>,
}

/// A key and its value.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// The key without its quotes.
    pub(super) name: String,
    /// The key with its place.
    pub(super) key: SyntaxValue,
    /// The value.
    pub(super) value: SyntaxValue,
}

/// The form of a value.
#[derive(Debug)]
pub(super) enum Shape {
    /// `(a: 1)`, or `()`.
    Named(Vec<Entry>),
    /// `{"a": 1}`.
    Map(Vec<Entry>),
    /// `(1, 2)`.
    Tuple(Vec<SyntaxValue>),
    /// `[1, 2]`.
    List(Vec<SyntaxValue>),
    /// A string, decoded.
    Text(String),
    /// A number.
    Number(f64),
    /// A word by itself.
    Word(String),
    /// A word with brackets.
    Call,
    /// A byte string, with a `b` before the quote.
    Bytes,
    /// An unreadable or missing value, already reported.
    Broken,
    /// Anything else.
    Other,
}

impl Shape {
    /// The form in words, for messages.
    pub(super) fn describe(&self) -> &'static str {
        match self {
            Self::Named(fields) if fields.is_empty() => "nothing in brackets",
            Self::Named(_) => "named fields in brackets",
            Self::Map(_) => "a map",
            Self::Tuple(_) => "values in brackets",
            Self::List(_) => "a list",
            Self::Text(_) => "a text",
            Self::Number(_) => "a number",
            Self::Word(word) if word == "true" || word == "false" => "true or false",
            Self::Word(_) => "a word",
            Self::Call => "a word with brackets",
            Self::Bytes => "bytes",
            Self::Broken => "something that cannot be read",
            Self::Other => "something else",
        }
    }
}

impl SyntaxValue {
    /// The value of a node; for `Some(value)` the inner value.
    fn of(src: &Arc<Src>, mut node: Node<'_>) -> Self {
        while let Some(inner) = in_some(node) {
            node = inner;
        }
        let tokens = node.token_range();
        Self { src: src.clone(), lo: tokens.start, hi: tokens.end, node: Some(node.index()), within: None }
    }

    fn node(&self) -> Option<Node<'_>> {
        self.node.map(|node| self.src.tree.node(node))
    }

    /// Returns true if a part of the value could not be read.
    pub(super) fn is_broken(&self) -> bool {
        self.node().is_some_and(Node::is_broken)
    }

    /// The text, including comments between its tokens.
    pub(super) fn str(&self) -> &str {
        match (self.tokens().first(), self.tokens().last()) {
            (Some(first), Some(last)) => &self.src.tree.text()[first.start()..last.end()],
            _ => "",
        }
    }

    /// The place in the original text.
    pub(super) fn span(&self) -> Span {
        if let Some((from, to)) = self.within {
            return self.sub_span(from, to);
        }
        match (self.tokens().first(), self.tokens().last()) {
            (Some(first), Some(last)) => self.src.span(first.start(), last.end()),
            _ => {
                let at = self.node().map_or(0, |node| node.range().start);
                self.src.span(at, at)
            }
        }
    }

    /// The same value, whose errors refer to bytes `from..to` of its text.
    pub(super) fn at(&self, from: usize, to: usize) -> Self {
        Self { within: Some((from, to)), ..self.clone() }
    }

    /// The place of bytes `from..to` of this value's text.
    pub(super) fn sub_span(&self, from: usize, to: usize) -> Span {
        let start = self.tokens().first().map_or(0, |t| t.start());
        self.src.span(start + from, start + to)
    }

    /// The bytes that errors refer to, if these are only a part of the value.
    pub(super) fn within(&self) -> Option<&str> {
        self.within.and_then(|(from, to)| self.str().get(from..to))
    }

    /// The text of the node whose kind this word is, with its fields.
    pub(super) fn call(&self) -> &str {
        match self.tokens().first() {
            Some(word) => self.src.tree.covering(word.start()..word.end()).text(),
            None => "",
        }
    }

    /// The file of the text.
    pub(super) fn file(&self) -> FileId {
        self.src.file
    }

    /// Its tokens.
    pub(super) fn tokens(&self) -> &[Token] {
        &self.src.tree.tokens()[self.lo..self.hi]
    }

    /// The tokens as values.
    pub(super) fn words(&self) -> impl Iterator<Item = (Kind, SyntaxValue)> + '_ {
        (self.lo..self.hi).map(|i| (self.src.tree.tokens()[i].kind(), self.token(i)))
    }

    /// The number of words with brackets in the value.
    pub(super) fn calls(&self) -> usize {
        let is_call = |pair: &&[Token]| pair[0].kind() == Kind::Ident && pair[1].kind() == Kind::Open;
        self.tokens().windows(2).filter(is_call).count()
    }

    /// Returns true if it begins with the same token as another value.
    pub(super) fn begins_with(&self, other: &SyntaxValue) -> bool {
        Arc::ptr_eq(&self.src, &other.src) && self.lo == other.lo
    }

    /// Byte offset of a token of [`tokens`](Self::tokens) within [`str`](Self::str).
    pub(super) fn offset(&self, token: &Token) -> usize {
        token.start() - self.tokens().first().map_or(0, |t| t.start())
    }

    /// An error at this value.
    pub(super) fn error(&self, code: Code, message: impl Into<String>) -> Diagnostic {
        let diagnostic = Diagnostic::new(code, self.span(), message);
        let related = self.piece().map(|piece| piece.related.iter()).into_iter().flatten();
        let others = related.filter(|(span, _)| *span != diagnostic.span).copied().collect::<Vec<_>>();
        others.into_iter().fold(diagnostic, |diagnostic, (span, message)| diagnostic.related(span, message))
    }

    /// Returns true if the value was given outside the graph file that uses it.
    pub(super) fn is_given(&self) -> bool {
        self.piece().is_some_and(|piece| piece.given)
    }

    /// The origin of the first token, if the text was made.
    fn piece(&self) -> Option<&PieceOrigin> {
        let first = self.tokens().first()?;
        self.src.piece(first.start()).map(|(piece, _)| piece)
    }

    /// The leading word, if any, and the brackets after it, if any.
    pub(super) fn head(&self) -> Option<(SyntaxValue, Option<SyntaxValue>)> {
        let node = self.node()?;
        let body = match node.kind() {
            NodeKind::Word => None,
            NodeKind::Call => node.body().map(|body| Self::of(&self.src, body)),
            _ => return None,
        };
        Some((self.token(self.lo), body))
    }

    /// The form of the value.
    pub(super) fn shape(&self) -> Shape {
        match self.node() {
            Some(node) => match node.kind() {
                NodeKind::List => Shape::List(self.items(node)),
                NodeKind::Map => Shape::Map(self.entries(node)),
                NodeKind::Parens if node.children().all(|child| child.kind() == NodeKind::Error) => {
                    Shape::Named(Vec::new())
                }
                NodeKind::Parens if node.entries().next().is_some() => Shape::Named(self.entries(node)),
                NodeKind::Parens => Shape::Tuple(self.items(node)),
                NodeKind::Call => Shape::Call,
                NodeKind::Error | NodeKind::Missing => Shape::Broken,
                _ => self.leaf(),
            },
            None => self.leaf(),
        }
    }

    /// The form of a single token.
    fn leaf(&self) -> Shape {
        let [token] = self.tokens() else { return Shape::Other };
        let word = self.str();
        match token.kind() {
            Kind::Str if ["b\"", "br\"", "br#"].iter().any(|begin| word.starts_with(begin)) => Shape::Bytes,
            Kind::Str => syntax::decode(word).map_or(Shape::Other, Shape::Text),
            Kind::Number => syntax::number(word).map_or(Shape::Other, Shape::Number),
            Kind::Ident => Shape::Word(word.to_owned()),
            _ => Shape::Other,
        }
    }

    fn token(&self, index: usize) -> SyntaxValue {
        SyntaxValue { src: self.src.clone(), lo: index, hi: index + 1, node: None, within: None }
    }

    fn items(&self, node: Node<'_>) -> Vec<SyntaxValue> {
        let empty = |item: &Node<'_>| item.kind() == NodeKind::Error && item.tokens().is_empty();
        node.children().filter(|item| !empty(item)).map(|item| Self::of(&self.src, item)).collect()
    }

    fn entries(&self, node: Node<'_>) -> Vec<Entry> {
        let entry = |entry: Node<'_>| {
            let (key, value) = (Self::of(&self.src, entry.key()?), Self::of(&self.src, entry.value()?));
            let name = match key.shape() {
                Shape::Text(name) => name,
                Shape::Bytes => syntax::decode(key.str().trim_start_matches('b')).unwrap_or_default(),
                _ => key.str().trim_start_matches("r#").to_owned(),
            };
            Some(Entry { name, key, value })
        };
        node.entries().filter_map(entry).collect()
    }
}

/// The value inside `Some( )`.
fn in_some(node: Node<'_>) -> Option<Node<'_>> {
    let body = node.body().filter(|_| node.kind() == NodeKind::Call && node.name() == Some("Some"))?;
    let mut values = body.children();
    let value = values.next().filter(|value| value.kind() != NodeKind::Entry && !body.is_broken())?;
    values.next().is_none().then_some(value)
}
