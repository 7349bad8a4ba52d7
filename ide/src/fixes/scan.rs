//! Splits any text into pieces, also one in the notation of other languages.
use std::ops::Range;

/// Sort of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PieceKind {
    /// A comment that begins with `#`; others are left out.
    Comment,
    /// A text in double quotes. The closing one may be missing at the end of the line.
    Text,
    /// A text in single quotes, which has more or less than one character or is a name.
    Single,
    /// A colour without quotes.
    Color,
    /// A fence of Markdown: the whole line.
    Fence,
    /// A word.
    Word,
    /// A number without its sign.
    Number,
    /// An opening bracket.
    Open,
    /// A closing bracket.
    Close,
    /// Any other character.
    Sign,
}

/// A piece of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) kind: PieceKind,
    pub(super) range: Range<usize>,
}

/// The pieces of a text, without blanks and comments of the language.
pub(super) fn pieces(text: &str) -> Vec<Piece> {
    let mut found = Vec::new();
    let mut at = 0;
    // The end of the present line, which is searched once, and true if only blanks precede in it.
    let (mut line, mut begins_line) = (0, true);
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        if line <= at {
            line = rest.find('\n').map_or(text.len(), |newline| at + newline);
        }
        let (kind, len) = if c.is_whitespace() {
            (None, c.len_utf8())
        } else if rest.starts_with("//") {
            (None, line - at)
        } else if rest.starts_with("/*") {
            (None, rest.find("*/").map_or(rest.len(), |end| end + 2))
        } else if rest.starts_with("```") && begins_line {
            (Some(PieceKind::Fence), line - at)
        } else if let Some(len) = raw(rest) {
            (Some(PieceKind::Text), len)
        } else if c == '"' {
            (Some(PieceKind::Text), quoted(rest))
        } else if c == '\'' {
            let end = rest[1..line - at].find('\'');
            end.map_or((Some(PieceKind::Sign), 1), |end| (Some(PieceKind::Single), end + 2))
        } else if c == '#' && text[..at].chars().next_back().is_none_or(|before| !before.is_alphanumeric()) {
            match color(rest) {
                Some(len) => (Some(PieceKind::Color), len),
                None => (Some(PieceKind::Comment), line - at),
            }
        } else if c.is_ascii_digit() || (c == '.' && rest[1..].starts_with(|c: char| c.is_ascii_digit())) {
            (Some(PieceKind::Number), number(rest))
        } else if c == '_' || c.is_alphabetic() {
            let end = rest.find(|c: char| !(c == '_' || c.is_alphanumeric()));
            (Some(PieceKind::Word), end.unwrap_or(rest.len()))
        } else if "([{".contains(c) {
            (Some(PieceKind::Open), 1)
        } else if ")]}".contains(c) {
            (Some(PieceKind::Close), 1)
        } else {
            (Some(PieceKind::Sign), c.len_utf8())
        };
        begins_line = c == '\n' || (begins_line && c.is_whitespace());
        if let Some(kind) = kind {
            found.push(Piece { kind, range: at..at + len });
        }
        at += len.max(1);
    }
    found
}

/// Length of a raw text, `r#"…"#`.
fn raw(rest: &str) -> Option<usize> {
    let inside = rest.strip_prefix('r')?;
    let signs = inside.len() - inside.trim_start_matches('#').len();
    let content = inside[signs..].strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(signs));
    Some(content.find(&end).map_or(rest.len(), |at| 2 + signs + at + end.len()))
}

/// Length of a text in double quotes; without the closing one, the length up to the end of the line.
fn quoted(rest: &str) -> usize {
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            '\n' => return at,
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    rest.len()
}

/// Length of a colour such as `#ff8000`.
fn color(rest: &str) -> Option<usize> {
    let digits = rest[1..].chars().take_while(char::is_ascii_hexdigit).count();
    let follows = rest[1 + digits..].chars().next();
    (matches!(digits, 6 | 8) && follows.is_none_or(|c| !c.is_alphanumeric())).then_some(1 + digits)
}

fn number(rest: &str) -> usize {
    let digits =
        |text: &str| text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '_'))).unwrap_or(text.len());
    let len = digits(rest);
    let exponent = rest[len..].strip_prefix(['e', 'E']).map(|rest| rest.trim_start_matches(['+', '-']));
    match exponent.filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit())) {
        Some(exponent) => rest.len() - exponent.len() + digits(exponent),
        None => len,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_long_lines() {
        assert_eq!(pieces(&"'a' ".repeat(100_000)).len(), 100_000);
        let fence = pieces("/* a\n*/ ```\n /**/\n  ```ron\nb");
        let kinds: Vec<_> = fence.iter().map(|piece| piece.kind).collect();
        assert_eq!(kinds[kinds.len() - 2..], [PieceKind::Fence, PieceKind::Word], "a fence stands alone in its line");
        assert_eq!(kinds.iter().filter(|kind| **kind == PieceKind::Fence).count(), 1);
    }

    #[test]
    fn splits_foreign_notation() {
        let text = "```ron\n# a 'b\nx = 'it' + 2.5e3mm; \"a\\\"b\" #ff8000 r#\"c\"# \"torn\n";
        let found: Vec<_> = pieces(text).into_iter().map(|piece| &text[piece.range]).collect();
        let expected = [
            "```ron",
            "# a 'b",
            "x",
            "=",
            "'it'",
            "+",
            "2.5e3",
            "mm",
            ";",
            "\"a\\\"b\"",
            "#ff8000",
            "r#\"c\"#",
            "\"torn",
        ];
        assert_eq!(found, expected);
    }
}
