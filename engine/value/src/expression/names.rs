//! The names in an expression, for the linker and for editors.
use super::scan::{Kind, Word, scan_all};
use std::collections::HashSet;
use std::ops::Range;

/// A name in an expression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NameUse {
    /// The name: with all parts after dots for a name and a function, without them for a local name and a parameter.
    pub name: String,
    /// Its bytes; those of a parameter begin with the `$`.
    pub range: Range<usize>,
    /// Its kind.
    pub kind: UseKind,
}

/// Kind of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UseKind {
    /// A name that the surroundings define, such as a node; perhaps with components.
    Name,
    /// A parameter.
    Param,
    /// A function, of the language or of the user.
    Function,
    /// A local name, where it is defined or used.
    Local,
}

/// All names in a text, in order, without the constants `true` and `false`. Parts of the text that have no meaning are
/// skipped, so the text may be faulty.
pub fn names_in(text: &str) -> Vec<NameUse> {
    let (words, _) = scan_all(text);
    let is = |index: usize, kind: Kind| words.get(index).is_some_and(|word: &Word| word.kind == kind);
    let mut uses = Vec::new();
    let mut locals: HashSet<&str> = HashSet::new();
    // The name that is visible from the next semicolon on.
    let mut defined = None;
    for (index, word) in words.iter().enumerate() {
        let range = word.range.clone();
        let written = &text[range.clone()];
        let first = |from: &str| from.split('.').next().unwrap_or(from).len();
        let (kind, start, end) = match word.kind {
            Kind::Semicolon => {
                locals.extend(defined.take());
                continue;
            }
            Kind::Param => (UseKind::Param, range.start + 1, range.start + 1 + first(&written[1..])),
            Kind::Name if written == "let" && is(index + 1, Kind::Name) => continue,
            Kind::Name
                if is(index + 1, Kind::Assign) && index > 0 && text[words[index - 1].range.clone()] == *"let" =>
            {
                defined = Some(written);
                (UseKind::Local, range.start, range.end)
            }
            Kind::Name if is(index + 1, Kind::Open) => (UseKind::Function, range.start, range.end),
            Kind::Name if locals.contains(&written[..first(written)]) => {
                (UseKind::Local, range.start, range.start + first(written))
            }
            Kind::Name if written != "true" && written != "false" => (UseKind::Name, range.start, range.end),
            _ => continue,
        };
        uses.push(NameUse { name: text[start..end].to_owned(), range: range.start..end, kind });
    }
    uses
}
