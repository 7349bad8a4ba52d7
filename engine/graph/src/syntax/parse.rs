//! Parses tokens into the tree.
use super::brackets::{NONE, Pairs};
use super::fault::{SyntaxError, settle};
use super::lex::{Lexed, Token, TokenKind, lex, short};
use super::nodes::{NodeData, NodeKind};
use crate::diagnostics::Code;
use serde::de::IgnoredAny;
use std::cell::OnceCell;

/// The components of a tree.
pub(super) struct Parsed {
    pub(super) tokens: Vec<Token>,
    pub(super) comments: Vec<(u32, u32)>,
    pub(super) nodes: Vec<NodeData>,
    pub(super) errors: Vec<SyntaxError>,
}

/// Parses a text with brackets nested at most `nesting` deep.
pub(super) fn parse(text: &str, nesting: usize) -> Parsed {
    let mut lexed = if short(text.len()) < NONE { lex(text) } else { Lexed::default() };
    let pairs = Pairs::of(text, &lexed.tokens);
    let faults = std::mem::take(&mut lexed.faults);
    let tokens = &lexed.tokens;
    let nodes = Vec::with_capacity(tokens.len());
    let mut parser = Parser {
        text,
        tokens,
        pairs,
        nodes,
        faults,
        at: 0,
        depth: 0,
        nesting,
        parent: 0,
        recovering: false,
        quoted_until: 0,
        lines: OnceCell::new(),
    };
    parser.root();
    let (nodes, faults) = (parser.nodes, parser.faults);
    Parsed { tokens: lexed.tokens, comments: lexed.comments, nodes, errors: settle(text, faults) }
}

pub(super) struct Parser<'a> {
    pub(super) text: &'a str,
    pub(super) tokens: &'a [Token],
    pub(super) pairs: Pairs,
    pub(super) nodes: Vec<NodeData>,
    pub(super) faults: Vec<SyntaxError>,
    /// The index of the next token.
    pub(super) at: usize,
    depth: usize,
    nesting: usize,
    /// The current node.
    parent: u32,
    /// True if the last item is followed by garbage.
    pub(super) recovering: bool,
    /// The end of the last bracket for which quoted field names were reported.
    pub(super) quoted_until: usize,
    /// The starts of lines, computed on first use.
    lines: OnceCell<Vec<usize>>,
}

/// A bracket being parsed.
#[derive(Clone, Copy)]
pub(super) struct BracketBlock {
    /// `Parens`, `List` or `Map`.
    pub(super) kind: NodeKind,
    /// True if it has named fields.
    pub(super) named: bool,
    /// Its opening bracket, if that has no partner.
    pub(super) open_ended: Option<usize>,
}

impl<'a> Parser<'a> {
    /// The kind of a token.
    pub(super) fn kind_of(&self, token: usize) -> Option<TokenKind> {
        self.tokens.get(token).map(|token| token.kind())
    }

    /// The kind of the next token.
    pub(super) fn kind(&self) -> Option<TokenKind> {
        self.kind_of(self.at)
    }

    /// The text of a token.
    pub(super) fn word(&self, token: usize) -> &'a str {
        self.tokens.get(token).map_or("", |token| &self.text[token.range()])
    }

    /// The start of the line that contains a byte.
    pub(super) fn line(&self, at: usize) -> usize {
        let begins = |text: &str| text.match_indices('\n').map(|(i, _)| i + 1).collect();
        let lines = self.lines.get_or_init(|| begins(self.text));
        lines.partition_point(|&line| line <= at).checked_sub(1).map_or(0, |line| lines[line])
    }

    /// Returns true if brackets may nest deeper here.
    pub(super) fn may_nest(&self) -> bool {
        self.depth < self.nesting
    }

    /// Returns true if a token begins where the previous one ends.
    pub(super) fn touches(&self, token: usize) -> bool {
        token < self.tokens.len()
            && token.checked_sub(1).is_some_and(|before| self.tokens[before].end() == self.tokens[token].start())
    }

    /// Returns true if `token` and the token after it have these kinds.
    pub(super) fn are(&self, token: usize, first: TokenKind, second: TokenKind) -> bool {
        self.kind_of(token) == Some(first) && self.kind_of(token + 1) == Some(second)
    }

    /// Starts a node; returns its index.
    pub(super) fn open(&mut self, kind: NodeKind) -> usize {
        let (index, lo) = (self.nodes.len(), short(self.at));
        self.nodes.push(NodeData { kind, broken: false, lo, hi: lo, parent: self.parent, next: 0 });
        self.parent = short(index);
        if matches!(kind, NodeKind::Error | NodeKind::Missing) {
            self.mark(index);
        }
        index
    }

    /// Ends a node before the next token.
    pub(super) fn close(&mut self, node: usize) {
        let (hi, next) = (short(self.at), short(self.nodes.len()));
        let data = &mut self.nodes[node];
        (data.hi, data.next) = (hi, next);
        self.parent = data.parent;
    }

    /// Inserts a node around everything since the node `first`, which is the last child of the current node.
    pub(super) fn open_around(&mut self, first: usize, kind: NodeKind) -> usize {
        let NodeData { lo, parent, .. } = self.nodes[first];
        self.nodes.insert(first, NodeData { kind, broken: false, lo, hi: lo, parent, next: 0 });
        for node in &mut self.nodes[first + 1..] {
            node.next += 1;
            let inside = node.parent >= short(first);
            node.parent = if inside { node.parent + 1 } else { short(first) };
        }
        self.parent = short(first);
        self.mark(first);
        first
    }

    /// Adds a node without children that covers the next `len` tokens.
    pub(super) fn leaf(&mut self, kind: NodeKind, len: usize) {
        let node = self.open(kind);
        self.at += len;
        self.close(node);
    }

    /// Marks `node` and all its ancestors as broken.
    fn mark(&mut self, mut node: usize) {
        while !self.nodes[node].broken {
            self.nodes[node].broken = true;
            node = self.nodes[node].parent as usize;
        }
    }

    fn root(&mut self) {
        let root = self.open(NodeKind::Root);
        while self.word(self.at) == "#" && self.word(self.at + 1) == "!" && self.word(self.at + 2) == "[" {
            self.attribute();
        }
        let end = self.tokens.len();
        if self.at == end {
            let missing = if self.text.len() < NONE as usize { "the text is empty" } else { "the text is too long" };
            self.fault_here(missing, "a graph file is `( nodes: { … }, outputs: { … } )`");
            self.leaf(NodeKind::Missing, 0);
        } else if self.are(self.at, TokenKind::Ident, TokenKind::Colon) {
            self.fault_here("expected `(` before the first field", "a graph file is `( … )`");
            self.implied(NodeKind::Parens, self.pairs.stray_from(end - 1).unwrap_or(end));
        } else {
            self.value(end);
        }
        if self.at < end {
            self.fault_here("nothing may follow here", "the bracket that holds the whole file is closed before it");
            let rest = self.open(NodeKind::Error);
            self.at = end;
            self.close(rest);
        }
        self.close(root);
    }

    /// Parses `#![…]`; `ron` checks its content.
    fn attribute(&mut self) {
        let node = self.open(NodeKind::Attribute);
        let first = self.at;
        let last = self.pairs.partner(first + 2).unwrap_or(self.tokens.len() - 1);
        self.at = last + 1;
        let text = &self.text[self.tokens[first].start()..self.tokens[last].end()];
        if ron::from_str::<IgnoredAny>(&format!("{text}()")).is_err() {
            let fault = SyntaxError::new(self.tokens[first].range(), "this attribute is not known");
            self.faults.push(fault.help("leave it out"));
        }
        self.close(node);
    }

    /// Parses a value that ends before `limit`. There must be a token.
    pub(super) fn value(&mut self, limit: usize) {
        if self.implied_map(limit) || self.implied_parens(limit) || self.implied_values(limit) {
            return;
        }
        self.plain_value(limit);
    }

    /// Parses a value that is not followed by a colon.
    pub(super) fn plain_value(&mut self, limit: usize) {
        let next = Some(self.at + 1).filter(|&next| next < limit);
        match self.kind() {
            Some(TokenKind::Ident) => self.word_or_call(limit, next),
            Some(TokenKind::Number | TokenKind::Dots) => self.number_or_range(limit),
            Some(TokenKind::Str) => self.leaf(NodeKind::Text, 1),
            Some(TokenKind::Char) => self.leaf(NodeKind::Char, 1),
            Some(TokenKind::Open) => self.block(limit),
            Some(TokenKind::Other) => {
                self.fault_here("this character cannot stand here", help_for(self.word(self.at)));
                self.leaf(NodeKind::Missing, 0);
            }
            _ => {
                self.fault_here("expected a value", "write a value, or leave the field out");
                self.leaf(NodeKind::Missing, 0);
            }
        }
    }

    fn word_or_call(&mut self, limit: usize, next: Option<usize>) {
        let word = self.word(self.at);
        let closed = matches!(word, "true" | "false" | "None");
        if !closed && next.is_some_and(|next| self.word(next) == "(") {
            let call = self.open(NodeKind::Call);
            self.at += 1;
            self.block(limit);
            self.close(call);
        } else if !closed && next.is_some_and(|next| matches!(self.word(next), "{" | "[") && self.touches(next)) {
            let call = self.open(NodeKind::Call);
            self.at += 1;
            self.fault_here("expected `(`", "fields stand in round brackets: write `Kind(field: value)`");
            self.block_as(NodeKind::Parens, limit);
            self.close(call);
        } else if !closed && next.is_some_and(|next| self.lacks_opening(next, limit)) {
            let call = self.open(NodeKind::Call);
            self.at += 1;
            self.fault_here("expected `(` before the first field", "write `Kind(field: value)`");
            let end = self.pairs.stray_from(self.at).unwrap_or(limit);
            self.implied(NodeKind::Parens, end);
            self.close(call);
        } else {
            if word == "Some" {
                self.fault_here("`Some` takes a value in brackets", "leave `Some` out, and write the value alone");
            }
            self.leaf(NodeKind::Word, 1);
        }
    }

    fn number_or_range(&mut self, limit: usize) {
        let follows = |token: usize| token < limit && self.touches(token);
        let number = usize::from(self.kind() == Some(TokenKind::Number));
        let dots = self.at + number;
        if number == 1 && !(self.kind_of(dots) == Some(TokenKind::Dots) && follows(dots)) {
            self.leaf(NodeKind::Number, 1);
            return;
        }
        let ends = self.kind_of(dots + 1) == Some(TokenKind::Number) && follows(dots + 1);
        if !ends && self.word(dots) == "..=" {
            self.fault_here("a range with `=` needs an end", "write `1..=2`");
        }
        self.leaf(NodeKind::Range, number + 1 + usize::from(ends));
    }

    /// Parses a bracket with its content. Without a partner, it ends before `limit` at the latest.
    fn block(&mut self, limit: usize) {
        self.block_as(
            match self.word(self.at) {
                "(" => NodeKind::Parens,
                "[" => NodeKind::List,
                _ => NodeKind::Map,
            },
            limit,
        );
    }

    /// Parses a bracket as the given kind.
    fn block_as(&mut self, kind: NodeKind, limit: usize) {
        let opening = self.at;
        let partner = self.pairs.partner(opening);
        if !self.may_nest() {
            self.too_deep(partner.map_or(limit, |partner| partner + 1));
            return;
        }
        let node = self.open(kind);
        self.at += 1;
        self.depth += 1;
        let end = partner.unwrap_or(limit);
        let named = kind == NodeKind::Map || (kind == NodeKind::Parens && self.begins_named(end));
        let open_ended = partner.is_none().then_some(opening);
        self.items(BracketBlock { kind, named, open_ended }, end);
        self.depth -= 1;
        match partner {
            Some(close) => self.closing(opening, close),
            None => self.not_closed(opening, kind),
        }
        self.close(node);
    }

    /// Parses the entries of a bracket without an opening one, up to `end`, where its closing one may be.
    pub(super) fn implied(&mut self, kind: NodeKind, end: usize) {
        let node = self.open(kind);
        self.depth += 1;
        let named = kind == NodeKind::Map || (kind == NodeKind::Parens && self.begins_named(end));
        self.items(BracketBlock { kind, named, open_ended: None }, end);
        self.depth -= 1;
        self.at += usize::from(self.kind() == Some(TokenKind::Close));
        self.close(node);
    }

    /// Reads the closing bracket, which may be of the wrong sort.
    fn closing(&mut self, opening: usize, close: usize) {
        let (message, help) = match self.word(opening) {
            "(" => ("expected `)`", "the bracket that it closes is `(`"),
            "[" => ("expected `]`", "the bracket that it closes is `[`"),
            _ => ("expected `}`", "the bracket that it closes is `{`"),
        };
        if !message.contains(self.word(close)) {
            let fault = SyntaxError::new(self.tokens[close].range(), message).help(help);
            self.faults.push(fault.bracket(self.tokens[opening].range()));
        }
        self.at = close + 1;
    }

    fn too_deep(&mut self, end: usize) {
        let message = format!("the file nests deeper than {} levels", self.nesting);
        let fault = SyntaxError::new(self.tokens[self.at].range(), message);
        self.faults.push(SyntaxError { code: Code::TooLarge, ..fault });
        let node = self.open(NodeKind::Error);
        self.at = end;
        self.close(node);
    }
}

/// The help for a character in place of a value.
fn help_for(character: &str) -> &'static str {
    match character {
        "+" | "-" => "a sign belongs to a number: write `-1`, or calculate in a text, `\"= -$name\"`",
        "$" => "parameters stand in double quotes, `\"$name\"`",
        "=" => "a calculation stands in double quotes, `\"= 2 * $name\"`",
        "#" => "colours stand in double quotes, `\"#rrggbb\"`",
        _ => "texts stand in double quotes, `\"text\"`",
    }
}
