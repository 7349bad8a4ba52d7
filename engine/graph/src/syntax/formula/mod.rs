//! The syntax of formulas, `"= 0.16 * waves + grain.dome"`, for the formatter and for editors.
//!
//! [`Formula::parse`] accepts every text: it marks missing and misplaced words and reads the rest as usual, so that an
//! unfinished formula has parts, too. The loader compiles formulas by other code (`shibo_value::expression`), which
//! reports mistakes; a test compares how both split a text.
pub(super) mod layout;
mod parse;
mod parts;
#[cfg(test)]
mod tests;
mod words;

pub use parts::{Formula, LocalName, OpenCall, Part, PartKind};
pub use words::{Word, WordKind, binding, words};

/// A formula with its equals sign as a literal, laid out as `format` does it: in a line that has `column` characters before
/// it and a comma after it, and whose other lines begin with `indent` spaces.
pub fn literal(formula: &str, column: usize, indent: usize) -> String {
    let plain = format!("\"{formula}\"");
    layout::Laid::of(&plain, false).map_or(plain, |laid| laid.literal(column, indent, super::format::WIDTH, "\n"))
}

/// The content of a string literal that holds a formula, by its bytes in the literal; `None` for a literal with escapes.
pub fn content(literal: &str) -> Option<std::ops::Range<usize>> {
    let hashes = literal.strip_prefix('r').map(|rest| rest.len() - rest.trim_start_matches('#').len());
    let start = hashes.map_or(0, |hashes| hashes + 1);
    let rest = literal.get(start..)?.strip_prefix('"')?;
    let closing = format!("\"{}", "#".repeat(hashes.unwrap_or(0)));
    let inside = rest.strip_suffix(closing.as_str()).unwrap_or(rest);
    let plain = hashes.is_some() || !inside.contains('\\');
    plain.then(|| start + 1..start + 1 + inside.len())
}

/// The formula in the content of a text: what follows its equals sign, by its first byte; `None` for other texts.
pub fn begins(content: &str) -> Option<usize> {
    (content.starts_with('=') && !content.starts_with("==")).then_some(1)
}
