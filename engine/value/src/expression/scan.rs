//! Splits an expression into words.
use super::{Fault, bad};
use crate::parse_color;
use std::ops::Range;

/// Kind of a word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A number, with its value.
    Number(f64),
    /// A colour, `#rrggbb`, scene-linear.
    Color([f32; 3]),
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
    /// `;`
    Semicolon,
    /// `=`
    Assign,
    /// Components after a bracket: `.y`, with the dot.
    Letters,
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
    let (words, fault) = scan_all(text);
    fault.map_or(Ok(words), Err)
}

/// The words of a text, without parts that have no meaning, and the fault of the first of these parts.
pub(super) fn scan_all(text: &str) -> (Vec<Word>, Option<Fault>) {
    let (mut words, mut fault) = (Vec::new(), None);
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let (kind, len) = match c {
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            '$' => (Kind::Param, 1 + name_len(&rest[1..])),
            '.' if rest[1..].starts_with(is_first) => (Kind::Letters, 1 + run_len(&rest[1..])),
            '0'..='9' | '.' => {
                let len = number_len(rest);
                let Ok(value) = rest[..len].parse() else {
                    let word = super::shorten(&rest[..len]);
                    fault.get_or_insert_with(|| bad(at..at + len, format!("`{word}` is not a number")));
                    at += len;
                    continue;
                };
                (Kind::Number(value), len)
            }
            '#' => {
                let len = 1 + run_len(&rest[1..]);
                let Some(color) = parse_color(&rest[..len]) else {
                    let word = super::shorten(&rest[..len]);
                    let help = Some("write `#rgb` or `#rrggbb`".to_owned());
                    let wrong = bad(at..at + len, format!("`{word}` is not a colour"));
                    fault.get_or_insert(Fault { help, ..wrong });
                    at += len;
                    continue;
                };
                (Kind::Color(color), len)
            }
            c if is_word(c) => (Kind::Name, name_len(rest)),
            '(' => (Kind::Open, 1),
            ')' => (Kind::Close, 1),
            ',' => (Kind::Comma, 1),
            ';' => (Kind::Semicolon, 1),
            _ => match OPERATORS.into_iter().find(|operator| rest.starts_with(operator)) {
                Some(operator) => (Kind::Operator(operator), operator.len()),
                None if c == '!' => (Kind::Not, 1),
                None if c == '=' => (Kind::Assign, 1),
                None => {
                    fault.get_or_insert_with(|| unknown(c, at));
                    at += c.len_utf8();
                    continue;
                }
            },
        };
        words.push(Word { kind, range: at..at + len });
        at += len;
    }
    (words, fault)
}

fn unknown(c: char, at: usize) -> Fault {
    let help = match c {
        '&' => Some("write `&&`"),
        '|' => Some("write `||`"),
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

/// Returns true if a name, or a part of one, can begin with `c`.
fn is_first(c: char) -> bool {
    c == '_' || c.is_ascii_alphabetic()
}

/// The length of a run of letters, digits and underscores.
fn run_len(text: &str) -> usize {
    text.find(|c| !is_word(c)).unwrap_or(text.len())
}

/// The length of a name, including dot-separated parts.
fn name_len(text: &str) -> usize {
    let mut len = run_len(text);
    while len > 0 && text[len..].starts_with('.') && text[len + 1..].starts_with(is_first) {
        len += 1 + run_len(&text[len + 1..]);
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
