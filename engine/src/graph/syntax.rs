//! Whether a text is RON, and where it is not.
use super::read::lower_first;
use crate::diagnostics::{Code, Diagnostic, FileId, Span};
use crate::node::ron_options;
use serde::de::IgnoredAny;

/// The deepest nesting of brackets.
pub(super) const MAX_NESTING: usize = 128;

/// Checks a text.
pub(super) fn parse(text: &str, nesting: usize) -> Result<(), Box<ron::error::SpannedError>> {
    let options = ron_options().with_recursion_limit(nesting.min(MAX_NESTING));
    options.from_str::<IgnoredAny>(text).map(drop).map_err(Box::new)
}

/// The byte at a position of `ron`, which counts lines and characters from 1.
pub(super) fn offset(text: &str, position: ron::error::Position) -> usize {
    let line_start = match position.line {
        0 | 1 => 0,
        line => text.match_indices('\n').nth(line - 2).map_or(text.len(), |(i, _)| i + 1),
    };
    let line = &text[line_start..];
    line.char_indices().nth(position.col.saturating_sub(1)).map_or(text.len(), |(i, _)| line_start + i)
}

/// The error at the place where the text is not RON.
pub(super) fn explain(text: &str, file: FileId, error: &ron::error::SpannedError) -> Diagnostic {
    let start = offset(text, error.span.end);
    let end = start + text[start..].chars().next().filter(|&c| c != '\n').map_or(0, char::len_utf8);
    let span = Span { file, start, end };
    if matches!(error.code, ron::Error::ExceededRecursionLimit) {
        let message = format!("the file nests deeper than {MAX_NESTING} levels");
        return Diagnostic::new(Code::TooLarge, span, message);
    }
    let said = match &error.code {
        ron::Error::SuggestRawIdentifier(_) | ron::Error::ExpectedIdentifier => {
            "expected the name of a field".to_owned()
        }
        code => code.to_string(),
    };
    let mut diagnostic = Diagnostic::new(Code::Syntax, span, lower_first(&said));
    diagnostic.unfinished = is_unfinished(text, start, &error.code);
    match near(text, start, &error.code).or_else(|| hint(&error.code)) {
        Some(help) => diagnostic.help(help),
        None => diagnostic,
    }
}

/// Whether the text ends too early. For a string or a comment without an end, `ron` reports the beginning.
fn is_unfinished(text: &str, at: usize, error: &ron::Error) -> bool {
    let open = matches!(error, ron::Error::Eof | ron::Error::ExpectedStringEnd | ron::Error::UnclosedBlockComment);
    open || at >= text.trim_end().len()
}

/// What to do where the text itself tells what was meant.
fn near(text: &str, at: usize, error: &ron::Error) -> Option<&'static str> {
    let (before, here) = (text[..at].chars().next_back(), text[at..].chars().next()?);
    match error {
        ron::Error::ExpectedComma if here.is_alphabetic() && before.is_some_and(|c| c.is_ascii_digit()) => {
            Some("write numbers without a unit")
        }
        ron::Error::ExpectedComma if here == '.' && before.is_some_and(char::is_alphanumeric) => {
            Some("write the names of nodes in quotes, `\"node.port\"`")
        }
        ron::Error::ExpectedIdentifier if here == '"' => {
            Some("close the brackets before it with `)`; in `( )` names of fields have no quotes")
        }
        _ => None,
    }
}

fn hint(error: &ron::Error) -> Option<&'static str> {
    Some(match error {
        ron::Error::Eof => "a bracket, a quote or a value is missing at the end",
        ron::Error::ExpectedComma => "separate values with `,`",
        ron::Error::ExpectedMapColon => "write `name: value`, and `\"name\": value` in `{ }`",
        ron::Error::ExpectedStructLikeEnd | ron::Error::ExpectedMapEnd | ron::Error::ExpectedArrayEnd => {
            "a comma or a closing bracket is missing"
        }
        ron::Error::ExpectedStringEnd => "a closing quote is missing",
        _ => return None,
    })
}
