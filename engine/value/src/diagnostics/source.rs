//! Texts and positions in them.
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The index of a text in a [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub usize);

/// A range of a text: byte offsets `start..end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The text.
    pub file: FileId,
    /// The first byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

/// The origin of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A file, or a text given in place of the file.
    File,
    /// The command line: the requested preset.
    Preset,
    /// The command line: the value of a parameter.
    Param {
        /// The parameter.
        name: String,
    },
    /// The command line: the resolution.
    Resolution,
}

/// The path of texts from the command line.
const COMMAND_LINE: &str = "<command line>";
/// Block size in bytes: the number of preceding characters is stored once per block.
const BLOCK: usize = 1024;

/// A text and its origin.
#[derive(Clone, Debug)]
pub struct Source {
    /// The path as the user would write it.
    pub path: PathBuf,
    /// The origin of the text.
    pub origin: Origin,
    /// The text.
    pub text: Arc<str>,
    /// Byte offsets of the line starts.
    lines: Arc<[usize]>,
    /// Number of characters that begin before each block, to find columns of very long lines quickly.
    characters: Arc<[usize]>,
}

impl Source {
    fn new(path: PathBuf, origin: Origin, text: Arc<str>) -> Self {
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(i, _)| i + 1)).collect();
        let mut count = 0;
        let mut characters = vec![0];
        for block in text.as_bytes().chunks(BLOCK) {
            count += begin(block);
            characters.push(count);
        }
        Self { path, origin, text, lines, characters: characters.into() }
    }

    /// Number of characters that begin before byte `offset`.
    fn characters(&self, offset: usize) -> usize {
        let block = offset / BLOCK;
        let before = self.characters.get(block).copied().unwrap_or(0);
        before + begin(&self.text.as_bytes()[block * BLOCK..offset])
    }
}

/// Number of characters that begin within these bytes of a text.
fn begin(bytes: &[u8]) -> usize {
    bytes.iter().filter(|&&byte| byte & 0xC0 != 0x80).count()
}

/// The length of a byte order mark.
const MARK: usize = '\u{FEFF}'.len_utf8();

/// A position as shown to people: lines and columns from 1, columns in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// The texts that spans point into.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    sources: Vec<Source>,
}

impl SourceMap {
    /// Adds the text of a file.
    pub fn add(&mut self, path: impl Into<PathBuf>, text: impl Into<Arc<str>>) -> FileId {
        self.push(Source::new(path.into(), Origin::File, text.into()))
    }

    /// Adds a command-line argument as typed, and returns the span of `value` at its end.
    pub fn add_argument(&mut self, origin: Origin, option: &str, value: &str) -> Span {
        let text = format!("{option}{value}");
        let (start, end) = (option.len(), text.len());
        let file = self.push(Source::new(COMMAND_LINE.into(), origin, text.into()));
        Span { file, start, end }
    }

    fn push(&mut self, source: Source) -> FileId {
        self.sources.push(source);
        FileId(self.sources.len() - 1)
    }

    /// The text of `file`.
    pub fn text(&self, file: FileId) -> Arc<str> {
        self.sources[file.0].text.clone()
    }

    /// The path of `file`.
    pub fn path(&self, file: FileId) -> &Path {
        &self.sources[file.0].path
    }

    /// The origin of the text of `file`.
    pub fn origin(&self, file: FileId) -> &Origin {
        &self.sources[file.0].origin
    }

    /// All texts, in the order in which they were added.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// The position of byte `offset` of `file`; offsets past the end, or inside a character, are clamped.
    pub fn position(&self, file: FileId, offset: usize) -> Position {
        let source = &self.sources[file.0];
        let mut offset = offset.min(source.text.len());
        while !source.text.is_char_boundary(offset) {
            offset -= 1;
        }
        // The first line begins at 0, so some line always begins at or before the offset.
        let line = source.lines.partition_point(|&start| start <= offset);
        let start = source.lines.get(line.saturating_sub(1)).copied().unwrap_or(0);
        // The byte order mark does not count, as in editors.
        let start = if start == 0 && source.text.starts_with('\u{FEFF}') { offset.min(MARK) } else { start };
        Position { line, column: source.characters(offset) - source.characters(start) + 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_characters() {
        let mut map = SourceMap::default();
        let file = map.add("a.ron", "シボ: 1,\nx");
        assert_eq!(map.position(file, 6), Position { line: 1, column: 3 });
        assert_eq!(map.position(file, "シボ: 1,\n".len()), Position { line: 2, column: 1 });
        assert_eq!(map.position(file, 999), Position { line: 2, column: 2 });
        assert_eq!(map.position(file, 1), Position { line: 1, column: 1 });
        let file = map.add("mark.ron", "\u{FEFF}ab\nc");
        let at = [0, 3, 4, 6].map(|offset| map.position(file, offset));
        assert_eq!(at.map(|at| (at.line, at.column)), [(1, 1), (1, 1), (1, 2), (2, 1)]);
    }

    #[test]
    fn long_lines_are_counted_like_short_ones() {
        let mut map = SourceMap::default();
        let text = format!("first\n{}\nlast", "aシé".repeat(2000));
        let file = map.add("a.ron", text.clone());
        for (i, (offset, _)) in "aシé".repeat(2000).char_indices().enumerate().step_by(7) {
            assert_eq!(map.position(file, 6 + offset), Position { line: 2, column: i + 1 });
        }
        assert_eq!(map.position(file, text.len()), Position { line: 3, column: 5 });
    }

    #[test]
    fn records_origins_of_arguments() {
        let mut map = SourceMap::default();
        let span = map.add_argument(Origin::Param { name: "a".into() }, "--set a=", "3");
        assert_eq!((&*map.text(span.file), span.start, span.end), ("--set a=3", 8, 9));
        assert_eq!(map.path(span.file), Path::new("<command line>"));
        assert_eq!(map.origin(span.file), &Origin::Param { name: "a".into() });
    }
}
