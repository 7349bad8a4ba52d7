//! Heights and triangles on their way to a body: the first bytes are kept in memory, the rest in a temporary file.
use crate::AtomicFile;
use shibo_kernel::body::{Rows, Store};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes of a spool that are kept in memory.
const HELD: usize = 64 << 20;

/// Bytes that may be more than the memory holds. The temporary file lies beside `path` and is removed on drop.
#[derive(Debug)]
pub(super) struct Spool {
    path: PathBuf,
    held: usize,
    memory: Vec<u8>,
    /// The bytes after those in memory.
    file: Option<Mutex<AtomicFile>>,
    /// Bytes in the file.
    length: u64,
}

impl Spool {
    /// An empty spool for the output at `path`.
    pub(super) fn new(path: &Path) -> Self {
        Self::holding(path, HELD)
    }

    fn holding(path: &Path, held: usize) -> Self {
        Self { path: path.to_owned(), held, memory: Vec::new(), file: None, length: 0 }
    }

    /// Adds heights.
    ///
    /// # Errors
    /// The disk is full, or the folder cannot be written.
    pub(super) fn add_heights(&mut self, heights: &[f32]) -> io::Result<()> {
        self.add(bytemuck::cast_slice(heights)).map(drop)
    }

    /// Number of heights.
    pub(super) fn heights(&self) -> usize {
        let bytes = self.memory.len() as u64 + self.length;
        usize::try_from(bytes / size_of::<f32>() as u64).unwrap_or(usize::MAX)
    }

    /// Splits a span of `count` bytes into the part in memory and the part in the file: the end of the first one, and
    /// the place of the second one.
    fn split(&self, at: u64, count: usize) -> (usize, u64) {
        let before = (self.memory.len() as u64).saturating_sub(at);
        let in_memory = usize::try_from(before).map_or(count, |before| before.min(count));
        (in_memory, at.saturating_sub(self.memory.len() as u64))
    }

    /// Does something with the file at a place.
    fn with<T>(&self, at: u64, work: impl FnOnce(&mut AtomicFile) -> io::Result<T>) -> io::Result<T> {
        let file = self.file.as_ref().ok_or(io::ErrorKind::UnexpectedEof)?;
        let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(at))?;
        work(&mut file)
    }
}

impl Store for Spool {
    fn add(&mut self, bytes: &[u8]) -> io::Result<u64> {
        let at = self.memory.len() as u64 + self.length;
        if self.file.is_none() {
            if self.memory.len() + bytes.len() <= self.held {
                self.memory.extend_from_slice(bytes);
                return Ok(at);
            }
            self.file = Some(Mutex::new(AtomicFile::create(&self.path)?));
        }
        self.with(self.length, |file| file.write_all(bytes))?;
        self.length += bytes.len() as u64;
        Ok(at)
    }

    fn replace(&mut self, at: u64, bytes: &[u8]) -> io::Result<()> {
        let (middle, rest) = self.split(at, bytes.len());
        let (first, second) = bytes.split_at(middle);
        if let (false, Ok(from)) = (first.is_empty(), usize::try_from(at)) {
            self.memory[from..from + middle].copy_from_slice(first);
        }
        if second.is_empty() {
            return Ok(());
        }
        if rest + second.len() as u64 > self.length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.with(rest, |file| file.write_all(second))
    }

    fn read(&self, at: u64, to: &mut [u8]) -> io::Result<()> {
        let (middle, rest) = self.split(at, to.len());
        let (first, second) = to.split_at_mut(middle);
        if let (false, Ok(from)) = (first.is_empty(), usize::try_from(at)) {
            first.copy_from_slice(&self.memory[from..from + middle]);
        }
        if second.is_empty() { Ok(()) } else { self.with(rest, |file| file.read_exact(second)) }
    }
}

impl Rows for Spool {
    fn read(&self, from: usize, to: &mut [f32]) -> io::Result<()> {
        let at = (from * size_of::<f32>()) as u64;
        Store::read(self, at, bytemuck::cast_slice_mut(to))
    }
}

/// Heights turned to the left by 90°: the last column is the first row.
#[derive(Debug)]
pub(super) struct Turned<'a> {
    pub(super) of: &'a dyn Rows,
    /// Width and height before the turn.
    pub(super) size: [usize; 2],
}

impl Rows for Turned<'_> {
    /// Whole rows only.
    fn read(&self, from: usize, to: &mut [f32]) -> io::Result<()> {
        let [width, height] = self.size;
        let (first, rows) = (from / height, to.len() / height);
        let end = width.checked_sub(first + rows).ok_or(io::ErrorKind::UnexpectedEof)?;
        let mut piece = vec![0.0_f32; rows];
        for x in 0..height {
            self.of.read(x * width + end, &mut piece)?;
            for (y, value) in piece.iter().rev().enumerate() {
                to[y * height + x] = *value;
            }
        }
        Ok(())
    }
}

/// The heights of a mould: opposite, and mirrored left to right.
#[derive(Debug)]
pub(super) struct Opposite<'a> {
    pub(super) of: &'a dyn Rows,
    pub(super) width: usize,
}

impl Rows for Opposite<'_> {
    /// Whole rows only.
    fn read(&self, from: usize, to: &mut [f32]) -> io::Result<()> {
        self.of.read(from, to)?;
        for row in to.chunks_mut(self.width) {
            row.reverse();
            row.iter_mut().for_each(|height| *height = -*height);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_beyond_the_memory_lie_in_a_file_that_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let files = || std::fs::read_dir(folder.path()).unwrap().count();
        let mut spool = Spool::holding(&folder.path().join("a.stl"), 10);
        assert_eq!(spool.add(&[1, 2, 3, 4, 5, 6]).unwrap(), 0);
        assert_eq!(files(), 0);
        assert_eq!(spool.add(&[7, 8, 9, 10, 11, 12]).unwrap(), 6);
        assert_eq!(spool.add(&[13]).unwrap(), 12);
        assert_eq!(files(), 1);
        let mut to = [0; 9];
        Store::read(&spool, 3, &mut to).unwrap();
        assert_eq!(to, [4, 5, 6, 7, 8, 9, 10, 11, 12]);
        spool.replace(5, &[60, 70, 80]).unwrap();
        Store::read(&spool, 4, &mut to).unwrap();
        assert_eq!(to, [5, 60, 70, 80, 9, 10, 11, 12, 13]);
        assert!(Store::read(&spool, 5, &mut to).is_err() && spool.replace(12, &[1, 2]).is_err());
        drop(spool);
        assert_eq!(files(), 0);
    }

    #[test]
    fn heights_are_turned_and_mirrored() {
        let values = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let turned = Turned { of: &values, size: [3, 2] };
        let mut to = [0.0; 6];
        turned.read(0, &mut to).unwrap();
        assert_eq!(to, [3.0, 6.0, 2.0, 5.0, 1.0, 4.0]);
        Opposite { of: &turned, width: 2 }.read(2, &mut to[..4]).unwrap();
        assert_eq!(to[..4], [-5.0, -2.0, -4.0, -1.0]);
        assert!(turned.read(4, &mut to).is_err());
    }
}
