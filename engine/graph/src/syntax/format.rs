//! Formats graph files in the one standard layout.
//!
//! Tokens and comments are kept, in their order; only blanks, and commas before closing brackets, change. A bracket is
//! written in one line if it fits, otherwise with one item per line. List sections of a graph always have one entry per
//! line. Lists of numbers, such as tables of points, keep their rows. A comment on its own line stays there, and a
//! comment at the end of a line stays at the end. Formulas are laid out by `formula::layout`.
use super::fault::SyntaxError;
use super::formula::layout::{self, Laid};
use super::lex::{Token, TokenKind};
use super::nodes::NodeKind;
use super::tree::{Node, Tree};
use std::collections::BTreeMap;
use std::ops::Range;

/// The maximum line length, including the comma.
pub(super) const WIDTH: usize = 120;
/// Indentation of the items of a bracket.
const INDENT: usize = 2;
/// The sections of a graph with one entry per line.
const LISTS: [&str; 4] = ["params", "presets", "inputs", "nodes"];

/// Formats a text; returns its mistakes if it is not valid RON.
pub fn format(text: &str) -> Result<String, Vec<SyntaxError>> {
    Ok(Layout::of(&sound(text)?).out)
}

/// Formats the smallest whole entries that cover a range of the text: returns the range to replace and the new text.
/// `None` if there is nothing to format.
pub fn format_range(text: &str, range: Range<usize>) -> Result<Option<(Range<usize>, String)>, Vec<SyntaxError>> {
    let tree = sound(text)?;
    let outer = tree.covering(range.clone());
    let is_item = |node: &Node<'_>| {
        let holder = node.parent().map(Node::kind);
        matches!(holder, Some(NodeKind::Parens | NodeKind::List | NodeKind::Map))
    };
    let touched: Vec<_> = outer.children().filter(|item| is_item(item) && overlap(&item.range(), &range)).collect();
    let (first, last) = match (touched.first(), touched.last()) {
        (Some(first), Some(last)) => (*first, *last),
        _ => {
            let item = outer.ancestors().find(is_item).or(tree.value());
            let Some(item) = item else { return Ok(None) };
            (item, item)
        }
    };
    let (lo, hi) = (first.token_range().start, last.token_range().end);
    let layout = Layout::of(&tree);
    let (Some(start), Some(end)) = (layout.places.get(lo), hi.checked_sub(1).and_then(|last| layout.places.get(last)))
    else {
        return Ok(None);
    };
    let replaced = first.range().start..last.range().end;
    Ok(Some((replaced, layout.out[start.start..end.end].to_owned())))
}

fn overlap(a: &Range<usize>, b: &Range<usize>) -> bool {
    a.start <= b.end && b.start <= a.end
}

fn sound(text: &str) -> Result<Tree, Vec<SyntaxError>> {
    let tree = Tree::parse(text);
    if tree.errors().is_empty() { Ok(tree) } else { Err(tree.errors().to_vec()) }
}

/// A bracket being written.
struct Frame {
    /// True if each item has its own line.
    broken: bool,
    /// True if it contains only numbers, whose rows are kept.
    table: bool,
    /// Indentation of the line in which it was opened.
    indent: usize,
}

/// White space before a token.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Space {
    None,
    One,
    /// A new line; `spaced` keeps an empty line before it.
    Line {
        indent: usize,
        spaced: bool,
    },
}

/// State of the formatter.
struct Layout<'t> {
    tree: &'t Tree,
    text: &'t str,
    tokens: &'t [Token],
    comments: Vec<Range<usize>>,
    /// The first comment that is not written yet.
    comment: usize,
    newline: &'static str,
    /// For each token, the width of all text before it on one line, and the number of tokens and comments before it
    /// that need a line break.
    widths: Vec<(usize, usize)>,
    /// The brackets that always have one item per line.
    forced: Vec<usize>,
    /// The formulas, by their token.
    formulas: BTreeMap<usize, Laid>,
    frames: Vec<Frame>,
    out: String,
    /// The start of the current line in `out`.
    line: usize,
    /// The place in `out` of each token.
    places: Vec<Range<usize>>,
}

impl<'t> Layout<'t> {
    fn of(tree: &'t Tree) -> Self {
        let text = &**tree.text();
        let mut layout = Self {
            tree,
            text,
            tokens: tree.tokens(),
            comments: tree.comments().collect(),
            comment: 0,
            newline: if text.contains("\r\n") { "\r\n" } else { "\n" },
            widths: Vec::with_capacity(tree.tokens().len() + 1),
            forced: forced(tree),
            formulas: layout::formulas(tree),
            frames: Vec::new(),
            out: String::with_capacity(text.len() + text.len() / 8),
            line: 0,
            places: Vec::with_capacity(tree.tokens().len()),
        };
        layout.measure();
        layout.write();
        layout
    }

    fn kind(&self, token: usize) -> Option<TokenKind> {
        self.tokens.get(token).map(|token| token.kind())
    }

    fn word(&self, token: usize) -> &'t str {
        self.tokens.get(token).map_or("", |token| &self.text[token.range()])
    }

    /// The range between `token` and the token before it.
    fn gap(&self, token: usize) -> Range<usize> {
        let start = token.checked_sub(1).map_or(0, |before| self.tokens[before].end());
        start..self.tokens.get(token).map_or(self.text.len(), |token| token.start())
    }

    /// The white space before a token on one line.
    fn flat(&self, token: usize) -> Space {
        let Some(before) = token.checked_sub(1) else { return Space::None };
        match (self.kind(before), self.kind(token)) {
            (_, Some(TokenKind::Comma | TokenKind::Colon)) => Space::None,
            (Some(TokenKind::Open), Some(TokenKind::Close)) => Space::None,
            (Some(TokenKind::Open), _) if self.word(before) == "{" => Space::One,
            (_, Some(TokenKind::Close)) if self.word(token) == "}" => Space::One,
            (Some(TokenKind::Comma), Some(TokenKind::Close)) => Space::None,
            (Some(TokenKind::Comma | TokenKind::Colon), _) => Space::One,
            _ => Space::None,
        }
    }

    /// Returns true if a token is a comma that is left out on one line.
    fn is_last_comma(&self, token: usize) -> bool {
        self.kind(token) == Some(TokenKind::Comma) && self.kind(token + 1) == Some(TokenKind::Close)
    }

    fn measure(&mut self) {
        let (mut width, mut breaks, mut comment) = (0, 0, 0);
        let forced = std::mem::take(&mut self.forced);
        for (i, token) in self.tokens.iter().enumerate() {
            self.widths.push((width, breaks));
            let gap = self.gap(i);
            while let Some(place) = self.comments.get(comment).filter(|place| place.end <= gap.end) {
                width += self.text[place.clone()].chars().count() + 1;
                breaks += usize::from(!self.is_inline(place, &gap));
                comment += 1;
            }
            let (own, tall) = match self.formulas.get(&i) {
                Some(formula) => (formula.width, formula.is_tall),
                None => (self.word(i).chars().count(), self.word(i).contains('\n')),
            };
            if !self.is_last_comma(i) {
                width += usize::from(self.flat(i) == Space::One) + own;
            }
            breaks += usize::from(tall || forced.binary_search(&i).is_ok());
            debug_assert!(token.end() >= gap.end);
        }
        self.widths.push((width, breaks));
        self.forced = forced;
    }

    /// Returns true if a comment may stay inside a line: it is a `/* */` that stood inside a line.
    fn is_inline(&self, comment: &Range<usize>, gap: &Range<usize>) -> bool {
        let text = &self.text[comment.clone()];
        text.starts_with("/*") && !text.contains('\n') && !self.text[gap.start..comment.start].contains('\n')
    }

    /// Returns true if a bracket is written with one item per line when it begins at the end of `out`.
    fn is_broken(&self, open: usize, close: usize) -> bool {
        let ((start, before), (end, after)) = (self.widths[open], self.widths[close + 1]);
        // Comments before the bracket are not inside it.
        let inside = self.widths[open + 1].1 - before;
        let own = usize::from(self.forced.binary_search(&open).is_ok());
        let breaks = after - before - (inside - own);
        let column = self.out[self.line..].chars().count();
        let comma = usize::from(!self.frames.is_empty());
        let space = self.widths[open + 1].0 - start;
        breaks > 0 || column + (end - start) - space + 1 + comma > WIDTH
    }

    /// Returns true if a list contains only numbers and brackets with numbers.
    fn is_table(&self, open: usize, close: usize) -> bool {
        use TokenKind::{Close, Comma, Number, Open};
        let numbers = self.tokens[open..close].iter().all(|t| matches!(t.kind(), Open | Close | Comma | Number));
        self.word(open) == "[" && numbers && self.comments_within(open, close) == 0
    }

    fn comments_within(&self, open: usize, close: usize) -> usize {
        let place = |at: usize| self.comments.partition_point(|comment| comment.start < at);
        place(self.tokens[close].start()) - place(self.tokens[open].start())
    }

    /// Returns true if an item of a table fits into the line.
    fn fits(&self, token: usize) -> bool {
        let mut depth = 0_usize;
        let end = (token..self.tokens.len()).find(|&i| match self.kind(i) {
            Some(TokenKind::Open) => {
                depth += 1;
                false
            }
            Some(TokenKind::Close) if depth > 0 => {
                depth -= 1;
                false
            }
            Some(TokenKind::Close | TokenKind::Comma) => depth == 0,
            _ => false,
        });
        let end = end.unwrap_or(self.tokens.len());
        let column = self.out[self.line..].chars().count();
        // Reserve room for the comma.
        column + (self.widths[end].0 - self.widths[token].0) < WIDTH
    }

    fn write(&mut self) {
        let pairs = super::brackets::Pairs::of(self.text, self.tokens);
        let attributes = self.attributes();
        for i in attributes..self.tokens.len() {
            let dropped = self.is_last_comma(i) && self.frames.last().is_some_and(|frame| !frame.broken);
            let space = self.space(i, attributes);
            self.gap_before(i, space);
            let start = self.out.len();
            if !dropped {
                self.push_word(i);
                self.line = self.out[start..].rfind('\n').map_or(self.line, |at| start + at + 1);
            }
            self.places.push(start..self.out.len());
            match self.kind(i) {
                Some(TokenKind::Open) => {
                    self.out.truncate(start);
                    let broken = pairs.partner(i).is_some_and(|close| self.is_broken(i, close));
                    self.out.push_str(self.word(i));
                    let line = &self.out[self.line..];
                    let indent = line.len() - line.trim_start_matches(' ').len();
                    let table = pairs.partner(i).is_some_and(|close| broken && self.is_table(i, close));
                    self.frames.push(Frame { broken, table, indent });
                }
                Some(TokenKind::Close) => drop(self.frames.pop()),
                _ => {}
            }
        }
        let end = if self.tokens.is_empty() { Space::None } else { Space::Line { indent: 0, spaced: true } };
        self.gap_before(self.tokens.len(), end);
        let solid = self.out.trim_end_matches([' ', '\r', '\n']).len();
        self.out.truncate(solid);
        self.out.push_str(self.newline);
    }

    /// Writes a token. The further lines of a formula are indented like the inside of its line.
    fn push_word(&mut self, token: usize) {
        match self.formulas.get(&token) {
            Some(formula) => {
                let line = &self.out[self.line..];
                let indent = line.len() - line.trim_start_matches(' ').len() + INDENT;
                let literal = formula.literal(line.chars().count(), indent, WIDTH, self.newline);
                self.out.push_str(&literal);
            }
            None => self.out.push_str(self.word(token)),
        }
    }

    /// Writes the attributes unchanged, one per line; returns the number of their tokens.
    fn attributes(&mut self) -> usize {
        let nodes: Vec<_> = self.tree.root().children().filter(|node| node.kind() == NodeKind::Attribute).collect();
        let mut end = 0;
        for node in nodes {
            let space = if end == 0 { Space::None } else { Space::Line { indent: 0, spaced: true } };
            self.gap_before(node.token_range().start, space);
            let start = self.out.len();
            self.out.push_str(node.text());
            end = node.token_range().end;
            self.places.resize(end, start..self.out.len());
            // The comments inside the attribute are written already.
            self.comment = self.comments.partition_point(|comment| comment.start < node.range().end);
        }
        end
    }

    /// The white space before a token.
    fn space(&self, token: usize, first: usize) -> Space {
        let before = token.checked_sub(1).and_then(|before| self.kind(before)).filter(|_| token > first);
        let line = |indent: usize, spaced: bool| Space::Line { indent, spaced };
        match (before, self.frames.last()) {
            (None, _) => line(0, true),
            (Some(TokenKind::Open), Some(frame)) if frame.broken => {
                let closes = self.kind(token) == Some(TokenKind::Close);
                line(frame.indent + if closes { 0 } else { INDENT }, false)
            }
            (_, Some(frame)) if frame.broken && self.kind(token) == Some(TokenKind::Close) => line(frame.indent, false),
            (Some(TokenKind::Comma), Some(frame)) if frame.broken => {
                let same_row = frame.table && !self.text[self.gap(token)].contains('\n') && self.fits(token);
                if same_row { Space::One } else { line(frame.indent + INDENT, true) }
            }
            _ => self.flat(token),
        }
    }

    /// Writes the comments before a token, and the white space around them.
    fn gap_before(&mut self, token: usize, space: Space) {
        let gap = self.gap(token);
        let closes = self.kind(token) == Some(TokenKind::Close);
        let before = token.checked_sub(1).and_then(|before| self.kind(before));
        let in_lines = matches!(space, Space::Line { .. });
        if closes && in_lines && !matches!(before, Some(TokenKind::Comma | TokenKind::Open)) {
            self.out.push(',');
        }
        // Comments are indented like the items of the bracket; inside an item, one level more.
        let items = self.frames.last().map_or(0, |frame| frame.indent + if frame.broken { INDENT } else { 0 });
        let inner = if in_lines || self.frames.is_empty() { items } else { items + INDENT };
        let mut end = gap.start;
        let mut last = None;
        while let Some(place) = self.comments.get(self.comment).filter(|place| place.end <= gap.end).cloned() {
            let blank = &self.text[end..place.start];
            if blank.contains('\n') {
                let spaced = before != Some(TokenKind::Open) || last.is_some();
                self.new_line(Space::Line { indent: inner, spaced }, blank);
            } else if self.out.len() > self.line {
                let open = before == Some(TokenKind::Open) && last.is_none() && space == Space::None;
                let line = self.text[place.clone()].starts_with("//");
                self.out.push_str(if open && !line { "" } else { " " });
            }
            let start = self.out.len();
            self.out.push_str(self.text[place.clone()].trim_end());
            self.line = self.out[start..].rfind('\n').map_or(self.line, |at| start + at + 1);
            end = place.end;
            last = Some(place);
            self.comment += 1;
        }
        let blank = &self.text[end..gap.end];
        match last {
            None => self.new_line(space, blank),
            Some(comment) => {
                let line = self.text[comment.clone()].starts_with("//");
                let own = self.text[gap.start..comment.start].contains('\n') || token == 0 || gap.start == 0;
                let follows = matches!(self.kind(token), Some(TokenKind::Comma | TokenKind::Colon | TokenKind::Close));
                match space {
                    // A comment in the same line before a token stays there.
                    Space::Line { .. }
                        if own && !line && !closes && !blank.contains('\n') && token < self.tokens.len() =>
                    {
                        self.out.push(' ');
                    }
                    Space::Line { .. } => self.new_line(space, blank),
                    _ if line || blank.contains('\n') => {
                        self.new_line(Space::Line { indent: inner, spaced: false }, blank)
                    }
                    Space::None if follows => {}
                    _ => self.out.push(' '),
                }
            }
        }
    }

    /// Writes white space in place of `blank` in the text.
    fn new_line(&mut self, space: Space, blank: &str) {
        match space {
            Space::None => {}
            Space::One => self.out.push(' '),
            Space::Line { indent, spaced } => {
                if !self.out.is_empty() {
                    self.out.push_str(self.newline);
                    if spaced && blank.matches('\n').count() > 1 {
                        self.out.push_str(self.newline);
                    }
                }
                self.line = self.out.len();
                self.out.extend(std::iter::repeat_n(' ', indent));
            }
        }
    }
}

/// The brackets that always have one item per line, in order.
fn forced(tree: &Tree) -> Vec<usize> {
    let Some(top) = tree.value().filter(|top| top.kind() == NodeKind::Parens) else { return Vec::new() };
    let lists = top.entries().filter(|entry| entry.key_text().is_some_and(|key| LISTS.contains(&key.as_str())));
    let brackets = lists.filter_map(Node::value).filter(|list| list.children().next().is_some());
    let first = top.entries().next().map(|_| top);
    first.into_iter().chain(brackets).map(|node| node.token_range().start).collect()
}
