//! Readers for the values of a document, one function per kind of value; invalid values are reported and dropped.
use super::part::{Entry, Shape, SyntaxValue};
use super::report::Report;
pub(super) use crate::diagnostics::shorten;
use crate::diagnostics::{Code, Diagnostic};
use crate::export::FieldDecl;
use crate::syntax::is_name;

/// The error for a value of the wrong form.
pub(super) fn mismatch(part: &SyntaxValue, what: &str, wanted: &str) -> Diagnostic {
    let found = part.shape();
    let message = match found {
        Shape::Text(_) | Shape::Number(_) | Shape::Word(_) | Shape::Bytes => {
            format!("{what} must be {wanted}; found {} `{}`", found.describe(), shorten(part.str()))
        }
        _ => format!("{what} must be {wanted}; found {}", found.describe()),
    };
    let error = part.error(Code::TypeMismatch, message);
    match without_b(part) {
        Some(help) => error.help(help),
        None => error,
    }
}

/// The help for a byte string where a text is needed.
pub(super) fn without_b(part: &SyntaxValue) -> Option<String> {
    let text = part.str().strip_prefix('b').filter(|_| matches!(part.shape(), Shape::Bytes))?;
    Some(format!("write `{}`, without the `b`", shorten(text)))
}

/// Lowers the first letter of a library's message, as messages are written here.
pub(super) fn lower_first(message: &str) -> String {
    let mut chars = message.chars();
    chars.next().map(|c| c.to_ascii_lowercase()).into_iter().chain(chars).collect()
}

/// The byte offset of a position from `ron`, which counts lines and characters from 1.
pub(super) fn offset(text: &str, position: ron::error::Position) -> usize {
    let line_start = match position.line {
        0 | 1 => 0,
        line => text.match_indices('\n').nth(line - 2).map_or(text.len(), |(i, _)| i + 1),
    };
    let line = &text[line_start..];
    line.char_indices().nth(position.col.saturating_sub(1)).map_or(text.len(), |(i, _)| line_start + i)
}

/// Drops entries with a repeated key, and reports them.
pub(super) fn unique(entries: Vec<Entry>, what: &str, report: &mut Report) -> Vec<Entry> {
    let mut first = std::collections::BTreeMap::new();
    let mut kept = Vec::with_capacity(entries.len());
    for entry in entries {
        if let Some(span) = first.get(&entry.name) {
            let message = format!("{what} `{}` is given twice", shorten(&entry.name));
            report.push(entry.key.error(Code::DuplicateKey, message).related(*span, "it is given here first"));
        } else {
            first.insert(entry.name.clone(), entry.key.span());
            kept.push(entry);
        }
    }
    kept
}

/// Drops the things in a list that are too many for a file, and reports the first of them.
pub(super) fn at_most<T>(
    list: &mut Vec<T>,
    most: usize,
    key: impl Fn(&T) -> &SyntaxValue,
    what: &str,
    report: &mut Report,
) {
    if let Some(first) = list.get(most) {
        let message = format!("too many {what} in a file; there may be {most}");
        report.push(key(first).error(Code::TooLarge, message).help("move some of them to files of their own"));
        list.truncate(most);
    }
}

/// The entries of `{"name": value}`.
pub(super) fn map(part: &SyntaxValue, what: &str, report: &mut Report) -> Vec<Entry> {
    match part.shape() {
        Shape::Map(entries) => {
            for entry in entries.iter().filter(|entry| !matches!(entry.key.shape(), Shape::Text(_))) {
                let message = format!("names in `{what}` are texts; found `{}`", shorten(entry.key.str()));
                let help = without_b(&entry.key).unwrap_or_else(|| format!("write `\"{}\"`", shorten(entry.key.str())));
                report.push(entry.key.error(Code::TypeMismatch, message).help(help));
            }
            entries
        }
        _ => {
            report.push(mismatch(part, &format!("`{what}`"), "a map, `{ \"name\": value }`"));
            Vec::new()
        }
    }
}

/// The fields of `(name: value)` listed in `known`; reports the others.
pub(super) fn fields(part: &SyntaxValue, owner: &str, known: &[FieldDecl], report: &mut Report) -> Option<Vec<Entry>> {
    let Shape::Named(entries) = part.shape() else {
        report.push(mismatch(part, owner, "named fields in brackets, `(name: value)`"));
        return None;
    };
    let mut kept = Vec::new();
    for entry in unique(entries, "field", report) {
        if known.iter().any(|field| field.name == entry.name) {
            kept.push(entry);
        } else {
            let message = format!("{owner} has no field `{}`", shorten(&entry.name));
            let names = known.iter().map(|field| field.name);
            report.unknown(entry.key.error(Code::UnknownField, message), &entry.name, "field", names);
        }
    }
    Some(kept)
}

/// The value of a field.
pub(super) fn get<'a>(entries: &'a [Entry], name: &str) -> Option<&'a SyntaxValue> {
    entries.iter().find(|e| e.name == name).map(|e| &e.value)
}

/// A text.
pub(super) fn text(part: &SyntaxValue, what: &str, report: &mut Report) -> Option<String> {
    match part.shape() {
        Shape::Text(text) => Some(text),
        _ => {
            report.push(mismatch(part, &format!("`{what}`"), "a text in quotes"));
            None
        }
    }
}

/// A finite number.
pub(super) fn number(part: &SyntaxValue, what: &str, report: &mut Report) -> Option<f64> {
    match part.shape() {
        Shape::Number(value) if value.is_finite() => Some(value),
        Shape::Number(_) => {
            report.push(not_finite(part, what));
            None
        }
        _ => {
            report.push(mismatch(part, &format!("`{what}`"), "a number"));
            None
        }
    }
}

/// Two numbers.
pub(super) fn pair(part: &SyntaxValue, what: &str, report: &mut Report) -> Option<(f64, f64)> {
    match part.shape() {
        Shape::Tuple(items) | Shape::List(items) if items.len() == 2 => {
            let (a, b) = (number(&items[0], what, report), number(&items[1], what, report));
            a.zip(b)
        }
        _ => {
            report.push(mismatch(part, &format!("`{what}`"), "a pair of numbers"));
            None
        }
    }
}

/// The error for a number that is infinite or not a number.
pub(super) fn not_finite(part: &SyntaxValue, what: &str) -> Diagnostic {
    let message = format!("{what} is `{}`; it must be a finite number", shorten(part.str()));
    part.error(Code::NotFinite, message)
}

/// Reports a name that is not allowed.
pub(super) fn check_name(key: &SyntaxValue, name: &str, what: &str, report: &mut Report) -> bool {
    let good = is_name(name);
    if !good {
        let odd = name.chars().find(|c| !c.is_ascii());
        let why = odd.map_or(String::new(), |c| format!(": names have no `{c}`"));
        let message = format!("`{}` cannot be the name of {what}{why}", shorten(name));
        let help = "a name is letters from a to z and A to Z, digits and `_`, and does not begin with a digit; \
                    other letters may stand in texts for people: `doc`, `note` and comments";
        report.push(key.error(Code::BadName, message).help(help));
    }
    good
}

pub(super) fn choice<T: Copy>(part: &SyntaxValue, what: &str, choices: &[(&str, T)], report: &mut Report) -> Option<T> {
    let Shape::Word(word) = part.shape() else {
        let words: Vec<_> = choices.iter().map(|(word, _)| format!("`{word}`")).collect();
        report.push(mismatch(part, &format!("`{what}`"), &format!("one of {}", words.join(", "))));
        return None;
    };
    let found = choices.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
    if found.is_none() {
        let names = choices.iter().map(|(word, _)| *word);
        let message = format!("there is no {what} `{}`", shorten(&word));
        report.unknown(part.error(Code::UnknownVariant, message), &word, what, names);
    }
    found
}
