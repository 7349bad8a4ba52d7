//! Splits an expression into words.
use super::{Fault, bad};
use std::ops::Range;

/// Kind of a word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A number, with its value.
    Number(f64),
    /// A parameter of the graph with its `$`, and perhaps a component: `$color.r`.
    Param,
    /// The name of a function, a constant or something else, including parts after dots.
    Name,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `,`
    Comma,
    /// `!`
    Not,
    /// An operator between two values.
    Operator(&'static str),
}

/// A word and its bytes.
#[derive(Debug)]
pub(super) struct Word {
    pub(super) kind: Kind,
    pub(super) range: Range<usize>,
}

/// Longer operators first, so that the longest match wins.
const OPERATORS: [&str; 14] = ["<=", ">=", "==", "!=", "&&", "||", "+", "-", "*", "/", "%", "^", "<", ">"];

/// Splits a text into words.
pub(super) fn scan(text: &str) -> Result<Vec<Word>, Fault> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let operator = OPERATORS.into_iter().find(|operator| rest.starts_with(operator));
        let (kind, len) = match c {
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            '$' => (Kind::Param, 1 + name_len(&rest[1..])),
            '0'..='9' | '.' => {
                let len = number_len(rest);
                let Ok(value) = rest[..len].parse() else {
                    let word = super::shorten(&rest[..len]);
                    return Err(bad(at..at + len, format!("`{word}` is not a number")));
                };
                (Kind::Number(value), len)
            }
            c if is_word(c) => (Kind::Name, name_len(rest)),
            '(' => (Kind::Open, 1),
            ')' => (Kind::Close, 1),
            ',' => (Kind::Comma, 1),
            _ => match operator {
                Some(operator) => (Kind::Operator(operator), operator.len()),
                None if c == '!' => (Kind::Not, 1),
                None => return Err(unknown(c, at)),
            },
        };
        words.push(Word { kind, range: at..at + len });
        at += len;
    }
    Ok(words)
}

fn unknown(c: char, at: usize) -> Fault {
    let help = match c {
        '&' => Some("write `&&`"),
        '|' => Some("write `||`"),
        '=' => Some("write `==` to compare"),
        '?' | ':' => Some("write `if(condition, a, b)`"),
        '[' | ']' | '{' | '}' => Some("brackets are round, `( )`"),
        '"' | '\'' => Some("write words of choices without quotes"),
        _ => None,
    };
    let fault = bad(at..at + c.len_utf8(), format!("`{c}` has no meaning in an expression"));
    Fault { help: help.map(str::to_owned), ..fault }
}

fn is_word(c: char) -> bool {
    c == '_' || c.is_ascii_alphanumeric()
}

/// The length of a name, including dot-separated parts.
fn name_len(text: &str) -> usize {
    let run = |from: usize| from + text[from..].find(|c| !is_word(c)).unwrap_or(text.len() - from);
    let mut len = run(0);
    while len > 0
        && text[len..].starts_with('.')
        && text[len + 1..].starts_with(|c: char| c == '_' || c.is_ascii_alphabetic())
    {
        len = run(len + 1);
    }
    len
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
