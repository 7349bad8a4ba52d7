//! Parts of a text that know their places.
use super::lex::{self, Kind, Token};
use crate::diagnostics::{Code, Diagnostic, FileId, Span};
use std::sync::Arc;

/// A text with its tokens. It may be made from another text by inserting the values of parameters; places are always
/// those of the original text.
#[derive(Debug)]
pub(super) struct Src {
    file: FileId,
    text: Arc<str>,
    tokens: Vec<Token>,
    /// Where the pieces of the text come from; empty if it is the original.
    pieces: Vec<Piece>,
}

/// Where a run of bytes of a made text comes from.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// One past its last byte in the made text.
    pub(super) end: usize,
    /// Its place in the original.
    pub(super) span: Span,
    /// Whether it was copied byte by byte.
    pub(super) copied: bool,
    /// Other places that matter, if the value came from elsewhere.
    pub(super) related: Vec<(Span, &'static str)>,
    /// Whether its value was given from outside of the graph file that uses it.
    pub(super) given: bool,
}

impl Src {
    /// An original text.
    pub(super) fn new(file: FileId, text: Arc<str>) -> Arc<Self> {
        let tokens = lex::tokenize(&text);
        Arc::new(Self { file, text, tokens, pieces: Vec::new() })
    }

    /// A made text.
    pub(super) fn made(file: FileId, text: String, pieces: Vec<Piece>) -> Arc<Self> {
        let tokens = lex::tokenize(&text);
        Arc::new(Self { file, text: text.into(), tokens, pieces })
    }

    /// All of it but for a header of RON attributes; `None` if there is nothing.
    pub(super) fn whole(self: &Arc<Self>) -> Option<Part> {
        let mut lo = 0;
        while self.tokens.get(lo).is_some_and(|t| &self.text[t.start..t.end] == "#") {
            let close = self.tokens[lo..].iter().position(|t| &self.text[t.start..t.end] == "]")?;
            lo += close + 1;
        }
        (lo < self.tokens.len()).then(|| Part { src: self.clone(), lo, hi: self.tokens.len() })
    }

    fn piece(&self, offset: usize) -> Option<(&Piece, usize)> {
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

/// A run of tokens of a text: a value, a key or a word.
#[derive(Clone, Debug)]
pub(super) struct Part {
    src: Arc<Src>,
    lo: usize,
    hi: usize,
}

/// A key and its value.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// The key without its quotes.
    pub(super) name: String,
    /// Where the key stands.
    pub(super) key: Part,
    /// The value.
    pub(super) value: Part,
}

/// The form of a value.
#[derive(Debug)]
pub(super) enum Shape {
    /// `(a: 1)`, or `()`.
    Named(Vec<Entry>),
    /// `{"a": 1}`.
    Map(Vec<Entry>),
    /// `(1, 2)`.
    Tuple(Vec<Part>),
    /// `[1, 2]`.
    List(Vec<Part>),
    /// A string, decoded.
    Text(String),
    /// A number.
    Number(f64),
    /// A word by itself.
    Word(String),
    /// A word with brackets.
    Call,
    /// Anything else.
    Other,
}

impl Shape {
    /// The same in words, for messages.
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
            Self::Other => "something else",
        }
    }
}

impl Part {
    /// The text, comments between its tokens included.
    pub(super) fn str(&self) -> &str {
        match (self.tokens().first(), self.tokens().last()) {
            (Some(first), Some(last)) => &self.src.text[first.start..last.end],
            _ => "",
        }
    }

    /// Where it stands in the original.
    pub(super) fn span(&self) -> Span {
        match (self.tokens().first(), self.tokens().last()) {
            (Some(first), Some(last)) => self.src.span(first.start, last.end),
            _ => Span { file: self.src.file, start: 0, end: 0 },
        }
    }

    /// Where a piece of the original text of a token stands: bytes `from..to` of this part.
    pub(super) fn sub_span(&self, from: usize, to: usize) -> Span {
        let start = self.tokens().first().map_or(0, |t| t.start);
        self.src.span(start + from, start + to)
    }

    /// The file it stands in.
    pub(super) fn file(&self) -> FileId {
        self.src.file
    }

    /// Its tokens.
    pub(super) fn tokens(&self) -> &[Token] {
        &self.src.tokens[self.lo..self.hi]
    }

    /// Its tokens as parts.
    pub(super) fn words(&self) -> impl Iterator<Item = (Kind, Part)> + '_ {
        (self.lo..self.hi).map(|i| (self.src.tokens[i].kind, self.part(i, i + 1)))
    }

    /// How many words with brackets are in it.
    pub(super) fn calls(&self) -> usize {
        let is_call = |pair: &&[Token]| pair[0].kind == Kind::Ident && pair[1].kind == Kind::Open;
        self.tokens().windows(2).filter(is_call).count()
    }

    /// Whether it begins with the same token as another part.
    pub(super) fn begins_with(&self, other: &Part) -> bool {
        Arc::ptr_eq(&self.src, &other.src) && self.lo == other.lo
    }

    /// Byte offset of a token of [`tokens`](Self::tokens) within [`str`](Self::str).
    pub(super) fn offset(&self, token: &Token) -> usize {
        token.start - self.tokens().first().map_or(0, |t| t.start)
    }

    /// An error about it.
    pub(super) fn error(&self, code: Code, message: impl Into<String>) -> Diagnostic {
        let diagnostic = Diagnostic::new(code, self.span(), message);
        let related = self.piece().map(|piece| piece.related.iter()).into_iter().flatten();
        let others = related.filter(|(span, _)| *span != diagnostic.span).copied().collect::<Vec<_>>();
        others.into_iter().fold(diagnostic, |diagnostic, (span, message)| diagnostic.related(span, message))
    }

    /// Whether its value was given from outside of the graph file that it stands in.
    pub(super) fn is_given(&self) -> bool {
        self.piece().is_some_and(|piece| piece.given)
    }

    /// What its first token comes from, if the text was made.
    fn piece(&self) -> Option<&Piece> {
        let first = self.tokens().first()?;
        self.src.piece(first.start).map(|(piece, _)| piece)
    }

    /// The leading word, if there is one, and what follows it, if anything does.
    pub(super) fn head(&self) -> Option<(Part, Option<Part>)> {
        let first = self.tokens().first().filter(|t| t.kind == Kind::Ident)?;
        debug_assert!(first.end >= first.start, "tokens are not reversed");
        let rest = (self.lo + 1 < self.hi).then(|| self.part(self.lo + 1, self.hi));
        Some((self.part(self.lo, self.lo + 1), rest))
    }

    /// The form of its value.
    pub(super) fn shape(&self) -> Shape {
        let Some(first) = self.tokens().first() else { return Shape::Other };
        let word = &self.src.text[first.start..first.end];
        match first.kind {
            Kind::Open => self.brackets(word),
            Kind::Str if self.hi - self.lo == 1 => decode(word).map_or(Shape::Other, Shape::Text),
            Kind::Number if self.hi - self.lo == 1 => lex::number(word).map_or(Shape::Other, Shape::Number),
            Kind::Ident if self.hi - self.lo == 1 => Shape::Word(word.to_owned()),
            Kind::Ident => Shape::Call,
            _ => Shape::Other,
        }
    }

    fn part(&self, lo: usize, hi: usize) -> Part {
        Part { src: self.src.clone(), lo, hi }
    }

    fn brackets(&self, open: &str) -> Shape {
        let items = self.items();
        match open {
            "[" => Shape::List(items),
            "{" => Shape::Map(items.iter().filter_map(Part::entry).collect()),
            _ if items.is_empty() => Shape::Named(Vec::new()),
            _ if items.iter().all(|item| item.is_field()) => {
                Shape::Named(items.iter().filter_map(Part::entry).collect())
            }
            _ => Shape::Tuple(items),
        }
    }

    /// What stands between the commas inside the brackets.
    fn items(&self) -> Vec<Part> {
        let mut items = Vec::new();
        let (mut depth, mut lo) = (0_usize, self.lo + 1);
        for i in self.lo + 1..self.hi {
            let kind = self.src.tokens[i].kind;
            let closes = kind == Kind::Close && depth == 0;
            if closes || (kind == Kind::Comma && depth == 0) {
                if lo < i {
                    items.push(self.part(lo, i));
                }
                lo = i + 1;
            }
            match kind {
                Kind::Open => depth += 1,
                Kind::Close if closes => return items,
                Kind::Close => depth -= 1,
                _ => {}
            }
        }
        items
    }

    fn is_field(&self) -> bool {
        matches!(self.tokens(), [name, colon, ..] if name.kind == Kind::Ident && colon.kind == Kind::Colon)
    }

    /// A key, a colon and a value.
    fn entry(&self) -> Option<Entry> {
        let mut depth = 0_usize;
        let colon = self.tokens().iter().position(|t| {
            match t.kind {
                Kind::Open => depth += 1,
                Kind::Close => depth = depth.saturating_sub(1),
                _ => {}
            }
            t.kind == Kind::Colon && depth == 0
        })?;
        let (key, value) = (self.part(self.lo, self.lo + colon), self.part(self.lo + colon + 1, self.hi));
        let name = match key.shape() {
            Shape::Text(name) => name,
            _ => key.str().trim_start_matches("r#").to_owned(),
        };
        (colon > 0 && value.lo < value.hi).then_some(Entry { name, key, value })
    }
}

/// The text that a string literal stands for.
fn decode(literal: &str) -> Option<String> {
    let body = literal.strip_prefix('"').and_then(|l| l.strip_suffix('"'));
    match body {
        Some(body) if !body.contains('\\') => Some(body.to_owned()),
        _ => crate::node::ron_options().from_str(literal).ok(),
    }
}
