//! Positions in texts as editors count them: lines, and characters in UTF-8 or UTF-16 units.
use lsp_types::{Position, PositionEncodingKind, Range as Span, TextDocumentContentChangeEvent as Change};
use std::cell::Cell;
use std::ops::Range;
use std::sync::Arc;

/// Unit of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Bytes.
    Utf8,
    /// UTF-16 units.
    Utf16,
}

impl Encoding {
    /// UTF-8 if the editor offers it, else UTF-16.
    pub(crate) fn negotiate(offered: Option<&[PositionEncodingKind]>) -> Self {
        let utf8 = offered.is_some_and(|kinds| kinds.contains(&PositionEncodingKind::UTF8));
        if utf8 { Self::Utf8 } else { Self::Utf16 }
    }

    /// Name in the protocol.
    pub(crate) fn kind(self) -> PositionEncodingKind {
        match self {
            Self::Utf8 => PositionEncodingKind::UTF8,
            Self::Utf16 => PositionEncodingKind::UTF16,
        }
    }

    fn len(self, c: char) -> usize {
        match self {
            Self::Utf8 => c.len_utf8(),
            Self::Utf16 => c.len_utf16(),
        }
    }
}

/// Lines of a text.
#[derive(Debug)]
pub(crate) struct Lines {
    text: Arc<str>,
    starts: Vec<usize>,
    /// True if bytes and characters are the same, so that nothing need be counted in a long line.
    is_ascii: bool,
    encoding: Encoding,
    /// Last converted position as byte, line and character; the next one is often just after it.
    last: Cell<(usize, usize, usize)>,
}

impl Lines {
    /// Splits a text.
    pub(crate) fn new(text: Arc<str>, encoding: Encoding) -> Self {
        let bytes = text.as_bytes();
        let ends = |i: &usize| bytes[*i] == b'\n' || (bytes[*i] == b'\r' && bytes.get(i + 1) != Some(&b'\n'));
        let starts = std::iter::once(0).chain((0..bytes.len()).filter(ends).map(|i| i + 1)).collect();
        let is_ascii = text.is_ascii();
        Self { text, starts, is_ascii, encoding, last: Cell::new((0, 0, 0)) }
    }

    /// A line without its line ending, and its offset.
    fn line(&self, line: usize) -> Option<(usize, &str)> {
        let start = *self.starts.get(line)?;
        let end = self.starts.get(line + 1).copied().unwrap_or(self.text.len());
        Some((start, self.text[start..end].trim_end_matches(['\n', '\r'])))
    }

    /// Byte offset of a position. Positions after the end of a line become its end, positions inside a character its
    /// start.
    pub(crate) fn offset(&self, position: Position) -> usize {
        let Some((start, line)) = self.line(position.line as usize) else { return self.text.len() };
        let mut left = position.character as usize;
        if self.is_ascii || self.encoding == Encoding::Utf8 {
            left = left.min(line.len());
            while !line.is_char_boundary(left) {
                left -= 1;
            }
            return start + left;
        }
        for (i, c) in line.char_indices() {
            if left < self.encoding.len(c) {
                return start + i;
            }
            left -= self.encoding.len(c);
        }
        start + line.len()
    }

    /// Byte range of a range; start and end may be swapped.
    pub(crate) fn range(&self, span: Span) -> Range<usize> {
        let (a, b) = (self.offset(span.start), self.offset(span.end));
        a.min(b)..a.max(b)
    }

    /// Position of a byte.
    pub(crate) fn position(&self, offset: usize) -> Position {
        let mut offset = offset.min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        let (last, last_line, last_character) = self.last.get();
        let line = if last <= offset && self.starts.get(last_line + 1).is_none_or(|next| offset < *next) {
            last_line
        } else {
            self.starts.partition_point(|start| *start <= offset) - 1
        };
        let start = self.starts[line];
        let (from, before) = if line == last_line && last <= offset { (last, last_character) } else { (start, 0) };
        let part = &self.text[from..offset];
        let character = before
            + match self.encoding {
                _ if self.is_ascii => part.len(),
                Encoding::Utf8 => part.len(),
                Encoding::Utf16 => part.chars().map(char::len_utf16).sum(),
            };
        self.last.set((offset, line, character));
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Position::new(count(line), count(character))
    }

    /// Range of some bytes.
    pub(crate) fn span(&self, range: &Range<usize>) -> Span {
        Span::new(self.position(range.start), self.position(range.end))
    }
}

/// Applies changes to a text one after the other.
pub(crate) fn changed(text: &str, changes: Vec<Change>, encoding: Encoding) -> String {
    let mut text = text.to_owned();
    for change in changes {
        match change.range {
            Some(span) => {
                let range = Lines::new(text.as_str().into(), encoding).range(span);
                text.replace_range(range, &change.text);
            }
            None => text = change.text,
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(encoding: Encoding) -> Lines {
        Lines::new("a\nシ😀b\r\n\rc".into(), encoding)
    }

    #[test]
    fn converts_positions_in_both_encodings() {
        for encoding in [Encoding::Utf8, Encoding::Utf16] {
            let lines = lines(encoding);
            let text = lines.text.clone();
            for (offset, c) in text.char_indices().filter(|(_, c)| !matches!(c, '\n' | '\r')) {
                let position = lines.position(offset);
                assert_eq!(lines.offset(position), offset, "{encoding:?} {c}");
            }
        }
        assert_eq!(lines(Encoding::Utf8).position(9), Position::new(1, 7));
        assert_eq!(lines(Encoding::Utf16).position(9), Position::new(1, 3));
        assert_eq!(lines(Encoding::Utf16).position(13), Position::new(3, 0));
    }

    #[test]
    fn clamps_invalid_positions() {
        let lines = lines(Encoding::Utf16);
        // Positions between the two halves of a character, after the end of a line, and after the end of the text.
        assert_eq!(lines.offset(Position::new(1, 2)), 5);
        assert_eq!(lines.offset(Position::new(1, 99)), 10);
        assert_eq!(lines.offset(Position::new(99, 0)), lines.text.len());
        assert_eq!(super::Lines::new("é".into(), Encoding::Utf8).offset(Position::new(0, 1)), 0);
        assert_eq!(lines.position(4), lines.position(2));
    }

    #[test]
    fn applies_changes_in_order() {
        let change = |line: u32, from: u32, to: u32, text: &str| Change {
            range: Some(Span::new(Position::new(line, from), Position::new(line, to))),
            range_length: None,
            text: text.to_owned(),
        };
        let changes = vec![change(0, 1, 1, "x\n"), change(1, 0, 2, "y"), change(9, 9, 9, "!")];
        assert_eq!(changed("a😀b", changes, Encoding::Utf16), "ax\nyb!");
        let whole = Change { range: None, range_length: None, text: "z".to_owned() };
        assert_eq!(changed("a", vec![whole], Encoding::Utf8), "z");
    }
}
