//! Destinations for the blocks of pictures.
use super::Failure;
use super::fitted::Fitted;
use crate::diagnostics::Problem;
use crate::export::{FilesWriter, Told};
use crate::picture::{AtomicFile, PartWriter, WriteError, WriteStats, Writer};
use crate::value::{Grid, Tile, Window};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// A file, or several, made of the samples of a job.
pub(super) enum Sink {
    Picture(Box<Writer>),
    Export(Box<FilesWriter>),
    /// A picture whose range is that of its values.
    Fitted(Box<Fitted>),
    /// A part, and the index of the picture in it.
    Part(Arc<Mutex<PartWriter>>, usize),
}

fn failed(error: &WriteError) -> Failure {
    Failure::File(error.to_string())
}

impl Sink {
    /// Writes the next whole rows. A part takes any block, at its place.
    fn write(&mut self, planes: &[&[f32]], block: Window) -> Result<(), Failure> {
        let done = match self {
            Self::Picture(writer) => writer.write_rows(planes, block.height),
            Self::Export(writer) => writer.write_rows(planes, block.height),
            Self::Fitted(fitted) => {
                fitted.add(planes);
                Ok(())
            }
            Self::Part(writer, number) => {
                let place = [block.x.cast_unsigned(), block.y.cast_unsigned(), block.width, block.height];
                writer.lock().unwrap_or_else(PoisonError::into_inner).write_block(*number, planes, place)
            }
        };
        done.map_err(|error| failed(&error))
    }

    /// Makes files that need all rows, without their names; `findings` are the warnings about the values.
    pub(super) fn complete(
        &mut self,
        findings: Vec<Problem>,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), WriteError> {
        match self {
            Self::Export(writer) => writer.complete(findings, stop),
            Self::Fitted(fitted) => fitted.complete(),
            Self::Picture(_) | Self::Part(..) => Ok(()),
        }
    }

    /// Texts for the user about files that [`complete`](Self::complete) made.
    pub(super) fn told(&self) -> Told {
        if let Self::Export(writer) = self { writer.told() } else { Told::default() }
    }

    /// Closes the file under its final name; returns statistics of the pictures written.
    pub(super) fn finish(self) -> Result<Vec<WriteStats>, Failure> {
        let done = match self {
            Self::Picture(writer) => writer.finish().map(|written| vec![written]),
            Self::Export(writer) => writer.finish(),
            Self::Fitted(fitted) => fitted.finish(),
            Self::Part(..) => Ok(Vec::new()),
        };
        done.map_err(|error| failed(&error))
    }
}

/// Assembles whole rows from the blocks of a picture, which arrive strip by strip, and writes them.
pub(super) struct Assembler<'w> {
    sink: &'w mut Sink,
    picture: &'w Path,
    grid: Grid,
    window: Window,
    channels: usize,
    /// A temporary file beside the picture with the blocks that wait for others.
    waiting: Option<AtomicFile>,
    /// The waiting blocks, in order of arrival.
    blocks: Vec<Window>,
}

impl<'w> Assembler<'w> {
    /// An assembler for `window` of a picture with `channels` samples per pixel.
    pub(super) const fn new(
        sink: &'w mut Sink,
        picture: &'w Path,
        (grid, window): (Grid, Window),
        channels: usize,
    ) -> Self {
        Self { sink, picture, grid, window, channels, waiting: None, blocks: Vec::new() }
    }

    /// Writes a block, or buffers it until the blocks beside it have arrived.
    pub(super) fn write_block(&mut self, tiles: &[Tile], block: Window) -> Result<(), Failure> {
        if block.width == self.window.width || matches!(self.sink, Sink::Part(..)) {
            return self.sink.write(&planes(tiles), block);
        }
        self.blocks.push(block);
        self.keep(tiles).map_err(|error| lost(self.picture, &error))
    }

    fn keep(&mut self, tiles: &[Tile]) -> io::Result<()> {
        let file = match &mut self.waiting {
            Some(file) => file,
            None => self.waiting.insert(AtomicFile::create(self.picture)?),
        };
        tiles.iter().try_for_each(|tile| file.write_all(bytemuck::cast_slice(tile.data())))
    }

    /// Writes the rows of all waiting blocks.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        let Some(mut file) = self.waiting.take() else { return Ok(()) };
        let first = self.blocks.iter().filter(|block| block.x == self.window.x);
        for band in first.map(|block| Window { width: self.window.width, ..*block }) {
            let mut rows = Tile::new(self.grid, band, self.channels);
            let mut at = 0;
            for block in &self.blocks {
                if block.y == band.y {
                    let mut part = Tile::new(self.grid, *block, self.channels);
                    let bytes = bytemuck::cast_slice_mut::<f32, u8>(part.data_mut());
                    let read = file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(bytes));
                    read.map_err(|error| lost(self.picture, &error))?;
                    rows.copy_from(&part, 0, 0);
                }
                at += (block.len() * self.channels * size_of::<f32>()) as u64;
            }
            self.sink.write(&planes(&[rows]), band)?;
        }
        Ok(())
    }
}

/// The planes of all channels.
fn planes(tiles: &[Tile]) -> Vec<&[f32]> {
    tiles.iter().flat_map(|tile| (0..tile.channels()).map(|channel| tile.plane(channel))).collect()
}

fn lost(picture: &Path, error: &io::Error) -> Failure {
    Failure::File(format!("cannot keep the strips of `{}` in a temporary file beside it: {error}", picture.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{Compression, Depth, Encoding, Format, PictureSpec};

    const GRID: Grid = Grid { origin: glam::DVec2::ZERO, step: glam::DVec2::ONE, period: None, shown: None };
    const WHOLE: Window = Window { x: 0, y: 0, width: 3, height: 2 };

    fn sink(path: &Path) -> Sink {
        let spec = PictureSpec {
            width: WHOLE.width,
            height: WHOLE.height,
            channels: vec!["Y".into()],
            format: Format::Exr,
            depth: Depth::F32,
            encoding: Encoding::default(),
            compression: Compression::Fast,
            mips: Vec::new(),
            chromaticities: None,
            pixel_mm: None,
            metadata: Vec::new(),
        };
        Sink::Picture(Box::new(Writer::create(path, &spec).unwrap()))
    }

    /// A tile whose pixels have the value x + 10 y.
    fn tile(window: Window) -> Tile {
        let mut tile = Tile::new(GRID, window, 1);
        let places =
            (window.y..window.bottom()).flat_map(|y| (window.x..window.right()).map(move |x| (x + 10 * y) as f32));
        tile.data_mut().iter_mut().zip(places).for_each(|(value, place)| *value = place);
        tile
    }

    fn columns(x: i32, width: u32) -> [Window; 2] {
        [0, 1].map(|y| Window { x, y, width, height: 1 })
    }

    fn write(path: &Path, blocks: &[Window]) -> Result<(), Failure> {
        let mut sink = sink(path);
        let mut assembler = Assembler::new(&mut sink, path, (GRID, WHOLE), 1);
        blocks.iter().try_for_each(|block| assembler.write_block(&[tile(*block)], *block))?;
        assembler.finish()?;
        sink.finish().map(drop)
    }

    #[test]
    fn writes_the_same_rows_from_blocks() {
        let dir = tempfile::tempdir().unwrap();
        let paths = ["rows", "strips"].map(|name| dir.path().join(name));
        write(&paths[0], &[Window { height: 1, ..WHOLE }, Window { y: 1, height: 1, ..WHOLE }]).unwrap();
        write(&paths[1], &[columns(0, 2), columns(2, 1)].concat()).unwrap();
        let [rows, strips] = [0, 1].map(|n| std::fs::read(&paths[n]).unwrap());
        assert!(rows == strips);
        assert_eq!(dir.path().read_dir().unwrap().count(), 2);
    }

    #[test]
    fn names_a_folder_that_cannot_be_written() {
        let dir = tempfile::tempdir().unwrap();
        let mut sink = sink(&dir.path().join("a.exr"));
        std::fs::write(dir.path().join("file"), "").unwrap();
        for picture in ["gone/a.png", "file/a.png"] {
            let path = dir.path().join(picture);
            let mut assembler = Assembler::new(&mut sink, &path, (GRID, WHOLE), 1);
            let block = columns(0, 2)[0];
            let Err(Failure::File(refused)) = assembler.write_block(&[tile(block)], block) else { panic!("it worked") };
            assert!(refused.contains(picture) && refused.contains("temporary file"), "{refused}");
        }
    }
}
