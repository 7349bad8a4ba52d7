//! Files in memory, where there is no disk.
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Cursor, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The committed files of this process that were not taken yet.
static FILES: Mutex<BTreeMap<PathBuf, Vec<u8>>> = Mutex::new(BTreeMap::new());

fn files() -> MutexGuard<'static, BTreeMap<PathBuf, Vec<u8>>> {
    FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps a committed file; replaces one of the same name.
pub(super) fn put(path: &Path, bytes: Vec<u8>) {
    files().insert(path.to_owned(), bytes);
}

pub(super) fn remove(path: &Path) -> io::Result<()> {
    files().remove(path).map(drop).ok_or_else(|| ErrorKind::NotFound.into())
}

/// Takes all files that were committed to memory, in the order of their paths. On a machine with a disk there are none.
pub fn taken_files() -> Vec<(PathBuf, Vec<u8>)> {
    std::mem::take(&mut *files()).into_iter().collect()
}

/// The content of a file under construction.
#[derive(Debug)]
pub(super) enum Content {
    Disk(File),
    Memory(Cursor<Vec<u8>>),
}

impl Default for Content {
    fn default() -> Self {
        Self::Memory(Cursor::default())
    }
}

impl Content {
    pub(super) fn into_bytes(self) -> Vec<u8> {
        match self {
            Self::Disk(_) => Vec::new(),
            Self::Memory(bytes) => bytes.into_inner(),
        }
    }
}

impl Write for Content {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Disk(file) => file.write(bytes),
            Self::Memory(memory) => memory.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Disk(file) => file.flush(),
            Self::Memory(_) => Ok(()),
        }
    }
}

impl Read for Content {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Disk(file) => file.read(bytes),
            Self::Memory(memory) => memory.read(bytes),
        }
    }
}

impl Seek for Content {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        match self {
            Self::Disk(file) => file.seek(position),
            Self::Memory(memory) => memory.seek(position),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::AtomicFile;
    use super::*;

    #[test]
    fn keeps_committed_files_until_they_are_taken() {
        let file = |text: &[u8]| {
            let mut file = AtomicFile::in_memory("b/a.png");
            file.write_all(text).unwrap();
            file
        };
        file(b"old").commit().unwrap();
        file(b"new").commit().unwrap();
        drop(file(b"dropped"));
        let mut read = file(b"seen");
        read.rewind().unwrap();
        let mut text = String::new();
        read.read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), read.into_bytes()), ("seen", b"seen".to_vec()));
        assert_eq!(taken_files(), [(PathBuf::from("b/a.png"), b"new".to_vec())]);
        assert_eq!(remove(Path::new("b/a.png")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}
