//! A contact sheet: a small picture of every variant, and below each what it is. Written a row of pictures at a time, so that
//! a sheet of any length needs little memory.
use super::font;
use crate::quit::Quit;
use shibo_engine::picture::{Compression, Depth, Encoding, Format, PictureSpec, Transfer, WriteError, Writer};
use shibo_engine::value::Tile;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The longer side of a small picture, pixels.
pub(crate) const SIDE: u32 = 128;
/// Between pictures.
const GAP: u32 = 8;
/// The most pictures side by side.
const MOST: usize = 64;
/// The most lines of a label.
const LINES: usize = 4;
/// The grey of the paper and of the letters, linear.
const PAPER: f32 = 0.03;
const INK: f32 = 0.6;

/// A sheet under construction.
pub(crate) struct Sheet {
    writer: Writer,
    across: usize,
    count: usize,
    lines: u32,
    row: Vec<(Option<Tile>, String)>,
    done: usize,
}

impl Sheet {
    /// Starts a sheet of `count` pictures whose labels have at most `longest` letters; `key` names all that is on it.
    pub(crate) fn create(path: &Path, count: usize, longest: usize, key: &str) -> Result<Self, Quit> {
        let across = (1..MOST).find(|n| n * n >= count).unwrap_or(MOST);
        let lines = u32::try_from(longest.div_ceil(letters()).clamp(1, LINES)).unwrap_or(1);
        let rows = u32::try_from(count.div_ceil(across)).unwrap_or(u32::MAX);
        let columns = u32::try_from(across).unwrap_or(1);
        let spec = PictureSpec {
            width: columns * (SIDE + GAP) + GAP,
            height: rows * height(lines) + GAP,
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
        Ok(Self { writer, across, count, lines, row: Vec::new(), done: 0 })
    }

    /// Adds the next picture, of three channels, and its label.
    pub(crate) fn add(&mut self, tile: Option<Tile>, label: String) -> Result<(), Quit> {
        self.row.push((tile, label));
        self.done += 1;
        if self.row.len() == self.across || self.done == self.count { self.write_row() } else { Ok(()) }
    }

    fn write_row(&mut self) -> Result<(), Quit> {
        let (width, high) = (self.across * (SIDE + GAP) as usize + GAP as usize, height(self.lines) as usize);
        let mut band = Band { width, planes: vec![vec![PAPER; width * high]; 3] };
        for (i, (tile, label)) in self.row.drain(..).enumerate() {
            let left = GAP as usize + i * (SIDE + GAP) as usize;
            if let Some(tile) = tile {
                band.picture(&tile, left, GAP as usize);
            }
            let top = (GAP + SIDE) as usize + 3;
            let word: Vec<char> = label.chars().collect();
            for (line, part) in word.chunks(letters()).take(self.lines as usize).enumerate() {
                band.text(part, left, top + line * font::HEIGHT);
            }
        }
        let planes: Vec<&[f32]> = band.planes.iter().map(Vec::as_slice).collect();
        self.writer.write_rows(&planes, height(self.lines)).map_err(failed)
    }

    /// Completes the sheet.
    pub(crate) fn finish(mut self) -> Result<(), Quit> {
        let width = self.across * (SIDE + GAP) as usize + GAP as usize;
        let rest = vec![PAPER; width * GAP as usize];
        self.writer.write_rows(&[&rest, &rest, &rest], GAP).map_err(failed)?;
        self.writer.finish().map(drop).map_err(failed)
    }
}

/// Whether the sheet with this key is there.
pub(crate) fn is_there(path: &Path, key: &str) -> bool {
    // The key stands before the pixels.
    let mut start = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(4096).read_to_end(&mut start));
    read.is_ok() && start.windows(key.len()).any(|window| window == key.as_bytes())
}

/// The path of a sheet: in the folder of the pictures, unless it names a folder itself.
pub(crate) fn path(given: &Path, out: &Path) -> PathBuf {
    if given.components().count() > 1 { given.to_path_buf() } else { out.join(given) }
}

fn failed(error: WriteError) -> Quit {
    Quit::failed(error.to_string())
}

/// The letters of a line.
fn letters() -> usize {
    SIDE as usize / font::WIDTH
}

/// The rows that a row of pictures takes with its labels.
fn height(lines: u32) -> u32 {
    GAP + SIDE + 4 + lines * u32::try_from(font::HEIGHT).unwrap_or(0)
}

/// Rows of a sheet.
struct Band {
    width: usize,
    planes: Vec<Vec<f32>>,
}

impl Band {
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
    fn sheets_have_room_for_all() {
        let dir = tempfile::tempdir().unwrap();
        for (count, size) in [(1, [144_u32, 157]), (5, [416, 306]), (5000, [8712, 11_779])] {
            let path = dir.path().join("sheet.png");
            let mut sheet = Sheet::create(&path, count, 10, "the key").unwrap();
            (0..count).for_each(|i| sheet.add(None, format!("seed={i}")).unwrap());
            sheet.finish().unwrap();
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(bytes[16..24], *size.map(u32::to_be_bytes).as_flattened(), "{count}");
            assert!(is_there(&path, "the key") && !is_there(&path, "another key"));
        }
    }
}
