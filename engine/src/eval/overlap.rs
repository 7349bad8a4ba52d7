//! A store in one file for the overlap of a part of a picture: the pixels that its neighbours read too.
//!
//! Filters read beyond the edges of a part, so two parts may need the same pixels. The part that is computed first
//! hands them over to the other. The pictures stay the same, since a value depends only on its position. So parts may
//! be computed in any order, and concurrently.
//!
//! ```text
//! MAGIC
//! for each entry: its name, its seal, its content
//! ```
//!
//! The strips of one picture use files without names, which vanish with their owners. Parts in other processes find
//! [published](OverlapStore::publish) files. Like every store, such a file is never trusted: an entry that is
//! truncated, altered, or of another build does not match its [`Seal`] and counts as missing.
use super::entry::Digester;
use super::{Seal, Shelf, Store, lock};
use crate::picture::{AtomicFile, OVERLAP_MAGIC};
use crate::value::Key;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

/// Number of bytes before a content: the name and the seal.
const HEAD: usize = 16 + Seal::BYTES;

/// A file of tiles clipped to the overlap of a part.
pub struct OverlapStore {
    seal: Seal,
    room: u64,
    log: Mutex<Log>,
}

struct Log {
    /// `None` after the file was published, or a write failed.
    file: Option<Medium>,
    /// Start and end of each entry in the file, by the entry's name.
    entries: HashMap<Key, (u64, u64)>,
    end: u64,
}

enum Medium {
    /// A file of this process.
    Own(AtomicFile),
    /// A file that another process has published.
    Published(File),
}

impl OverlapStore {
    /// Creates an empty store of at most `room` bytes, in an unnamed file that can be published as `name`.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn create(name: &Path, seal: Seal, room: u64) -> io::Result<Self> {
        let mut file = AtomicFile::create(name)?;
        file.write_all(&OVERLAP_MAGIC)?;
        Ok(Self::new(seal, room, Medium::Own(file), HashMap::new(), OVERLAP_MAGIC.len() as u64))
    }

    /// Opens the published file `name`; `None` if there is no such file, or it is not an overlap file.
    pub fn open(name: &Path, seal: Seal) -> Option<Self> {
        let mut file = File::open(name).ok()?;
        let length = file.metadata().ok()?.len();
        let (mut magic, mut head) = ([0; OVERLAP_MAGIC.len()], [0; HEAD]);
        file.read_exact(&mut magic).ok().filter(|()| magic == OVERLAP_MAGIC)?;
        let (mut entries, mut end) = (HashMap::new(), magic.len() as u64);
        while file.seek(SeekFrom::Start(end)).is_ok() && file.read_exact(&mut head).is_ok() {
            let (name, seal) = head.split_first_chunk()?;
            let content = Seal::length(seal.first_chunk()?);
            let next =
                content.and_then(|content| content.checked_add(end + HEAD as u64)).filter(|next| *next <= length);
            let Some(next) = next else { break };
            entries.insert(Key::from_bytes(*name), (end, next));
            end = next;
        }
        Some(Self::new(seal, 0, Medium::Published(file), entries, end))
    }

    fn new(seal: Seal, room: u64, file: Medium, entries: HashMap<Key, (u64, u64)>, end: u64) -> Self {
        Self { seal, room, log: Mutex::new(Log { file: Some(file), entries, end }) }
    }

    /// True if there is an entry for this key. Its content is not checked.
    pub(super) fn has(&self, key: Key) -> bool {
        let log = lock(&self.log);
        log.file.is_some() && log.entries.contains_key(&self.seal.name(key))
    }

    /// Gives the file its name, so that other processes find it. The store is empty afterwards.
    ///
    /// # Errors
    /// The file cannot be written, for example because the disk is full.
    pub fn publish(&self) -> io::Result<()> {
        match lock(&self.log).file.take() {
            Some(Medium::Own(file)) => file.commit(),
            _ => Ok(()),
        }
    }

    /// The bytes before a content: name and seal.
    fn head(&self, shelf: Shelf, key: Key, content: &[u8]) -> [u8; HEAD] {
        let mut digester = Digester::default();
        digester.update(content);
        let mut head = [0; HEAD];
        head[..16].copy_from_slice(self.seal.name(key).as_bytes());
        head[16..].copy_from_slice(&self.seal.of(shelf, key, &digester.finish()));
        head
    }
}

impl Log {
    fn read(&mut self, name: Key) -> io::Result<Option<Vec<u8>>> {
        let (Some(file), Some((begin, end))) = (&mut self.file, self.entries.get(&name)) else { return Ok(None) };
        let mut bytes = vec![0; usize::try_from(end - begin).unwrap_or(0)];
        match file {
            Medium::Own(file) => file.seek(SeekFrom::Start(*begin)).and_then(|_| file.read_exact(&mut bytes))?,
            Medium::Published(file) => file.seek(SeekFrom::Start(*begin)).and_then(|_| file.read_exact(&mut bytes))?,
        }
        Ok(Some(bytes))
    }

    fn write(&mut self, name: Key, head: &[u8], content: &[u8], room: u64) -> io::Result<()> {
        let next = self.end + (head.len() + content.len()) as u64;
        let Some(Medium::Own(file)) = self.file.as_mut().filter(|_| next <= room) else { return Ok(()) };
        file.seek(SeekFrom::Start(self.end))?;
        file.write_all(head)?;
        file.write_all(content)?;
        self.entries.insert(name, (self.end, next));
        self.end = next;
        Ok(())
    }
}

impl Store for OverlapStore {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        let mut bytes = lock(&self.log).read(self.seal.name(key)).ok()??;
        let content = bytes.split_off(HEAD.min(bytes.len()));
        (bytes == self.head(shelf, key, &content)).then_some(content)
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], _spared: Duration, _stopped: &dyn Fn() -> bool) {
        let head = self.head(shelf, key, content);
        let mut log = lock(&self.log);
        if log.write(self.seal.name(key), &head, content, self.room).is_err() {
            // The disk is full. Drop the file, to leave its space to the pictures.
            log.file = None;
        }
    }

    fn remove(&self, _shelf: Shelf, key: Key) {
        lock(&self.log).entries.remove(&self.seal.name(key));
    }

    fn room(&self) -> u64 {
        self.room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seal(build: &str) -> Seal {
        Seal::new(Key::of("build", &[build.as_bytes()]))
    }

    fn key(n: u8) -> Key {
        Key::of("test", &[&[n]])
    }

    fn put(store: &OverlapStore, n: u8) {
        store.put(Shelf::Tiles, key(n), &[n; 100], Duration::ZERO, &|| false);
    }

    fn get(store: &OverlapStore, n: u8) -> Option<Vec<u8>> {
        store.get(Shelf::Tiles, key(n))
    }

    #[test]
    fn returns_entries_and_removes_its_file() {
        let dir = tempfile::tempdir().unwrap();
        let store = OverlapStore::create(&dir.path().join("a.exr"), seal("a"), u64::MAX).unwrap();
        (1..4).for_each(|n| put(&store, n));
        assert_eq!((get(&store, 2), get(&store, 4)), (Some(vec![2; 100]), None));
        put(&store, 4);
        assert_eq!(get(&store, 4), Some(vec![4; 100]));
        assert_eq!(store.get(Shelf::Objects, key(4)), None);
        drop(store);
        assert_eq!(dir.path().read_dir().unwrap().count(), 0);
    }

    #[test]
    fn publishes_to_the_same_build() {
        let dir = tempfile::tempdir().unwrap();
        let name = dir.path().join("a.overlap");
        // Space for two entries.
        let store = OverlapStore::create(&name, seal("a"), 8 + 3 * (HEAD as u64 + 100) - 1).unwrap();
        (1..4).for_each(|n| put(&store, n));
        assert!(!name.exists());
        store.publish().unwrap();
        assert_eq!(get(&store, 1), None);
        let found = OverlapStore::open(&name, seal("a")).unwrap();
        assert_eq!((get(&found, 2), get(&found, 3)), (Some(vec![2; 100]), None));
        put(&found, 3);
        assert!(!found.has(key(3)));
        assert!(!OverlapStore::open(&name, seal("b")).unwrap().has(key(2)));
        assert!(OverlapStore::open(&dir.path().join("none"), seal("a")).is_none());
        assert_eq!(dir.path().read_dir().unwrap().count(), 1);
    }

    /// A flipped byte or a truncation at any position never changes the content of an entry that is returned.
    #[test]
    fn returns_no_wrong_content_from_damaged_file() {
        let dir = tempfile::tempdir().unwrap();
        let name = dir.path().join("a.overlap");
        let store = OverlapStore::create(&name, seal("a"), 1 << 20).unwrap();
        (1..4).for_each(|n| put(&store, n));
        store.publish().unwrap();
        let whole = std::fs::read(&name).unwrap();
        let look = |bytes: &[u8]| {
            std::fs::write(&name, bytes).unwrap();
            let Some(found) = OverlapStore::open(&name, seal("a")) else { return 0 };
            let taken = |n: &u8| get(&found, *n).inspect(|content| assert_eq!(*content, [*n; 100])).is_some();
            (1..4).filter(taken).count()
        };
        assert_eq!(look(&whole), 3);
        for i in 0..whole.len() {
            let mut altered = whole.clone();
            altered[i] ^= 0x41;
            assert!(look(&altered) < 3, "{i}");
            assert!(look(&whole[..i]) < 3, "{i}");
        }
    }
}
