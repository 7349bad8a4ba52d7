//! Conflict marks, as `git merge` and `shibo merge` write them into a text.
use std::ops::Range;

/// The fewest characters of a mark.
const SHORTEST: usize = 7;

/// The marks of one conflict. The first version of the text stands between the two ranges.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Marks {
    /// Bytes of the line `<<<<<<< ours`, without its line break.
    pub first: Range<usize>,
    /// Bytes from the mark below the first version to the end of the line `>>>>>>> theirs`, without its line break.
    pub rest: Range<usize>,
}

/// All conflicts of a text, the last one first. Marks that are not complete are no conflict.
pub fn marks(text: &str) -> Vec<Marks> {
    let mut found = Vec::new();
    if !text.contains("<<<<<<<") {
        return found;
    }
    // The open conflict: length of its marks, range of its first line, start of the mark below the first version, and
    // true after the line `=======`.
    let mut open: Option<(usize, Range<usize>, Option<usize>, bool)> = None;
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let range = start..start + line.trim_end_matches(['\r', '\n']).len();
        start += line.len();
        let Some((sign, len)) = mark(&text[range.clone()]) else { continue };
        match (sign, &mut open) {
            ('<', None) => open = Some((len, range, None, false)),
            ('|' | '=', Some((length, _, below, second))) if len == *length && !*second => {
                below.get_or_insert(range.start);
                *second = sign == '=';
            }
            ('>', Some((length, first, Some(below), true))) if len == *length => {
                found.push(Marks { first: first.clone(), rest: *below..range.end });
                open = None;
            }
            _ => {}
        }
    }
    found.reverse();
    found
}

/// The sign of a mark and its length, if the line is one.
fn mark(line: &str) -> Option<(char, usize)> {
    let sign = line.chars().next().filter(|sign| "<|=>".contains(*sign))?;
    let len = line.len() - line.trim_start_matches(sign).len();
    let ends = line[len..].is_empty() || line[len..].starts_with(' ');
    (len >= SHORTEST && ends).then_some((sign, len))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::Code;
    use crate::syntax::Tree;

    const TEXT: &str = "(\n  a: 1,\n<<<<<<< ours\n  b: 2,\n||||||| base\n  b: 3,\n=======\n  b: [,\n>>>>>>> theirs\n  c: \"<<<<<<< x\",\n)";

    #[test]
    fn reads_first_version_of_conflict() {
        let tree = Tree::parse(TEXT);
        let found: Vec<_> = tree.errors().iter().map(|error| (error.code, &TEXT[error.range.clone()])).collect();
        assert_eq!(found, [(Code::Conflict, "<<<<<<< ours")]);
        let top = tree.value().unwrap();
        let read = |key: &str| top.entry(key).and_then(|entry| entry.value()).map(|value| value.text());
        assert_eq!([read("a"), read("b"), read("c")], [Some("1"), Some("2"), Some("\"<<<<<<< x\"")]);
        assert_eq!(tree.pieces().iter().map(|piece| &TEXT[piece.range.clone()]).collect::<String>(), TEXT);
    }

    #[test]
    fn ignores_incomplete_marks() {
        for cut in ["=======\n", ">>>>>>> theirs\n"] {
            assert_eq!(marks(&TEXT.replace(cut, "")), []);
        }
        let two = format!("{TEXT}\n{}", TEXT.replace("||||||| base\n  b: 3,\n", ""));
        assert_eq!(marks(&two).len(), 2);
        assert_eq!(marks(&TEXT.replace('\n', "\r\n")).len(), 1);
    }
}
