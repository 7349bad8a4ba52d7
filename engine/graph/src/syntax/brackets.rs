//! Pairs opening and closing brackets.
use super::lex::{Token, TokenKind};

/// Marks the absence of a token.
pub(super) const NONE: u32 = u32::MAX;
/// The most open brackets considered for a closing one.
const DEEPEST: usize = 256;

/// The pairs of brackets among tokens.
#[derive(Debug)]
pub(super) struct Pairs {
    /// For each token, the index of its partner, or [`NONE`].
    partner: Vec<u32>,
    /// The closing brackets without a partner, in order.
    pub(super) strays: Vec<usize>,
}

impl Pairs {
    /// Pairs the brackets of a text.
    pub(super) fn of(text: &str, tokens: &[Token]) -> Self {
        let mut pairs = Self { partner: vec![NONE; tokens.len()], strays: Vec::new() };
        if !pairs.all_fit(text, tokens) {
            pairs.partner.fill(NONE);
            Guess::new(text, tokens).pair(&mut pairs);
        }
        pairs
    }

    /// The partner of a token.
    pub(super) fn partner(&self, token: usize) -> Option<usize> {
        self.partner.get(token).copied().filter(|&partner| partner != NONE).map(|partner| partner as usize)
    }

    /// The first closing bracket without a partner, from token `from` on.
    pub(super) fn stray_from(&self, from: usize) -> Option<usize> {
        self.strays.get(self.strays.partition_point(|&stray| stray < from)).copied()
    }

    fn join(&mut self, open: usize, close: usize) {
        self.partner[open] = super::lex::short(close);
        self.partner[close] = super::lex::short(open);
    }

    /// Pairs each closing bracket with the last open one. Returns true if all match.
    fn all_fit(&mut self, text: &str, tokens: &[Token]) -> bool {
        let mut open = Vec::new();
        for (i, token) in tokens.iter().enumerate() {
            match token.kind() {
                TokenKind::Open => open.push(i),
                TokenKind::Close => match open.pop() {
                    Some(opening) if sort(text, tokens[opening]) == sort(text, *token) => self.join(opening, i),
                    _ => return false,
                },
                _ => {}
            }
        }
        open.is_empty()
    }
}

/// The sort of a bracket: 0 to 2 for `(`, `[` and `{`.
fn sort(text: &str, token: Token) -> usize {
    match text.as_bytes().get(token.start()) {
        Some(b'(' | b')') => 0,
        Some(b'[' | b']') => 1,
        _ => 2,
    }
}

/// Pairs the brackets of a text with missing or superfluous ones.
struct Guess<'a> {
    text: &'a str,
    tokens: &'a [Token],
    /// For each token its line, the indentation of that line, and whether only closing brackets and commas precede it
    /// there.
    places: Vec<Place>,
    open: Vec<usize>,
    /// Number of brackets of each sort in `open`.
    count: [usize; 3],
    /// For each sort, the remaining closing brackets minus the opening ones.
    surplus: [i64; 3],
}

#[derive(Clone, Copy)]
struct Place {
    line: u32,
    indent: u32,
    leads: bool,
}

impl<'a> Guess<'a> {
    fn new(text: &'a str, tokens: &'a [Token]) -> Self {
        let mut surplus = [0; 3];
        for token in tokens {
            match token.kind() {
                TokenKind::Open => surplus[sort(text, *token)] -= 1,
                TokenKind::Close => surplus[sort(text, *token)] += 1,
                _ => {}
            }
        }
        Self { text, tokens, places: places(text, tokens), open: Vec::new(), count: [0; 3], surplus }
    }

    fn pair(mut self, pairs: &mut Pairs) {
        for (i, token) in self.tokens.iter().enumerate() {
            let sort = sort(self.text, *token);
            match token.kind() {
                TokenKind::Open => {
                    self.open.push(i);
                    self.count[sort] += 1;
                }
                TokenKind::Close => match self.choose(i, sort) {
                    Some(depth) => {
                        self.close(depth + 1);
                        let opening = self.open.pop().unwrap_or_default();
                        self.count[self.sort(opening)] -= 1;
                        pairs.join(opening, i);
                    }
                    None => {
                        self.surplus[sort] -= 1;
                        pairs.strays.push(i);
                    }
                },
                _ => {}
            }
        }
    }

    /// Gives up the open brackets from index `depth` on.
    fn close(&mut self, depth: usize) {
        for opening in self.open.split_off(depth) {
            let sort = self.sort(opening);
            self.count[sort] -= 1;
            self.surplus[sort] += 1;
        }
    }

    fn sort(&self, token: usize) -> usize {
        sort(self.text, self.tokens[token])
    }

    /// Chooses the open bracket that a closing one belongs to; returns its index in `open`.
    fn choose(&mut self, close: usize, sort: usize) -> Option<usize> {
        let top = self.open.len().checked_sub(1)?;
        let fits = self.sort(self.open[top]) == sort;
        let place = self.places[close];
        let lowest = self.open.len().saturating_sub(DEEPEST);
        let nearest = |good: &dyn Fn(Place) -> bool| {
            let mut near = (lowest..=top).rev();
            near.find(|&i| self.sort(self.open[i]) == sort && good(self.places[self.open[i]]))
        };
        let possible = self.count[sort] > 0;
        let aligned = |other: Place| other.line == place.line || (place.leads && other.indent == place.indent);
        if fits && aligned(self.places[self.open[top]]) {
            return Some(top);
        }
        if let Some(found) = possible.then(|| nearest(&aligned)).flatten() {
            // This bracket is superfluous if the inner one is closed later.
            if !fits && self.surplus[sort] > 0 && self.surplus[self.sort(self.open[top])] >= 0 {
                return None;
            }
            // A wrong bracket in place of the right one closes the inner one.
            return Some(if self.is_mistyped(top, sort) { self.mistyped(top, sort) } else { found });
        }
        if fits {
            // This bracket is superfluous if the content of the outer one continues after it.
            let goes_on = self.surplus[sort] > 0 && self.next_indent(close) > self.places[self.open[top]].indent;
            return (!goes_on).then_some(top);
        }
        if self.is_mistyped(top, sort) {
            return Some(self.mistyped(top, sort));
        }
        if self.surplus[sort] > 0 || !possible {
            return None;
        }
        nearest(&|_| true)
    }

    /// The indentation of the line after a token's line; 0 if that line is far away.
    fn next_indent(&self, token: usize) -> u32 {
        let line = self.places[token].line;
        let mut after = self.places[token..].iter().take(DEEPEST);
        after.find(|place| place.line > line).map_or(0, |place| place.indent)
    }

    /// Returns true if a closing bracket of this sort stands in place of the innermost bracket's own: there is one too
    /// many of this sort, and one of the other is missing.
    fn is_mistyped(&self, top: usize, sort: usize) -> bool {
        let inner = self.sort(self.open[top]);
        inner != sort && self.surplus[sort] > 0 && self.surplus[inner] < 0
    }

    fn mistyped(&mut self, top: usize, sort: usize) -> usize {
        let inner = self.sort(self.open[top]);
        self.surplus[sort] -= 1;
        self.surplus[inner] += 1;
        top
    }
}

fn places(text: &str, tokens: &[Token]) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::with_capacity(tokens.len());
    let (mut line, mut indent, mut leads, mut end) = (0, 0, true, 0);
    for token in tokens {
        let gap = &text[end..token.start()];
        if let Some(at) = gap.rfind('\n') {
            line += super::lex::short(gap.matches('\n').count());
            // A comment before the token does not change its indentation.
            let blank = &gap[at + 1..];
            indent = super::lex::short(blank.len() - blank.trim_start_matches([' ', '\t']).len());
            leads = true;
        } else if end == 0 {
            indent = super::lex::short(gap.len());
        }
        places.push(Place { line, indent, leads });
        leads &= matches!(token.kind(), TokenKind::Close | TokenKind::Comma);
        line += super::lex::short(text[token.range()].matches('\n').count());
        end = token.end();
    }
    places
}
