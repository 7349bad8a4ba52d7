//! Splits a formula into words.
use std::ops::Range;

/// Kind of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordKind {
    /// A number without a sign.
    Number,
    /// A colour, `#7a4526`.
    Color,
    /// A parameter with its `$`, and perhaps components: `$tint.r`.
    Param,
    /// A name with the parts after its dots: `grain.dome`. A name that is still being typed may end with a dot.
    Name,
    /// Components after a bracket, a colour or a blank, with the dot: `.xy`.
    Letters,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// `=`
    Assign,
    /// `!`
    Not,
    /// An operator, or the sign of a value.
    Operator,
    /// Text without a meaning.
    Unknown,
}

impl WordKind {
    /// True if letters directly behind a word of this kind are a word of their own: `(a, b).xy`.
    pub(super) const fn joins_letters(self) -> bool {
        matches!(self, Self::Close | Self::Letters | Self::Color)
    }
}

/// A word and its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// The kind.
    pub kind: WordKind,
    /// The bytes.
    pub range: Range<usize>,
}

/// Longer operators first, so that the longest match wins.
const OPERATORS: [&str; 14] = ["<=", ">=", "==", "!=", "&&", "||", "+", "-", "*", "/", "%", "^", "<", ">"];

/// How tightly an operator binds; higher numbers bind tighter. A sign binds by `SIGN`.
pub fn binding(operator: &str) -> u8 {
    match operator {
        "||" => 1,
        "&&" => 2,
        "+" | "-" => 4,
        "*" | "/" | "%" => 5,
        "^" => POWER,
        _ => COMPARES,
    }
}

/// Binding of comparisons.
pub(super) const COMPARES: u8 = 3;
/// Binding of signs.
pub(super) const SIGN: u8 = 6;
/// Binding of powers.
pub(super) const POWER: u8 = 7;

/// Splits a text into words; only blanks stand between them.
pub fn words(text: &str) -> Vec<Word> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        if c.is_whitespace() {
            at += c.len_utf8();
            continue;
        }
        let (kind, len) = word(&text[at..], c);
        words.push(Word { kind, range: at..at + len });
        at += len;
    }
    words
}

/// The kind and the length of the word at the beginning of a text.
fn word(rest: &str, c: char) -> (WordKind, usize) {
    let digit_follows = || rest[1..].starts_with(|c: char| c.is_ascii_digit());
    match c {
        '$' => (WordKind::Param, 1 + name_len(&rest[1..])),
        '.' if !digit_follows() => (WordKind::Letters, 1 + run_len(&rest[1..])),
        '0'..='9' | '.' => {
            let len = number_len(rest);
            let good = rest[..len].parse::<f64>().is_ok();
            (if good { WordKind::Number } else { WordKind::Unknown }, len)
        }
        '#' => {
            let len = 1 + run_len(&rest[1..]);
            let good = matches!(len, 4 | 7) && rest[1..len].bytes().all(|byte| byte.is_ascii_hexdigit());
            (if good { WordKind::Color } else { WordKind::Unknown }, len)
        }
        c if is_letter(c) => (WordKind::Name, name_len(rest)),
        '(' => (WordKind::Open, 1),
        ')' => (WordKind::Close, 1),
        ',' => (WordKind::Comma, 1),
        ';' => (WordKind::Semicolon, 1),
        _ => match OPERATORS.into_iter().find(|operator| rest.starts_with(operator)) {
            Some(operator) => (WordKind::Operator, operator.len()),
            None if c == '!' => (WordKind::Not, 1),
            None if c == '=' => (WordKind::Assign, 1),
            None => (WordKind::Unknown, c.len_utf8()),
        },
    }
}

fn is_letter(c: char) -> bool {
    c == '_' || c.is_ascii_alphanumeric()
}

/// The length of a run of letters, digits and underscores.
fn run_len(text: &str) -> usize {
    text.find(|c| !is_letter(c)).unwrap_or(text.len())
}

/// The length of a name with the parts after its dots, and with a dot at its end.
fn name_len(text: &str) -> usize {
    let mut len = run_len(text);
    while len > 0 && text[len..].starts_with('.') {
        let part = &text[len + 1..];
        if part.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            break;
        }
        let run = run_len(part);
        len += 1 + run;
        if run == 0 {
            break;
        }
    }
    len
}

fn number_len(text: &str) -> usize {
    let mut last = ' ';
    let end = text.char_indices().find(|&(_, c)| {
        let sign = matches!(c, '+' | '-') && matches!(last, 'e' | 'E');
        last = c;
        !(c.is_ascii_alphanumeric() || c == '.' || sign)
    });
    end.map_or(text.len(), |(at, _)| at)
}
