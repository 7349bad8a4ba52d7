//! Formats graph files in the one standard layout.
//!
//! Tokens and comments are kept, in their order; only blanks, and commas before closing brackets, change. A bracket is
//! written in one line if it fits; otherwise `fill` decides how its items fill several lines. List sections of a graph
//! always have one entry per line. Lists of numbers, such as tables of points, keep their rows. A comment on its own
//! line stays there, and a comment at the end of a line stays at the end. Formulas are laid out by `formula::layout`.
use super::fault::SyntaxError;
use super::fill::{Blocks, Form, Items};
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
/// Items of a block that are at most this long share a line.
const SHORT: usize = 60;
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
    form: Form,
    /// Indentation of the line in which it was opened.
    indent: usize,
    /// The first tokens of the item before and of the current item.
    before: usize,
    item: usize,
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
    items: Items<'t>,
    /// The brackets that always have one item per line.
    forced: Vec<usize>,
    /// The brackets that are written as blocks if they do not fit into a line.
    blocks: Blocks,
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
            items: Items::new(tree.tokens()),
            forced: forced(tree),
            blocks: Blocks::default(),
            formulas: layout::formulas(tree),
            frames: Vec::new(),
            out: String::with_capacity(text.len() + text.len() / 8),
            line: 0,
            places: Vec::with_capacity(tree.tokens().len()),
        };
        layout.measure();
        let formula = |token: usize| layout.formulas.get(&token).map(|formula| (formula.width, formula.is_tall));
        layout.blocks = Blocks::of(layout.text, layout.tokens, &layout.comments, formula);
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

    /// The forms of the brackets around the current place, the inner ones first.
    fn forms(&self) -> impl Iterator<Item = Form> + use<'_> {
        self.frames.iter().rev().map(|frame| frame.form)
    }

    fn measure(&mut self) {
        let (mut width, mut breaks, mut comment) = (0, 0, 0);
        let forced = std::mem::take(&mut self.forced);
        for (i, token) in self.tokens.iter().enumerate() {
            self.items.widths.push((width, breaks));
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
            if !self.items.is_last_comma(i) {
                width += usize::from(self.flat(i) == Space::One) + own;
            }
            breaks += usize::from(tall || forced.binary_search(&i).is_ok());
            debug_assert!(token.end() >= gap.end);
        }
        self.items.widths.push((width, breaks));
        self.forced = forced;
    }

    /// Returns true if a comment may stay inside a line: it is a `/* */` that stood inside a line.
    fn is_inline(&self, comment: &Range<usize>, gap: &Range<usize>) -> bool {
        let text = &self.text[comment.clone()];
        text.starts_with("/*") && !text.contains('\n') && !self.text[gap.start..comment.start].contains('\n')
    }

    /// Returns true if a bracket is written with one item per line when it begins at the end of `out`.
    fn is_broken(&self, open: usize, close: usize) -> bool {
        let ((start, before), (_, after)) = (self.items.widths[open], self.items.widths[close + 1]);
        let end = self.items.widths[self.items.end_of_closers(close + 1, self.forms())].0;
        // Comments before the bracket are not inside it.
        let inside = self.items.widths[open + 1].1 - before;
        let own = usize::from(self.forced.binary_search(&open).is_ok());
        let breaks = after - before - (inside - own);
        let column = self.out[self.line..].chars().count();
        let comma = usize::from(!self.frames.is_empty());
        let space = self.items.widths[open + 1].0 - start;
        breaks > 0 || column + (end - start) - space + 1 + comma > WIDTH
    }

    /// The form of a bracket that begins at the end of `out`.
    fn form(&self, open: usize, close: usize) -> Form {
        if !self.is_broken(open, close) {
            Form::Line
        } else if self.is_table(open, close) {
            Form::Rows
        } else if self.forced.binary_search(&open).is_ok() || self.blocks.is_list(open) {
            Form::List
        } else if self.blocks.has(open) || !self.begins_behind(open) {
            Form::Block
        } else {
            Form::Fill
        }
    }

    /// Returns true if the first item of a bracket, or its beginning, fits behind the bracket.
    fn begins_behind(&self, open: usize) -> bool {
        let column = self.out[self.line..].chars().count() + self.word(open).len();
        // Reserve room for brackets that close behind the item.
        column + self.items.width(open + 1, self.items.beginning(open + 1, WIDTH / 2)) + 2 < WIDTH
    }

    /// Returns true if a list contains only numbers and brackets with numbers.
    fn is_table(&self, open: usize, close: usize) -> bool {
        use TokenKind::{Close, Comma, Number, Open};
        let numbers = self.tokens[open..close].iter().all(|t| matches!(t.kind(), Open | Close | Comma | Number));
        self.word(open) == "[" && numbers && self.comments_within(open, close) == 0
    }

    fn comments_within(&self, open: usize, close: usize) -> usize {
        self.comments_between(self.tokens[open].start(), self.tokens[close].start())
    }

    /// Number of comments that begin in a range of the text.
    fn comments_between(&self, from: usize, to: usize) -> usize {
        let place = |at: usize| self.comments.partition_point(|comment| comment.start < at);
        place(to).saturating_sub(place(from))
    }

    /// Returns true if an item fits into a line that has `column` characters, with the brackets that close behind it.
    fn fits_at(&self, token: usize, column: usize) -> bool {
        let end = self.items.end_of_closers(self.items.end(token), self.forms());
        // Reserve room for the comma.
        column + self.items.width(token, end) < WIDTH
    }

    /// Returns true if an item fits into the current line.
    fn fits(&self, token: usize) -> bool {
        self.fits_at(token, self.out[self.line..].chars().count())
    }

    /// The white space before an item that fills lines with the items around it.
    fn fill(&self, token: usize, indent: usize) -> Space {
        let line = Space::Line { indent, spaced: false };
        if self.fits(token) {
            return Space::One;
        }
        // A bracket that is longer than a line begins where its first item fits.
        let column = self.out[self.line..].chars().count();
        let begins = column + self.items.width(token, self.items.beginning(token, WIDTH / 2)) < WIDTH;
        if begins && !self.fits_at(token, indent) { Space::One } else { line }
    }

    /// The white space before an item of a block. Short items share a line.
    fn in_block(&self, token: usize, before: usize, indent: usize) -> Space {
        let line = Space::Line { indent, spaced: true };
        let end = self.items.end(token);
        // Comments behind the item, and behind its comma in the same line.
        let start = |token: usize| self.tokens.get(token).map_or(self.text.len(), |token| token.start());
        let behind = match self.kind(end) {
            Some(TokenKind::Comma) => {
                let (last, next) = (start(end), start(end + 1));
                self.text[last..next].find('\n').map_or(next, |at| last + at)
            }
            _ => start(end),
        };
        let commented = self.comments_between(self.tokens[before].start(), behind) > 0;
        let blank = self.text[self.gap(token)].matches('\n').count() > 1;
        let short = |from: usize, to: usize| self.items.width(from, to) <= SHORT && !self.blocks.within(from, to);
        let shares = !blank && !commented && short(token, end) && short(before, token - 1);
        if shares && self.fits(token) { Space::One } else { line }
    }

    fn write(&mut self) {
        let pairs = super::brackets::Pairs::of(self.text, self.tokens);
        let attributes = self.attributes();
        for i in attributes..self.tokens.len() {
            let dropped =
                self.items.is_last_comma(i) && self.frames.last().is_some_and(|frame| !frame.form.ends_with_comma());
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
                    let form = pairs.partner(i).map_or(Form::Line, |close| self.form(i, close));
                    self.out.push_str(self.word(i));
                    let line = &self.out[self.line..];
                    let indent = line.len() - line.trim_start_matches(' ').len();
                    self.frames.push(Frame { form, indent, before: i + 1, item: i + 1 });
                }
                Some(TokenKind::Close) => drop(self.frames.pop()),
                Some(TokenKind::Comma) => {
                    if let Some(frame) = self.frames.last_mut() {
                        (frame.before, frame.item) = (frame.item, i + 1);
                    }
                }
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
            (Some(TokenKind::Open), Some(frame)) if frame.form.is_block() => {
                let closes = self.kind(token) == Some(TokenKind::Close);
                line(frame.indent + if closes { 0 } else { INDENT }, false)
            }
            (_, Some(frame)) if frame.form.is_block() && self.kind(token) == Some(TokenKind::Close) => {
                line(frame.indent, false)
            }
            (Some(TokenKind::Comma), Some(frame)) if self.kind(token) != Some(TokenKind::Close) => {
                let indent = frame.indent + INDENT;
                match frame.form {
                    Form::Line => self.flat(token),
                    Form::Fill => self.fill(token, indent),
                    Form::Rows if !self.text[self.gap(token)].contains('\n') && self.fits(token) => Space::One,
                    Form::Rows | Form::List => line(indent, true),
                    Form::Block => self.in_block(token, frame.before, indent),
                }
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
        let items = self.frames.last().map_or(0, |frame| frame.indent + if frame.form.is_block() { INDENT } else { 0 });
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
