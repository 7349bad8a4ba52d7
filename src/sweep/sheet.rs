//! A contact sheet: a small picture of every variant with its values below. A sweep of two names becomes a matrix: a
//! row for each value of the first and a column for each value of the second, with the values beside and above. The
//! sheet is written one row of pictures at a time, so its length needs little memory.
use super::axis::{Axis, variant};
use super::font;
use crate::quit::Quit;
use shibo_picture::{Compression, Depth, Encoding, Format, PictureSpec, Transfer, WriteError, Writer};
use shibo_value::Tile;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Longer side of a small picture in pixels.
pub(crate) const SIDE: u32 = 128;
/// Gap between pictures.
const GAP: u32 = 8;
/// Maximum number of pictures side by side.
const MOST: usize = 64;
/// Maximum number of columns of a matrix.
const MOST_COLUMNS: usize = 400;
/// Maximum number of lines of a label.
const LINES: usize = 4;
/// Grey of paper and letters, linear.
const PAPER: f32 = 0.03;
const INK: f32 = 0.6;

/// Arrangement of a sheet.
pub(crate) enum Layout {
    /// Pictures with labels of at most `longest` letters.
    List { count: usize, longest: usize },
    /// Rows and columns with labels.
    Matrix { rows: Vec<String>, columns: Vec<String> },
}

impl Layout {
    /// Arrangement for the variants of a sweep; `label` formats values.
    pub(crate) fn of(axes: &[Axis], count: usize, label: impl Fn(&[(&str, &str)]) -> String) -> Self {
        if let [rows, columns] = axes
            && columns.values.len() <= MOST_COLUMNS
        {
            let all =
                |axis: &Axis| axis.values.iter().map(|value| label(&[(axis.name.as_str(), value.as_str())])).collect();
            return Self::Matrix { rows: all(rows), columns: all(columns) };
        }
        let longest = (0..count).map(|number| label(&variant(axes, number)).chars().count()).max().unwrap_or(1);
        Self::List { count, longest }
    }

    fn count(&self) -> usize {
        match self {
            Self::List { count, .. } => *count,
            Self::Matrix { rows, columns } => rows.len() * columns.len(),
        }
    }

    /// Number of pictures side by side.
    fn across(&self) -> usize {
        match self {
            Self::List { count, .. } => (1..MOST).find(|n| n * n >= *count).unwrap_or(MOST),
            Self::Matrix { columns, .. } => columns.len(),
        }
    }

    /// Lines of labels below pictures, and above all of them.
    fn lines(&self) -> (u32, u32) {
        let lines = |longest: usize| u32::try_from(longest.div_ceil(letters()).clamp(1, LINES)).unwrap_or(1);
        match self {
            Self::List { longest, .. } => (lines(*longest), 0),
            Self::Matrix { columns, .. } => (0, lines(longest_of(columns))),
        }
    }

    /// Pixels left of the pictures.
    fn left(&self) -> u32 {
        match self {
            Self::List { .. } => GAP,
            Self::Matrix { rows, .. } => {
                let letters = u32::try_from(longest_of(rows).min(letters())).unwrap_or(0);
                GAP + letters * u32::try_from(font::WIDTH).unwrap_or(0) + GAP
            }
        }
    }
}

fn longest_of(labels: &[String]) -> usize {
    labels.iter().map(|label| label.chars().count()).max().unwrap_or(1)
}

/// A sheet under construction.
pub(crate) struct Sheet {
    writer: Writer,
    layout: Layout,
    width: usize,
    row: Vec<(Option<Tile>, String)>,
    done: usize,
}

impl Sheet {
    /// Starts a sheet; `key` identifies its whole content.
    pub(crate) fn create(path: &Path, layout: Layout, key: &str) -> Result<Self, Quit> {
        let across = layout.across();
        let (below, above) = layout.lines();
        let rows = u32::try_from(layout.count().div_ceil(across)).unwrap_or(u32::MAX);
        let width = layout.left() + u32::try_from(across).unwrap_or(1) * (SIDE + GAP);
        let spec = PictureSpec {
            width,
            height: head(above) + rows * height(below) + GAP,
            channels: ["R", "G", "B"].map(str::to_owned).to_vec(),
            format: Format::Png,
            depth: Depth::U8,
            encoding: Encoding { transfer: Transfer::Srgb, ..Encoding::default() },
            compression: Compression::Fast,
            mips: Vec::new(),
            chromaticities: None,
            pixel_mm: None,
            metadata: vec![("shibo:sheet".into(), key.into())],
        };
        let writer = Writer::create(path, &spec).map_err(failed)?;
        let mut sheet = Self { writer, layout, width: width as usize, row: Vec::new(), done: 0 };
        sheet.write_head(above)?;
        Ok(sheet)
    }

    /// Adds the next picture, with three channels, and its label.
    pub(crate) fn add(&mut self, tile: Option<Tile>, label: String) -> Result<(), Quit> {
        self.row.push((tile, label));
        self.done += 1;
        if self.row.len() == self.layout.across() || self.done == self.layout.count() {
            self.write_row()
        } else {
            Ok(())
        }
    }

    /// Left edge of a column of pictures.
    fn x(&self, column: usize) -> usize {
        self.layout.left() as usize + column * (SIDE + GAP) as usize
    }

    /// Writes the labels of the columns.
    fn write_head(&mut self, lines: u32) -> Result<(), Quit> {
        let Layout::Matrix { columns, .. } = &self.layout else { return Ok(()) };
        let mut band = Band::new(self.width, head(lines));
        for (column, label) in columns.iter().enumerate() {
            band.label(label, self.x(column), GAP as usize, lines);
        }
        self.write(&band)
    }

    fn write_row(&mut self) -> Result<(), Quit> {
        let (below, _) = self.layout.lines();
        let mut band = Band::new(self.width, height(below));
        let (row, left) = (std::mem::take(&mut self.row), GAP as usize);
        if let Layout::Matrix { rows, columns } = &self.layout
            && let Some(label) = rows.get((self.done - 1) / columns.len())
        {
            let lines = label.chars().count().div_ceil(letters()).clamp(1, LINES);
            let middle = (GAP + SIDE / 2) as usize - lines * font::HEIGHT / 2;
            band.label(label, left, middle, u32::try_from(lines).unwrap_or(1));
        }
        for (column, (tile, label)) in row.into_iter().enumerate() {
            if let Some(tile) = tile {
                band.picture(&tile, self.x(column), GAP as usize);
            }
            band.label(&label, self.x(column), (GAP + SIDE) as usize + 3, below);
        }
        self.write(&band)
    }

    fn write(&mut self, band: &Band) -> Result<(), Quit> {
        let planes: Vec<&[f32]> = band.planes.iter().map(Vec::as_slice).collect();
        let rows = u32::try_from(planes[0].len() / band.width).unwrap_or(0);
        self.writer.write_rows(&planes, rows).map_err(failed)
    }

    /// Completes the sheet.
    pub(crate) fn finish(mut self) -> Result<(), Quit> {
        self.write(&Band::new(self.width, GAP))?;
        self.writer.finish().map(drop).map_err(failed)
    }
}

/// Returns whether the sheet with this key exists.
pub(crate) fn is_there(path: &Path, key: &str) -> bool {
    // The key is stored before the pixels.
    let mut start = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(4096).read_to_end(&mut start));
    read.is_ok() && start.windows(key.len()).any(|window| window == key.as_bytes())
}

/// Path of a sheet: in the folder of the pictures, unless it names a folder itself.
pub(crate) fn path(given: &Path, out: &Path) -> PathBuf {
    if given.components().count() > 1 { given.to_path_buf() } else { out.join(given) }
}

fn failed(error: WriteError) -> Quit {
    Quit::failed(error.to_string())
}

/// Letters per line.
fn letters() -> usize {
    SIDE as usize / font::WIDTH
}

/// Height of a row of pictures with its labels.
fn height(lines: u32) -> u32 {
    GAP + SIDE + 4 + lines * u32::try_from(font::HEIGHT).unwrap_or(0)
}

/// Height of the labels of columns.
fn head(lines: u32) -> u32 {
    if lines == 0 { 0 } else { GAP + lines * u32::try_from(font::HEIGHT).unwrap_or(0) }
}

/// Rows of a sheet.
struct Band {
    width: usize,
    planes: Vec<Vec<f32>>,
}

impl Band {
    /// Empty rows.
    fn new(width: usize, rows: u32) -> Self {
        Self { width, planes: vec![vec![PAPER; width * rows as usize]; 3] }
    }

    /// Draws a label in at most `lines` lines.
    fn label(&mut self, label: &str, left: usize, top: usize, lines: u32) {
        let word: Vec<char> = label.chars().collect();
        for (line, part) in word.chunks(letters()).take(lines as usize).enumerate() {
            self.text(part, left, top + line * font::HEIGHT);
        }
    }

    fn picture(&mut self, tile: &Tile, left: usize, top: usize) {
        for (channel, plane) in self.planes.iter_mut().enumerate() {
            for row in 0..tile.height().min(SIDE as usize) {
                let line = tile.row(channel.min(tile.channels() - 1), row);
                let length = line.len().min(SIDE as usize);
                let at = (top + row) * self.width + left;
                plane[at..at + length].copy_from_slice(&line[..length]);
            }
        }
    }

    fn text(&mut self, text: &[char], left: usize, top: usize) {
        for (i, letter) in text.iter().enumerate() {
            for (column, bits) in font::columns(*letter).into_iter().enumerate() {
                for row in (0..8).filter(|row| bits >> row & 1 == 1) {
                    let at = (top + row) * self.width + left + i * font::WIDTH + column;
                    self.planes.iter_mut().filter_map(|plane| plane.get_mut(at)).for_each(|value| *value = INK);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheet_size_fits_all_pictures() {
        let dir = tempfile::tempdir().unwrap();
        for (count, size) in [(1, [144_u32, 157]), (5, [416, 306]), (5000, [8712, 11_779])] {
            let path = dir.path().join("sheet.png");
            let mut sheet = Sheet::create(&path, Layout::List { count, longest: 10 }, "the key").unwrap();
            (0..count).for_each(|i| sheet.add(None, format!("seed={i}")).unwrap());
            sheet.finish().unwrap();
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(bytes[16..24], *size.map(u32::to_be_bytes).as_flattened(), "{count}");
            assert!(is_there(&path, "the key") && !is_there(&path, "another key"));
        }
    }

    #[test]
    fn two_names_make_a_matrix() {
        let axes = |text: &[&str]| text.iter().map(|text| super::super::axis(text).unwrap()).collect::<Vec<_>>();
        let label =
            |values: &[(&str, &str)]| values.iter().map(|(n, v)| format!("{n}={v}")).collect::<Vec<_>>().join(" ");
        let two = axes(&["a=1..2", "b=x,y,z"]);
        let Layout::Matrix { rows, columns } = Layout::of(&two, 6, label) else { panic!("a list") };
        assert_eq!((rows.join(" "), columns.join(" ")), ("a=1 a=2".into(), "b=x b=y b=z".into()));
        for others in [&["a=1..6"][..], &["a=1", "b=1", "c=1"], &["a=1", "b=1..500"]] {
            assert!(matches!(Layout::of(&axes(others), 6, label), Layout::List { .. }), "{others:?}");
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("sheet.png");
        let mut sheet = Sheet::create(&path, Layout::of(&two, 6, label), "key").unwrap();
        (0..6).for_each(|_| sheet.add(None, String::new()).unwrap());
        sheet.finish().unwrap();
        // Three columns beside labels of three letters, two rows below one line of labels.
        let size = [8 + 3 * 6 + 8 + 3 * 136, 17 + 2 * 140 + 8_u32];
        assert_eq!(std::fs::read(&path).unwrap()[16..24], *size.map(u32::to_be_bytes).as_flattened());
    }
}
