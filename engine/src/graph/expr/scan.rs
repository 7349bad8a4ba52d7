//! The words of an expression.
use super::{ExprError, bad};
use std::ops::Range;

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A number, with its value.
    Number(f64),
    /// A parameter of the graph, with its `$`.
    Param,
    /// The name of a function or of a constant.
    Name,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `,`
    Comma,
    /// `+ - * / % ^`
    Operator(char),
}

/// A word and the bytes where it stands.
#[derive(Debug)]
pub(super) struct Word {
    pub(super) kind: Kind,
    pub(super) range: Range<usize>,
}

/// Cuts a text into words.
pub(super) fn scan(text: &str) -> Result<Vec<Word>, ExprError> {
    let is_word = |c: char| c == '_' || c.is_ascii_alphanumeric();
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let run = |from: usize| from + rest[from..].find(|c| !is_word(c)).unwrap_or(rest.len() - from);
        let (kind, len) = match c {
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            '$' => (Kind::Param, run(1)),
            '0'..='9' | '.' => {
                let len = number_len(rest);
                let Ok(value) = rest[..len].parse() else {
                    let word = super::shorten(&rest[..len]);
                    return Err(bad(at..at + len, format!("`{word}` is not a number")));
                };
                (Kind::Number(value), len)
            }
            c if is_word(c) => (Kind::Name, run(0)),
            '(' => (Kind::Open, 1),
            ')' => (Kind::Close, 1),
            ',' => (Kind::Comma, 1),
            '+' | '-' | '*' | '/' | '%' | '^' => (Kind::Operator(c), 1),
            c => return Err(bad(at..at + c.len_utf8(), format!("`{c}` has no meaning in an expression"))),
        };
        words.push(Word { kind, range: at..at + len });
        at += len;
    }
    Ok(words)
}

fn number_len(text: &str) -> usize {
    let mut last = ' ';
    for (i, c) in text.char_indices() {
        let sign = matches!(c, '+' | '-') && matches!(last, 'e' | 'E');
        if !(c.is_ascii_alphanumeric() || c == '.' || sign) {
            return i;
        }
        last = c;
    }
    text.len()
}
