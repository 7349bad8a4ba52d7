//! The cache on disk: shared by processes, bounded, and never trusted.
//!
//! An entry is a file `DIR/SHELF/xx/KEY`: its content, then a footer of a magic word, the content's length and its
//! checksum. Entries are written under a temporary name and renamed; one that does not match its footer is removed and
//! made again. When the cache outgrows its bound, the entries not used for longest go first.
use crate::picture::AtomicFile;
use crate::value::Key;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

/// Changes when the form of entries does, and tells byte orders apart.
const MAGIC: u64 = 0x5348_4942_4f00_0001;
const FOOTER: usize = 8 + 8 + 16;
/// So much is written at once where it may be stopped: about a millisecond's work.
const PART: usize = 1 << 20;

/// A cache folder that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("the cache folder `{dir}` cannot be used: {source}")]
pub struct CacheError {
    dir: String,
    source: io::Error,
}

/// How much a cache holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct DiskUse {
    /// Entries.
    pub entries: u64,
    /// Bytes.
    pub bytes: u64,
}

/// A folder of results by key.
#[derive(Debug)]
pub struct DiskCache {
    dir: PathBuf,
    bound: u64,
    written: AtomicU64,
    failures: AtomicU64,
}

impl DiskCache {
    /// The shelf of objects.
    pub const OBJECTS: &'static str = "objects";
    /// The shelf of tiles.
    pub const TILES: &'static str = "tiles";
    /// The shelf of encoded pictures.
    pub const FILES: &'static str = "files";
    const SHELVES: [&'static str; 3] = [Self::OBJECTS, Self::TILES, Self::FILES];

    /// The cache in `dir`, made if need be, kept below `bound` bytes.
    ///
    /// # Errors
    /// A folder that cannot be made or written.
    pub fn open(dir: impl Into<PathBuf>, bound: u64) -> Result<Self, CacheError> {
        let dir = dir.into();
        let probe = || {
            fs::create_dir_all(&dir)?;
            // Making a file is the only reliable answer to whether one can.
            AtomicFile::create(dir.join("probe")).map(drop)
        };
        match probe() {
            Ok(()) => Ok(Self { dir, bound, written: AtomicU64::new(0), failures: AtomicU64::new(0) }),
            Err(source) => Err(CacheError { dir: dir.display().to_string(), source }),
        }
    }

    /// The most bytes that it keeps.
    pub fn bound(&self) -> u64 {
        self.bound
    }

    /// How many entries could not be written.
    pub fn failures(&self) -> u64 {
        self.failures.load(Ordering::Relaxed)
    }

    fn path(&self, shelf: &str, key: Key) -> PathBuf {
        let name = key.to_string();
        self.dir.join(shelf).join(&name[..2]).join(&name[2..])
    }

    /// The content under `key`, if it is there and whole.
    pub fn get(&self, shelf: &str, key: Key) -> Option<Vec<u8>> {
        let path = self.path(shelf, key);
        let mut bytes = fs::read(&path).ok()?;
        let Some(length) = bytes.len().checked_sub(FOOTER).filter(|&n| bytes[n..] == footer(&bytes[..n])[..]) else {
            let _ = fs::remove_file(&path);
            return None;
        };
        bytes.truncate(length);
        touch(&path);
        Some(bytes)
    }

    /// Keeps `content` under `key`. A failure costs time later, nothing else, so it is only counted.
    pub fn put(&self, shelf: &str, key: Key, content: &[u8]) {
        self.put_unless(shelf, key, content, &|| false);
    }

    /// The same, but it is left if `stopped` becomes true: a large result takes many milliseconds to write.
    pub fn put_unless(&self, shelf: &str, key: Key, content: &[u8], stopped: &dyn Fn() -> bool) {
        let write = || -> io::Result<bool> {
            let mut file = self.create(shelf, key)?;
            let mut hasher = blake3::Hasher::new();
            for part in content.chunks(PART) {
                if stopped() {
                    return Ok(false);
                }
                hasher.update(part);
                file.write_all(part)?;
            }
            file.write_all(&footer_of(content.len() as u64, &hasher.finalize()))?;
            file.commit().map(|()| true)
        };
        match write() {
            Ok(false) => {}
            written => self.account(written.map(|_| ()), content.len() as u64),
        }
    }

    /// Keeps a copy of the file `from` under `key`.
    pub fn put_file(&self, key: Key, from: &Path) {
        let copy = || -> io::Result<u64> {
            let mut to = self.create(Self::FILES, key)?;
            let (length, checksum) = copy_hashed(&mut File::open(from)?, &mut to, u64::MAX)?;
            to.write_all(&footer_of(length, &checksum))?;
            to.commit()?;
            Ok(length)
        };
        match copy() {
            Ok(length) => self.account(Ok(()), length),
            Err(e) => self.account(Err(e), 0),
        }
    }

    /// Puts the file under `key` at `to`; `false` if it is not there, or not whole.
    ///
    /// # Errors
    /// `to` cannot be written.
    pub fn copy_file(&self, key: Key, to: &Path) -> io::Result<bool> {
        let path = self.path(Self::FILES, key);
        let Ok(mut from) = File::open(&path) else { return Ok(false) };
        let whole = from.metadata()?.len();
        let Some(length) = whole.checked_sub(FOOTER as u64) else { return Ok(false) };
        let mut target = AtomicFile::create(to)?;
        let (copied, checksum) = copy_hashed(&mut from, &mut target, length)?;
        let mut tail = Vec::new();
        from.read_to_end(&mut tail)?;
        if tail != footer_of(copied, &checksum) {
            let _ = fs::remove_file(&path);
            return Ok(false);
        }
        target.commit()?;
        touch(&path);
        Ok(true)
    }

    fn create(&self, shelf: &str, key: Key) -> io::Result<AtomicFile> {
        let path = self.path(shelf, key);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        AtomicFile::create(path)
    }

    fn account(&self, result: io::Result<()>, bytes: u64) {
        match result {
            Ok(()) => self.written.fetch_add(bytes, Ordering::Relaxed),
            Err(_) => self.failures.fetch_add(1, Ordering::Relaxed),
        };
    }

    fn entries(&self) -> Vec<(SystemTime, u64, PathBuf)> {
        let list = |dir: &Path| fs::read_dir(dir).into_iter().flatten().flatten();
        let mut entries = Vec::new();
        for shelf in Self::SHELVES {
            for fan in list(&self.dir.join(shelf)) {
                for entry in list(&fan.path()) {
                    let Ok(meta) = entry.metadata() else { continue };
                    let time = meta.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                    entries.push((time, meta.len(), entry.path()));
                }
            }
        }
        entries
    }

    /// How much it holds.
    pub fn usage(&self) -> DiskUse {
        let entries = self.entries();
        DiskUse { entries: entries.len() as u64, bytes: entries.iter().map(|e| e.1).sum() }
    }

    /// Removes what has not been used for longest until it is below its bound; does nothing if nothing was written.
    pub fn trim(&self) {
        if self.written.swap(0, Ordering::Relaxed) > 0 {
            self.trim_to(self.bound);
        }
    }

    fn trim_to(&self, bound: u64) {
        let mut entries = self.entries();
        let mut total: u64 = entries.iter().map(|e| e.1).sum();
        if total <= bound {
            return;
        }
        entries.sort();
        // Some more than needed, so that it is not done again after the next entry.
        for (_, bytes, path) in entries {
            if total <= bound / 10 * 9 {
                break;
            }
            if fs::remove_file(&path).is_ok() {
                total -= bytes;
            }
        }
    }

    /// Removes everything, and says how much that was.
    pub fn clear(&self) -> DiskUse {
        let usage = self.usage();
        self.trim_to(0);
        usage
    }
}

/// Marks an entry as just used.
fn touch(path: &Path) {
    let _ = File::open(path).and_then(|file| file.set_modified(SystemTime::now()));
}

fn footer(content: &[u8]) -> [u8; FOOTER] {
    footer_of(content.len() as u64, &blake3::hash(content))
}

fn footer_of(length: u64, checksum: &blake3::Hash) -> [u8; FOOTER] {
    let mut footer = [0; FOOTER];
    footer[..8].copy_from_slice(&MAGIC.to_ne_bytes());
    footer[8..16].copy_from_slice(&length.to_ne_bytes());
    footer[16..].copy_from_slice(&checksum.as_bytes()[..16]);
    footer
}

/// Copies at most `limit` bytes, and hashes them.
fn copy_hashed(from: &mut File, to: &mut impl Write, limit: u64) -> io::Result<(u64, blake3::Hash)> {
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; 1 << 18];
    let mut copied = 0;
    while copied < limit {
        let want = usize::try_from(limit - copied).map_or(buffer.len(), |n| n.min(buffer.len()));
        let n = from.read(&mut buffer[..want])?;
        if n == 0 {
            break;
        }
        hasher.update(&buffer[..n]);
        to.write_all(&buffer[..n])?;
        copied += n as u64;
    }
    Ok((copied, hasher.finalize()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(word: &str) -> Key {
        Key::of("test", &[word.as_bytes()])
    }

    #[test]
    fn gives_back_what_was_put() {
        let dir = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(dir.path(), 1 << 20).unwrap();
        cache.put(DiskCache::OBJECTS, key("a"), b"content");
        assert_eq!(cache.get(DiskCache::OBJECTS, key("a")).unwrap(), b"content");
        assert_eq!(cache.get(DiskCache::OBJECTS, key("b")), None);
        assert_eq!(cache.clear().entries, 1);
        assert_eq!(cache.usage().entries, 0);
    }

    #[test]
    fn damaged_entries_are_removed_not_served() {
        let dir = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(dir.path(), 1 << 20).unwrap();
        for damage in [0usize, 3, 20] {
            cache.put(DiskCache::OBJECTS, key("a"), b"content");
            let path = cache.path(DiskCache::OBJECTS, key("a"));
            let mut bytes = fs::read(&path).unwrap();
            bytes[damage] ^= 1;
            fs::write(&path, &bytes).unwrap();
            assert_eq!(cache.get(DiskCache::OBJECTS, key("a")), None, "byte {damage}");
            assert!(!path.exists());
        }
        cache.put(DiskCache::OBJECTS, key("a"), b"content");
        let path = cache.path(DiskCache::OBJECTS, key("a"));
        fs::write(&path, b"short").unwrap();
        assert_eq!(cache.get(DiskCache::OBJECTS, key("a")), None);
    }

    #[test]
    fn files_are_copied_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(dir.path().join("cache"), 1 << 20).unwrap();
        let (from, to) = (dir.path().join("from"), dir.path().join("to"));
        fs::write(&from, vec![7; 300_000]).unwrap();
        cache.put_file(key("f"), &from);
        assert!(cache.copy_file(key("f"), &to).unwrap());
        assert_eq!(fs::read(&to).unwrap(), vec![7; 300_000]);
        let path = cache.path(DiskCache::FILES, key("f"));
        let mut bytes = fs::read(&path).unwrap();
        bytes[1000] = 8;
        fs::write(&path, bytes).unwrap();
        fs::write(&to, b"old").unwrap();
        assert!(!cache.copy_file(key("f"), &to).unwrap());
        assert_eq!(fs::read(&to).unwrap(), b"old");
    }

    #[test]
    fn what_is_stopped_is_not_kept() {
        let dir = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(dir.path(), 1 << 30).unwrap();
        let content: Vec<u8> = (0..3 * PART + 5).map(|i| u8::try_from(i % 251).unwrap()).collect();
        let asked = std::cell::Cell::new(0);
        cache.put_unless(DiskCache::OBJECTS, key("a"), &content, &|| {
            asked.set(asked.get() + 1);
            asked.get() > 2
        });
        assert_eq!((asked.get(), cache.get(DiskCache::OBJECTS, key("a")), cache.failures()), (3, None, 0));
        assert_eq!(cache.usage().entries, 0);
        cache.put_unless(DiskCache::OBJECTS, key("a"), &content, &|| false);
        assert_eq!(cache.get(DiskCache::OBJECTS, key("a")).unwrap(), content);
    }

    #[test]
    fn stays_below_its_bound() {
        let dir = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(dir.path(), 10_000).unwrap();
        for i in 0..40 {
            cache.put(DiskCache::TILES, key(&i.to_string()), &[0; 1000]);
        }
        cache.trim();
        assert!(cache.usage().bytes <= 10_000);
        assert!(cache.usage().entries > 0);
    }
}
