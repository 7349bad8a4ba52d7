//! How the items of a bracket that does not fit into a line fill several lines.
//!
//! Short items fill lines. The first one stands behind the opening bracket, and the closing bracket behind the last one.
//! A bracket with a comment or a long formula inside is a block instead: its items begin on a new line, the closing
//! bracket has a line of its own, and each long item has one, too. Each item of a list of structs has a line of its own.
use super::brackets::Pairs;
use super::lex::{Token, TokenKind};
use std::collections::BTreeMap;
use std::ops::Range;

/// Longer formulas have a line of their own.
const LONG: usize = 40;
/// Lists of more tokens are not searched for structs.
const MOST: usize = 4096;

/// How the items of a bracket are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// In one line.
    Line,
    /// As many in a line as fit, from the opening bracket on.
    Fill,
    /// On lines between those of the brackets; short items share a line.
    Block,
    /// On lines between those of the brackets, one per line.
    List,
    /// On lines between those of the brackets, in the rows of the author.
    Rows,
}

impl Form {
    /// Returns true if the closing bracket has a line of its own.
    pub(super) fn is_block(self) -> bool {
        !matches!(self, Self::Line | Self::Fill)
    }

    /// Returns true if a comma follows the last item.
    pub(super) fn ends_with_comma(self) -> bool {
        self.is_block()
    }
}

/// The brackets that do not fill lines.
#[derive(Default)]
pub(super) struct Blocks {
    /// By the token that opens it: true for a list of structs.
    open: BTreeMap<usize, bool>,
    /// The tokens of long formulas.
    long: Vec<usize>,
}

impl Blocks {
    /// Finds them. `formula` gives the width of a formula by its token, and whether it has several lines.
    pub(super) fn of(
        text: &str,
        tokens: &[Token],
        comments: &[Range<usize>],
        formula: impl Fn(usize) -> Option<(usize, bool)>,
    ) -> Self {
        let pairs = Pairs::of(text, tokens);
        let (mut found, mut stack) = (Self::default(), Vec::<usize>::new());
        let mut comment = 0;
        for (i, token) in tokens.iter().enumerate() {
            let commented = comments.get(comment).is_some_and(|place| place.end <= token.start());
            while comments.get(comment).is_some_and(|place| place.end <= token.start()) {
                comment += 1;
            }
            let (width, tall) = formula(i).unwrap_or((0, text[token.range()].contains('\n')));
            if width > LONG || tall {
                found.long.push(i);
            }
            if commented || width > LONG || tall {
                // All brackets around it are blocks; the outer ones of a block are blocks already.
                for open in stack.iter().rev() {
                    if found.open.insert(*open, false).is_some() {
                        break;
                    }
                }
            }
            match token.kind() {
                TokenKind::Open => stack.push(i),
                TokenKind::Close => drop(stack.pop()),
                _ => {}
            }
        }
        for open in 0..tokens.len() {
            if tokens[open].kind() == TokenKind::Open
                && &text[tokens[open].range()] == "["
                && let Some(close) = pairs.partner(open)
                && close - open < MOST
                && holds_structs(tokens, open, close)
            {
                found.open.insert(open, true);
            }
        }
        found
    }

    /// Returns true if a bracket is a block when it does not fit into a line.
    pub(super) fn has(&self, open: usize) -> bool {
        self.open.contains_key(&open)
    }

    /// Returns true if a bracket is a list of structs.
    pub(super) fn is_list(&self, open: usize) -> bool {
        self.open.get(&open) == Some(&true)
    }

    /// Returns true if a block or a long formula lies between two tokens.
    pub(super) fn within(&self, from: usize, to: usize) -> bool {
        let long = self.long.partition_point(|token| *token < from);
        self.long.get(long).is_some_and(|token| *token < to) || self.open.range(from..to.max(from)).next().is_some()
    }
}

/// The items of brackets, by their first tokens.
pub(super) struct Items<'t> {
    tokens: &'t [Token],
    /// For each token, the width of all text before it on one line, and the number of tokens and comments before it
    /// that need a line break.
    pub(super) widths: Vec<(usize, usize)>,
}

impl<'t> Items<'t> {
    /// Begins without widths.
    pub(super) fn new(tokens: &'t [Token]) -> Self {
        Self { tokens, widths: Vec::with_capacity(tokens.len() + 1) }
    }

    fn kind(&self, token: usize) -> Option<TokenKind> {
        self.tokens.get(token).map(|token| token.kind())
    }

    /// Width of the text between two tokens on one line, with the space before the first one.
    pub(super) fn width(&self, from: usize, to: usize) -> usize {
        self.widths[to].0 - self.widths[from].0
    }

    /// The end of an item: its comma, or the bracket that closes it.
    pub(super) fn end(&self, token: usize) -> usize {
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
        end.unwrap_or(self.tokens.len())
    }

    /// The end of the part of an item that stays in one line: the item itself, or, if it is longer than `most`, its
    /// first inner item.
    pub(super) fn beginning(&self, token: usize, most: usize) -> usize {
        let end = self.end(token);
        match (token..end).find(|i| self.kind(*i) == Some(TokenKind::Open)) {
            Some(open) if self.width(token, end) > most => self.end(open + 1),
            _ => end,
        }
    }

    /// The end of the brackets that close at `end` in the same line; `forms` are those of the brackets around it.
    pub(super) fn end_of_closers(&self, mut end: usize, forms: impl Iterator<Item = Form>) -> usize {
        for form in forms {
            if self.is_last_comma(end) {
                end += 1;
            }
            if form != Form::Fill || self.kind(end) != Some(TokenKind::Close) {
                break;
            }
            end += 1;
        }
        end
    }

    /// Returns true if a token is a comma that is left out on one line.
    pub(super) fn is_last_comma(&self, token: usize) -> bool {
        self.kind(token) == Some(TokenKind::Comma) && self.kind(token + 1) == Some(TokenKind::Close)
    }
}

/// Returns true if all items of a list are structs with names, or calls.
fn holds_structs(tokens: &[Token], open: usize, close: usize) -> bool {
    let (mut depth, mut items, mut named) = (0_usize, 0, 0);
    for token in &tokens[open + 1..close] {
        match token.kind() {
            TokenKind::Open => {
                items += usize::from(depth == 0);
                depth += 1;
            }
            TokenKind::Close => depth = depth.saturating_sub(1),
            TokenKind::Colon if depth == 1 => named = items,
            TokenKind::Comma | TokenKind::Colon => {}
            _ if depth == 0 && token.kind() != TokenKind::Ident => return false,
            _ => {}
        }
    }
    items > 1 && named == items
}
