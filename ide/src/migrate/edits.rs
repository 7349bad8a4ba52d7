//! Edits of a text that may lie inside each other.
use super::super::rename::Edit;
use std::ops::Range;

/// Edits in the order of the text. Of two edits that lie inside each other, the outer one counts.
#[derive(Debug, Default)]
pub(super) struct Edits {
    list: Vec<Edit>,
    sorted: bool,
}

impl Edits {
    /// Replaces a range by a text.
    pub(super) fn replace(&mut self, range: Range<usize>, text: impl Into<String>) {
        self.list.push(Edit { range, text: text.into() });
        self.sorted = false;
    }

    /// Adds other edits.
    pub(super) fn extend(&mut self, other: Self) {
        self.list.extend(other.list);
        self.sorted = false;
    }

    /// True if nothing changes.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Sorts the edits, the outer one first where two begin at one place.
    pub(super) fn sort(&mut self) {
        self.list.sort_by_key(|edit| (edit.range.start, !edit.range.is_empty(), std::cmp::Reverse(edit.range.end)));
        self.sorted = true;
    }

    /// A range of the text after the edits within it. The edits are sorted.
    pub(super) fn apply(&self, text: &str, range: Range<usize>) -> String {
        debug_assert!(self.sorted || self.list.is_empty(), "the edits are sorted");
        let mut out = String::with_capacity(range.len());
        let mut at = range.start;
        let first = self.list.partition_point(|edit| edit.range.start < range.start);
        for edit in &self.list[first..] {
            if edit.range.start >= range.end && !range.is_empty() {
                break;
            }
            if edit.range.start < at || edit.range.end > range.end {
                continue;
            }
            out.push_str(text.get(at..edit.range.start).unwrap_or_default());
            out.push_str(&edit.text);
            at = edit.range.end;
        }
        out.push_str(text.get(at..range.end).unwrap_or_default());
        out
    }
}

/// The range of an entry with its comma, and with its line if nothing else stands there.
pub(super) fn with_line(text: &str, range: Range<usize>) -> Range<usize> {
    let after = &text[range.end..];
    let blanks = after.len() - after.trim_start().len();
    let comma = after[blanks..].starts_with(',');
    let end = if comma { range.end + blanks + 1 } else { range.end };
    let start = line_start(text, range.start);
    let rest = &text[end..];
    let line = rest.find('\n').map_or(rest.len(), |at| at + 1);
    let alone = text[start..range.start].trim().is_empty();
    if alone && rest[..line].trim().is_empty() {
        return start..end + line;
    }
    // Other entries stand in the line.
    let spaces = rest.len() - rest.trim_start_matches(' ').len();
    range.start..end + spaces
}

/// The start of the line of a place.
pub(super) fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |newline| newline + 1)
}

/// The number of characters before a place in its line.
pub(super) fn column(text: &str, at: usize) -> usize {
    text[line_start(text, at)..at].chars().count()
}

/// Joins removed ranges that touch, and widens those between two blank lines by one of these.
pub(super) fn removals(text: &str, mut ranges: Vec<Range<usize>>) -> Vec<Range<usize>> {
    ranges.sort_by_key(|range| range.start);
    let mut joined: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    for range in &mut joined {
        let before = text[..range.start].trim_end_matches(' ');
        let above = before.ends_with("\n\n") || before.ends_with("\n\r\n");
        let below = text[range.end..].find('\n').filter(|at| text[range.end..range.end + at].trim().is_empty());
        if let (true, Some(below), true) = (above, below, text[..range.end].ends_with('\n')) {
            range.end += below + 1;
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn applies_outermost_edits() {
        let mut edits = Edits::default();
        edits.replace(2..3, "inner");
        edits.replace(1..4, "outer");
        edits.replace(5..5, "+");
        edits.sort();
        assert_eq!(edits.apply("abcdefg", 0..7), "aoutere+fg");
        assert_eq!(edits.apply("abcdefg", 2..4), "innerd");
    }

    #[test]
    fn removes_lines_and_items() {
        let text = "{\n  \"a\": 1,\n  \"b\": 2, \"c\": 3,\n}";
        let cut = |part: &str| {
            let at = text.find(part).expect("a part");
            let range = with_line(text, at..at + part.len());
            format!("{}|{}", &text[..range.start], &text[range.end..])
        };
        assert_eq!(cut("\"a\": 1"), "{\n|  \"b\": 2, \"c\": 3,\n}");
        assert_eq!(cut("\"b\": 2"), "{\n  \"a\": 1,\n  |\"c\": 3,\n}");
    }

    #[test]
    fn removes_one_of_two_blank_lines() {
        let text = "a\n\nb\nc\n\nd\n";
        let of = |first: Option<Range<usize>>| {
            removals(text, first.into_iter().chain(std::iter::once(5..7)).collect()).pop()
        };
        assert_eq!(of(Some(3..5)), Some(3..8));
        assert_eq!(of(None), Some(5..7));
    }
}
