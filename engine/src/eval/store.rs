//! Storage of results beyond the process that computed them. A trait, so that a folder, another machine or a chain of
//! several look the same to the engine.
//!
//! The values of one process are shared through the [`MemoryCache`](super::MemoryCache), which holds them unserialized.
//! A [`Store`] holds bytes, which outlive a process and can be sent elsewhere. A store is never trusted: a returned
//! result must be sealed for this shelf and this key (see [`Seal`](super::Seal)), or it counts as missing.
use super::Shelf;
use crate::picture::AtomicFile;
use crate::value::Key;
use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Results by shelf and key.
///
/// No method fails a run: a full, slow or unreachable store only costs time. After a miss the caller computes the
/// result and puts it, so a shared store may note that the result is being computed.
pub trait Store: Send + Sync {
    /// The content under `key`, if present and intact.
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>>;

    /// Stores `content` under `key`; recomputing it would take `spared` of CPU time. Nothing is stored if `stopped`
    /// becomes true meanwhile, since writing a large result takes many milliseconds.
    fn put(&self, shelf: Shelf, key: Key, content: &[u8], spared: Duration, stopped: &dyn Fn() -> bool);

    /// Removes the content under `key`, which was intact but not of the expected form.
    fn remove(&self, shelf: Shelf, key: Key);

    /// Writes the content under `key` to the file `to`, which appears when complete. Returns `false` if the content is
    /// missing or damaged; `to` is then unchanged.
    ///
    /// # Errors
    /// `to` cannot be written.
    fn get_file(&self, key: Key, to: &Path) -> io::Result<bool> {
        let Some(content) = self.get(Shelf::Files, key) else { return Ok(false) };
        let mut file = AtomicFile::create(to)?;
        file.write_all(&content)?;
        file.commit().map(|()| true)
    }

    /// Stores the content of the file `from` under `key`.
    fn put_file(&self, key: Key, from: &Path, spared: Duration) {
        if let Ok(content) = std::fs::read(from) {
            self.put(Shelf::Files, key, &content, spared, &|| false);
        }
    }

    /// The most bytes that the store holds.
    fn room(&self) -> u64;

    /// Removes entries beyond the bound. Called from time to time, when nothing waits for it.
    fn tidy(&self) {}
}

impl<S: Store + ?Sized> Store for Arc<S> {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        (**self).get(shelf, key)
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], spared: Duration, stopped: &dyn Fn() -> bool) {
        (**self).put(shelf, key, content, spared, stopped);
    }

    fn remove(&self, shelf: Shelf, key: Key) {
        (**self).remove(shelf, key);
    }

    fn get_file(&self, key: Key, to: &Path) -> io::Result<bool> {
        (**self).get_file(key, to)
    }

    fn put_file(&self, key: Key, from: &Path, spared: Duration) {
        (**self).put_file(key, from, spared);
    }

    fn room(&self) -> u64 {
        (**self).room()
    }

    fn tidy(&self) {
        (**self).tidy();
    }
}

/// Several stores, the nearest first. An entry found only in a far store is copied to the nearer ones.
pub struct Layers(Vec<Box<dyn Store>>);

impl Layers {
    /// These stores, the nearest first.
    pub fn new(stores: Vec<Box<dyn Store>>) -> Self {
        Self(stores)
    }
}

impl Store for Layers {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        let (at, content) = self.0.iter().enumerate().find_map(|(i, store)| Some((i, store.get(shelf, key)?)))?;
        for nearer in &self.0[..at] {
            nearer.put(shelf, key, &content, Duration::ZERO, &|| false);
        }
        Some(content)
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], spared: Duration, stopped: &dyn Fn() -> bool) {
        self.0.iter().for_each(|store| store.put(shelf, key, content, spared, stopped));
    }

    fn remove(&self, shelf: Shelf, key: Key) {
        self.0.iter().for_each(|store| store.remove(shelf, key));
    }

    fn get_file(&self, key: Key, to: &Path) -> io::Result<bool> {
        for (i, store) in self.0.iter().enumerate() {
            if store.get_file(key, to)? {
                self.0[..i].iter().for_each(|nearer| nearer.put_file(key, to, Duration::ZERO));
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn put_file(&self, key: Key, from: &Path, spared: Duration) {
        self.0.iter().for_each(|store| store.put_file(key, from, spared));
    }

    fn room(&self) -> u64 {
        self.0.iter().map(|store| store.room()).max().unwrap_or(0)
    }

    fn tidy(&self) {
        self.0.iter().for_each(|store| store.tidy());
    }
}

/// A store in memory that lasts as long as the process, for use without a folder. Refuses content that does not fit.
pub struct MemoryStore {
    room: u64,
    held: Mutex<Held>,
}

#[derive(Default)]
struct Held {
    entries: HashMap<(Shelf, Key), Vec<u8>>,
    bytes: u64,
}

impl Held {
    fn remove(&mut self, at: (Shelf, Key)) {
        self.bytes -= self.entries.remove(&at).map_or(0, |content| content.len() as u64);
    }
}

impl MemoryStore {
    /// A store of at most `room` bytes.
    pub fn new(room: u64) -> Self {
        Self { room, held: Mutex::default() }
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for MemoryStore {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        self.held().entries.get(&(shelf, key)).cloned()
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], _spared: Duration, stopped: &dyn Fn() -> bool) {
        let mut held = self.held();
        held.remove((shelf, key));
        let bytes = held.bytes + content.len() as u64;
        if bytes <= self.room && !stopped() {
            held.bytes = bytes;
            held.entries.insert((shelf, key), content.to_vec());
        }
    }

    fn remove(&self, shelf: Shelf, key: Key) {
        self.held().remove((shelf, key));
    }

    fn room(&self) -> u64 {
        self.room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GO_ON: &dyn Fn() -> bool = &|| false;

    fn key(word: &str) -> Key {
        Key::of("test", &[word.as_bytes()])
    }

    fn put(store: &dyn Store, shelf: Shelf, word: &str, content: &[u8]) {
        store.put(shelf, key(word), content, Duration::ZERO, GO_ON);
    }

    #[test]
    fn refuses_content_beyond_room_and_counts_removals() {
        let store = MemoryStore::new(10);
        put(&store, Shelf::Objects, "a", b"12345678");
        put(&store, Shelf::Tiles, "a", b"123");
        assert_eq!(store.get(Shelf::Objects, key("a")).unwrap(), b"12345678");
        assert_eq!(store.get(Shelf::Tiles, key("a")), None);
        put(&store, Shelf::Objects, "a", b"12");
        put(&store, Shelf::Tiles, "a", b"12345678");
        assert_eq!(store.get(Shelf::Tiles, key("a")).unwrap(), b"12345678");
        store.remove(Shelf::Tiles, key("a"));
        put(&store, Shelf::Tiles, "b", b"1234567");
        assert_eq!(store.get(Shelf::Tiles, key("b")).unwrap(), b"1234567");
        store.put(Shelf::Objects, key("c"), b"1", Duration::ZERO, &|| true);
        assert_eq!(store.get(Shelf::Objects, key("c")), None);
    }

    #[test]
    fn copies_entries_from_far_to_near_stores() {
        let dir = tempfile::tempdir().unwrap();
        let (from, to) = (dir.path().join("from"), dir.path().join("to"));
        let [near, far] = [1 << 20, 2 << 20].map(|room| Arc::new(MemoryStore::new(room)));
        let layers = Layers::new(vec![Box::new(near.clone()), Box::new(far.clone())]);
        put(&*far, Shelf::Tiles, "a", b"tile");
        assert_eq!(layers.get(Shelf::Tiles, key("a")).unwrap(), b"tile");
        assert_eq!(near.get(Shelf::Tiles, key("a")).unwrap(), b"tile");
        std::fs::write(&from, b"picture").unwrap();
        far.put_file(key("f"), &from, Duration::ZERO);
        assert!(layers.get_file(key("f"), &to).unwrap());
        assert_eq!(std::fs::read(&to).unwrap(), b"picture");
        assert_eq!(near.get(Shelf::Files, key("f")).unwrap(), b"picture");
        assert!(!layers.get_file(key("none"), &to).unwrap());
        put(&layers, Shelf::Objects, "o", b"object");
        assert!(near.get(Shelf::Objects, key("o")).is_some() && far.get(Shelf::Objects, key("o")).is_some());
        layers.remove(Shelf::Objects, key("o"));
        assert_eq!(layers.get(Shelf::Objects, key("o")), None);
        assert_eq!(layers.room(), 2 << 20);
    }
}
