//! A store in a temporary file, for the overlap of the strips of one picture.
//!
//! The file vanishes with its owner. No other process reads it, so its entries need no seal.
use super::{Shelf, Store, lock};
use crate::picture::AtomicFile;
use crate::value::Key;
use std::collections::HashMap;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

/// Results in a temporary file.
pub struct OverlapStore(Mutex<Log>);

#[derive(Default)]
struct Log {
    /// `None` after a failure.
    file: Option<AtomicFile>,
    /// The start of each content in the file, and its length.
    entries: HashMap<(Shelf, Key), (u64, usize)>,
    end: u64,
}

impl OverlapStore {
    /// Creates an empty store in a file beside `picture`.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn create(picture: &Path) -> io::Result<Self> {
        let file = Some(AtomicFile::create(picture)?);
        Ok(Self(Mutex::new(Log { file, ..Log::default() })))
    }
}

impl Log {
    fn read(&mut self, start: u64, length: usize) -> io::Result<Vec<u8>> {
        let file = self.file.as_mut().ok_or(io::ErrorKind::NotFound)?;
        let mut content = vec![0; length];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut content)?;
        Ok(content)
    }

    fn write(&mut self, content: &[u8]) -> io::Result<(u64, usize)> {
        let file = self.file.as_mut().ok_or(io::ErrorKind::NotFound)?;
        let start = file.seek(SeekFrom::Start(self.end))?;
        file.write_all(content)?;
        self.end += content.len() as u64;
        Ok((start, content.len()))
    }
}

impl Store for OverlapStore {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        let mut log = lock(&self.0);
        let (start, length) = *log.entries.get(&(shelf, key))?;
        log.read(start, length).ok()
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], _spared: Duration, _stopped: &dyn Fn() -> bool) {
        let mut log = lock(&self.0);
        match log.write(content) {
            Ok(place) => drop(log.entries.insert((shelf, key), place)),
            // The disk is full. Drop the file, to leave its space to the pictures.
            Err(_) => *log = Log::default(),
        }
    }

    fn remove(&self, shelf: Shelf, key: Key) {
        lock(&self.0).entries.remove(&(shelf, key));
    }

    fn room(&self) -> u64 {
        u64::MAX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returns_entries_and_removes_its_file() {
        let dir = tempfile::tempdir().unwrap();
        let store = OverlapStore::create(&dir.path().join("a.exr")).unwrap();
        let key = |n: u8| Key::of("test", &[&[n]]);
        let put = |n: u8| store.put(Shelf::Tiles, key(n), &vec![n; 100 + usize::from(n)], Duration::ZERO, &|| false);
        let get = |n: u8| store.get(Shelf::Tiles, key(n));
        (1..4).for_each(put);
        assert_eq!((get(2), get(4)), (Some(vec![2; 102]), None));
        put(4);
        assert_eq!((get(4), get(1)), (Some(vec![4; 104]), Some(vec![1; 101])));
        assert_eq!(store.get(Shelf::Objects, key(4)), None);
        store.remove(Shelf::Tiles, key(1));
        assert_eq!((get(1), get(2)), (None, Some(vec![2; 102])));
        assert_eq!(dir.path().read_dir().unwrap().count(), 1);
        drop(store);
        assert_eq!(dir.path().read_dir().unwrap().count(), 0);
    }
}
