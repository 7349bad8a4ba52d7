//! Where the words of a RON text are.
//!
//! Whether a text is RON is decided by `ron` alone; this only tells, for a text that is, where each token begins and ends.
//! It accepts any text: what it does not know becomes [`Kind::Other`].

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A word, `true` and `r#word` included.
    Ident,
    /// A number with its sign; `inf` and `NaN` too.
    Number,
    /// A string, raw and byte strings included.
    Str,
    /// A character or a byte.
    Char,
    /// `(`, `[` or `{`.
    Open,
    /// `)`, `]` or `}`.
    Close,
    /// `,`
    Comma,
    /// `:`
    Colon,
    /// Anything else.
    Other,
}

/// A piece of a text that is neither space nor comment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Token {
    /// What it is.
    pub(super) kind: Kind,
    /// The first byte.
    pub(super) start: usize,
    /// One past the last byte.
    pub(super) end: usize,
}

/// The tokens of `text`.
pub(super) fn tokenize(text: &str) -> Vec<Token> {
    let mut lexer = Lexer { text, at: 0 };
    let mut tokens = Vec::with_capacity(text.len() / 5);
    loop {
        lexer.skip_blank();
        let start = lexer.at;
        let Some(first) = lexer.peek() else { return tokens };
        let kind = lexer.token(first);
        debug_assert!(lexer.at > start, "every token has a length");
        tokens.push(Token { kind, start, end: lexer.at });
    }
}

/// The value of a number as written in RON, underscores, bases and suffixes included; `None` if it is none.
pub(super) fn number(word: &str) -> Option<f64> {
    let (sign, digits) = match word.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, word.strip_prefix('+').unwrap_or(word)),
    };
    if let Some(value) = number_word(digits) {
        return Some(sign * value);
    }
    for (prefix, base) in [("0x", 16), ("0b", 2), ("0o", 8)] {
        if let Some(rest) = digits.strip_prefix(prefix) {
            return radix(rest, base).map(|value| sign * value);
        }
    }
    let plain: String = digits.chars().filter(|&c| c != '_').collect();
    let end = plain.find(['i', 'u', 'f']).unwrap_or(plain.len());
    plain[..end].parse::<f64>().ok().map(|value| sign * value)
}

/// The value of a number that is written as a word, without its sign.
fn number_word(word: &str) -> Option<f64> {
    match word {
        "inf" | "inff32" | "inff64" => Some(f64::INFINITY),
        "NaN" | "NaNf32" | "NaNf64" => Some(f64::NAN),
        _ => None,
    }
}

/// Whether a number is written as infinity, with or without a sign. One that is merely too large, such as `1e400`, is not.
pub(super) fn is_infinity(word: &str) -> bool {
    let unsigned = word.strip_prefix(['+', '-']).unwrap_or(word);
    number_word(unsigned).is_some_and(f64::is_infinite)
}

fn radix(digits: &str, base: u32) -> Option<f64> {
    let digits = digits.split(['i', 'u']).next()?;
    let mut value = 0.0;
    for c in digits.chars().filter(|&c| c != '_') {
        value = value * f64::from(base) + f64::from(c.to_digit(base)?);
    }
    Some(value)
}

/// Whether `name` may name a node, an input, a parameter or an import.
pub(super) fn is_name(name: &str) -> bool {
    let first = name.bytes().next();
    first.is_some_and(|b| b == b'_' || b.is_ascii_alphabetic())
        && name.bytes().all(|b| b == b'_' || b.is_ascii_alphanumeric())
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn take_while(&mut self, accept: impl Fn(char) -> bool) {
        let rest = self.rest();
        self.at += rest.find(|c| !accept(c)).unwrap_or(rest.len());
    }

    fn skip_blank(&mut self) {
        loop {
            self.take_while(is_blank);
            if self.rest().starts_with("//") {
                self.take_while(|c| c != '\n');
            } else if self.rest().starts_with("/*") {
                self.block_comment();
            } else {
                return;
            }
        }
    }

    fn block_comment(&mut self) {
        let mut depth = 0;
        while !self.rest().is_empty() {
            if self.rest().starts_with("/*") {
                depth += 1;
                self.at += 2;
            } else if self.rest().starts_with("*/") {
                depth -= 1;
                self.at += 2;
                if depth == 0 {
                    return;
                }
            } else {
                self.at += self.peek().map_or(0, char::len_utf8);
            }
        }
    }

    fn token(&mut self, first: char) -> Kind {
        let single = |lexer: &mut Self, kind| {
            lexer.at += first.len_utf8();
            kind
        };
        match first {
            '(' | '[' | '{' => single(self, Kind::Open),
            ')' | ']' | '}' => single(self, Kind::Close),
            ',' => single(self, Kind::Comma),
            ':' => single(self, Kind::Colon),
            '"' => self.string(),
            '\'' => self.character(),
            '0'..='9' | '+' | '-' | '.' => self.number(),
            c if c == '_' || c.is_alphabetic() => self.word(),
            _ => single(self, Kind::Other),
        }
    }

    fn string(&mut self) -> Kind {
        self.quoted('"');
        Kind::Str
    }

    /// Skips a quoted text with escapes, from the opening quote.
    fn quoted(&mut self, quote: char) {
        self.at += 1;
        let mut escaped = false;
        for (i, c) in self.rest().char_indices() {
            if escaped {
                escaped = false;
            } else if c == '\\' {
                escaped = true;
            } else if c == quote {
                self.at += i + 1;
                return;
            }
        }
        self.at = self.text.len();
    }

    fn character(&mut self) -> Kind {
        // RON also knows the quote itself, unescaped: '''.
        if self.rest().starts_with("'''") {
            self.at += 3;
        } else {
            self.quoted('\'');
        }
        Kind::Char
    }

    fn number(&mut self) -> Kind {
        let start = self.at;
        self.at += usize::from(self.rest().starts_with(['+', '-']));
        if self.peek().is_some_and(char::is_alphabetic) {
            self.take_while(|c| c == '_' || c.is_alphanumeric());
            return Kind::Number;
        }
        let mut last = ' ';
        let rest = self.rest();
        let based = rest.starts_with("0x") || rest.starts_with("0b") || rest.starts_with("0o");
        for (i, c) in rest.char_indices() {
            let sign = matches!(c, '+' | '-') && matches!(last, 'e' | 'E') && !based;
            let range = c == '.' && rest[i..].starts_with("..");
            if range || !(c.is_alphanumeric() || matches!(c, '.' | '_') || sign) {
                self.at += i;
                return self.number_or_other(start);
            }
            last = c;
        }
        self.at = self.text.len();
        self.number_or_other(start)
    }

    fn number_or_other(&mut self, start: usize) -> Kind {
        if self.at == start {
            self.at += 1;
        }
        if self.text[start..self.at].bytes().any(|b| b.is_ascii_digit()) { Kind::Number } else { Kind::Other }
    }

    fn word(&mut self) -> Kind {
        let rest = self.rest();
        for prefix in ["br", "r"] {
            if let Some(raw) = rest.strip_prefix(prefix)
                && raw.trim_start_matches('#').starts_with('"')
            {
                return self.raw_string(prefix.len());
            }
        }
        if rest.starts_with("b\"") {
            self.at += 1;
            return self.string();
        }
        if rest.starts_with("b'") {
            self.at += 1;
            return self.character();
        }
        if rest.starts_with("r#") {
            self.at += 2;
            self.take_while(|c| matches!(c, '_' | '.' | '+' | '-') || c.is_alphanumeric());
            return Kind::Ident;
        }
        let start = self.at;
        self.take_while(|c| c == '_' || c.is_alphanumeric());
        if number_word(&self.text[start..self.at]).is_some() { Kind::Number } else { Kind::Ident }
    }

    fn raw_string(&mut self, prefix: usize) -> Kind {
        let raw = &self.rest()[prefix..];
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        let close = format!("\"{}", "#".repeat(hashes));
        let body = self.at + prefix + hashes + 1;
        self.at = self.text[body..].find(&close).map_or(self.text.len(), |i| body + i + close.len());
        Kind::Str
    }
}

/// What RON takes for white space.
fn is_blank(c: char) -> bool {
    c.is_ascii_whitespace()
        || matches!(c, '\x0B' | '\u{85}' | '\u{200E}' | '\u{200F}' | '\u{2028}' | '\u{2029}' | '\u{FEFF}')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<(Kind, &str)> {
        tokenize(text).into_iter().map(|t| (t.kind, &text[t.start..t.end])).collect()
    }

    #[test]
    fn tokens_are_found_between_comments() {
        use Kind::*;
        assert_eq!(
            words("Kind(a: -1.5e-3, /* x /* y */ z */ \"s\\\"\": r#\"a\"b\"#) // end"),
            [
                (Ident, "Kind"),
                (Open, "("),
                (Ident, "a"),
                (Colon, ":"),
                (Number, "-1.5e-3"),
                (Comma, ","),
                (Str, "\"s\\\"\""),
                (Colon, ":"),
                (Str, "r#\"a\"b\"#"),
                (Close, ")"),
            ]
        );
        assert_eq!(
            words("1..2 -inf 'x' ''' é"),
            [(Number, "1"), (Other, "."), (Number, ".2"), (Number, "-inf"), (Char, "'x'"), (Char, "'''"), (Ident, "é"),]
        );
    }

    #[test]
    fn numbers_are_read_as_ron_does() {
        assert_eq!(number("1_000.5"), Some(1000.5));
        assert_eq!(number("-0x1F"), Some(-31.0));
        assert_eq!(number("3u8"), Some(3.0));
        assert_eq!(number("-inf"), Some(f64::NEG_INFINITY));
        assert_eq!(number("1e400"), Some(f64::INFINITY));
        assert!(number("NaN").is_some_and(f64::is_nan));
        assert!(["inf", "-inf", "+inff32"].into_iter().all(is_infinity));
        assert!(!["1e400", "NaN", "--inf", "infinity"].into_iter().any(is_infinity));
        assert_eq!(number("x"), None);
    }
}
