//! The cache on disk: shared by processes, bounded, and never trusted.
//!
//! An entry is a file `DIR/SHELF/xx/NAME`: its content, then its [`Seal`]. Entries are written under a temporary name and
//! renamed; one that does not match its seal is removed and made again. When the cache outgrows its bound, the entries not
//! used for longest go first.
mod size;

pub use size::DiskUse;

use super::entry::{Digest, Digester};
use super::{Seal, Shelf, Store};
use crate::picture::AtomicFile;
use crate::value::Key;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// Bytes that are written before asking again whether to stop: about a millisecond's work.
const PART: usize = 1 << 20;

/// A cache folder that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("the cache folder `{dir}` cannot be used: {source}")]
pub struct CacheError {
    dir: String,
    source: io::Error,
}

/// A folder of results by shelf and key.
#[derive(Debug)]
pub struct DiskCache {
    dir: PathBuf,
    bound: u64,
    seal: Seal,
    written: AtomicU64,
    failures: AtomicU64,
}

impl DiskCache {
    /// The cache in `dir`, which is made if it does not exist, kept below `bound` bytes. It reads and writes the entries of
    /// the build of `seal`, and counts and removes those of all builds.
    ///
    /// # Errors
    /// A folder that cannot be made or written.
    pub fn open(dir: impl Into<PathBuf>, bound: u64, seal: Seal) -> Result<Self, CacheError> {
        let dir = dir.into();
        let probe = || {
            fs::create_dir_all(&dir)?;
            // Making a file is the only reliable answer to whether one can.
            AtomicFile::create(dir.join("probe")).map(drop)
        };
        match probe() {
            Ok(()) => Ok(Self { dir, bound, seal, written: AtomicU64::new(0), failures: AtomicU64::new(0) }),
            Err(source) => Err(CacheError { dir: dir.display().to_string(), source }),
        }
    }

    /// How many entries could not be written.
    pub fn failures(&self) -> u64 {
        self.failures.load(Ordering::Relaxed)
    }

    /// The file of an entry.
    pub fn path(&self, shelf: Shelf, key: Key) -> PathBuf {
        let name = self.seal.name(key).to_string();
        self.dir.join(shelf.name()).join(&name[..2]).join(&name[2..])
    }

    /// An entry that looks whole: the file at its content, the content's length, and the seal. One that does not is removed.
    fn look(&self, path: &Path) -> Option<(File, u64, [u8; Seal::BYTES])> {
        // Opening something that is not a file could block forever.
        let length = fs::metadata(path).ok().filter(fs::Metadata::is_file)?.len();
        let look = || -> io::Result<Option<_>> {
            let Some(content) = length.checked_sub(Seal::BYTES as u64) else { return Ok(None) };
            let mut file = File::open(path)?;
            let mut seal = [0; Seal::BYTES];
            file.seek(SeekFrom::Start(content))?;
            file.read_exact(&mut seal)?;
            file.rewind()?;
            // No entry is larger than the cache, so one that says so is damaged.
            Ok(Some((file, content, seal)).filter(|_| Seal::length(&seal) == Some(content) && content <= self.bound))
        };
        look().ok()?.or_else(|| {
            let _ = fs::remove_file(path);
            None
        })
    }

    fn create(&self, shelf: Shelf, key: Key) -> io::Result<AtomicFile> {
        let path = self.path(shelf, key);
        AtomicFile::create(&path).or_else(|error| {
            let Some(folder) = path.parent().filter(|_| error.kind() == io::ErrorKind::NotFound) else {
                return Err(error);
            };
            fs::create_dir_all(folder)?;
            AtomicFile::create(&path)
        })
    }

    /// Seals and names an entry whose content is written.
    fn finish(&self, mut file: AtomicFile, shelf: Shelf, key: Key, content: &Digest) -> io::Result<u64> {
        file.write_all(&self.seal.of(shelf, key, content))?;
        file.commit()?;
        Ok(content.length)
    }

    /// A failure only costs time later, so it is only counted.
    fn account(&self, written: io::Result<u64>) {
        match written {
            Ok(bytes) => self.written.fetch_add(bytes, Ordering::Relaxed),
            Err(_) => self.failures.fetch_add(1, Ordering::Relaxed),
        };
    }
}

impl Store for DiskCache {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        let path = self.path(shelf, key);
        let (mut file, length, seal) = self.look(&path)?;
        let mut content = Vec::new();
        content.try_reserve_exact(usize::try_from(length).ok()?).ok()?;
        let mut digest = Digester::default();
        if (&mut file).take(length).read_to_end(&mut content).is_ok() {
            digest.update(&content);
        }
        if self.seal.of(shelf, key, &digest.finish()) != seal {
            let _ = fs::remove_file(&path);
            return None;
        }
        touch(&file);
        Some(content)
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], _spared: Duration, stopped: &dyn Fn() -> bool) {
        let write = || -> io::Result<Option<u64>> {
            let mut file = self.create(shelf, key)?;
            let mut digest = Digester::default();
            for part in content.chunks(PART) {
                if stopped() {
                    return Ok(None);
                }
                digest.update(part);
                file.write_all(part)?;
            }
            self.finish(file, shelf, key, &digest.finish()).map(Some)
        };
        if let Some(written) = write().transpose() {
            self.account(written);
        }
    }

    fn remove(&self, shelf: Shelf, key: Key) {
        let _ = fs::remove_file(self.path(shelf, key));
    }

    fn get_file(&self, key: Key, to: &Path) -> io::Result<bool> {
        let path = self.path(Shelf::Files, key);
        let Some((mut from, length, seal)) = self.look(&path) else { return Ok(false) };
        let mut target = AtomicFile::create(to)?;
        let digest = match copy(&mut from, &mut target, length) {
            Ok(digest) => digest,
            Err(Fault::Read(_)) => return Ok(false),
            Err(Fault::Write(error)) => return Err(error),
        };
        if self.seal.of(Shelf::Files, key, &digest) != seal {
            let _ = fs::remove_file(&path);
            return Ok(false);
        }
        target.commit()?;
        touch(&from);
        Ok(true)
    }

    fn put_file(&self, key: Key, from: &Path, _spared: Duration) {
        let copied = || -> io::Result<u64> {
            let mut to = self.create(Shelf::Files, key)?;
            let digest = copy(&mut File::open(from)?, &mut to, u64::MAX)?;
            self.finish(to, Shelf::Files, key, &digest)
        };
        self.account(copied());
    }

    fn room(&self) -> u64 {
        self.bound
    }

    /// Removes what has not been used for longest until it is below its bound; does nothing if nothing was written.
    fn tidy(&self) {
        if self.written.swap(0, Ordering::Relaxed) > 0 {
            self.trim_to(self.bound);
        }
    }
}

/// Marks an entry as just used.
fn touch(file: &File) {
    let _ = file.set_modified(SystemTime::now());
}

/// Which end of a copy failed.
enum Fault {
    Read(io::Error),
    Write(io::Error),
}

impl From<Fault> for io::Error {
    fn from(fault: Fault) -> Self {
        let (Fault::Read(error) | Fault::Write(error)) = fault;
        error
    }
}

/// Copies at most `limit` bytes.
fn copy(from: &mut File, to: &mut impl Write, limit: u64) -> Result<Digest, Fault> {
    let mut digest = Digester::default();
    let mut buffer = vec![0; 1 << 18];
    let mut left = limit;
    while left > 0 {
        let want = usize::try_from(left).map_or(buffer.len(), |n| n.min(buffer.len()));
        let n = from.read(&mut buffer[..want]).map_err(Fault::Read)?;
        if n == 0 {
            break;
        }
        digest.update(&buffer[..n]);
        to.write_all(&buffer[..n]).map_err(Fault::Write)?;
        left -= n as u64;
    }
    Ok(digest.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO_TIME: Duration = Duration::ZERO;

    fn key(word: &str) -> Key {
        Key::of("test", &[word.as_bytes()])
    }

    pub(super) fn open(dir: &Path, bound: u64) -> DiskCache {
        DiskCache::open(dir, bound, Seal::new(key("build"))).unwrap()
    }

    pub(super) fn put(cache: &DiskCache, shelf: Shelf, word: &str, content: &[u8]) {
        cache.put(shelf, key(word), content, NO_TIME, &|| false);
    }

    #[test]
    fn gives_back_what_was_put() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 1 << 20);
        put(&cache, Shelf::Objects, "a", b"content");
        assert_eq!(cache.get(Shelf::Objects, key("a")).unwrap(), b"content");
        assert_eq!(cache.get(Shelf::Objects, key("b")), None);
        assert_eq!(cache.get(Shelf::Tiles, key("a")), None);
        cache.remove(Shelf::Objects, key("a"));
        assert_eq!(cache.get(Shelf::Objects, key("a")), None);
        put(&cache, Shelf::Tiles, "a", b"");
        assert_eq!(cache.get(Shelf::Tiles, key("a")).unwrap(), b"");
        assert_eq!(cache.clear().entries, 1);
        assert_eq!(cache.usage().entries, 0);
    }

    #[test]
    fn damaged_entries_are_removed_not_served() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 1 << 20);
        let path = cache.path(Shelf::Objects, key("a"));
        put(&cache, Shelf::Objects, "a", b"content");
        let good = fs::read(&path).unwrap();
        let damaged = (0..good.len()).map(|at| {
            let mut bytes = good.clone();
            bytes[at] ^= 1;
            bytes
        });
        let cut = (0..good.len()).map(|at| good[..at].to_vec());
        let longer = [[&good[..], b"x"].concat(), [b"x", &good[..]].concat(), [&good[..], &good[..]].concat()];
        for bytes in damaged.chain(cut).chain(longer) {
            fs::write(&path, &bytes).unwrap();
            assert_eq!(cache.get(Shelf::Objects, key("a")), None, "{bytes:?}");
            assert!(!path.exists());
        }
        fs::write(&path, &good).unwrap();
        assert_eq!(cache.get(Shelf::Objects, key("a")).unwrap(), b"content");
    }

    #[test]
    fn an_entry_is_believed_in_its_own_place_only() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 1 << 20);
        let other = DiskCache::open(dir.path(), 1 << 20, Seal::new(key("another build"))).unwrap();
        put(&cache, Shelf::Tiles, "a", b"content");
        let good = cache.path(Shelf::Tiles, key("a"));
        assert_eq!(other.get(Shelf::Tiles, key("a")), None);
        assert!(good.exists(), "another build's entries are left alone");
        let places = [
            (&cache, Shelf::Tiles, key("b")),
            (&cache, Shelf::Objects, key("a")),
            (&cache, Shelf::Files, key("a")),
            (&cache, Shelf::Channels, key("a")),
            (&other, Shelf::Tiles, key("a")),
        ];
        for (cache, shelf, key) in places {
            let path = cache.path(shelf, key);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::copy(&good, &path).unwrap();
            let to = dir.path().join("to");
            let found =
                if shelf == Shelf::Files { cache.get_file(key, &to).unwrap() } else { cache.get(shelf, key).is_some() };
            assert!(!found && !path.exists() && !to.exists(), "{shelf:?}");
        }
        assert_eq!(cache.get(Shelf::Tiles, key("a")).unwrap(), b"content");
    }

    #[test]
    fn files_are_copied_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(&dir.path().join("cache"), 1 << 20);
        let (from, to) = (dir.path().join("from"), dir.path().join("to"));
        fs::write(&from, vec![7; 300_000]).unwrap();
        cache.put_file(key("f"), &from, NO_TIME);
        assert!(cache.get_file(key("f"), &to).unwrap());
        assert_eq!(fs::read(&to).unwrap(), vec![7; 300_000]);
        let path = cache.path(Shelf::Files, key("f"));
        let mut bytes = fs::read(&path).unwrap();
        bytes[1000] = 8;
        fs::write(&path, bytes).unwrap();
        fs::write(&to, b"old").unwrap();
        assert!(!cache.get_file(key("f"), &to).unwrap());
        assert_eq!(fs::read(&to).unwrap(), b"old");
        // A file that cannot be read is not kept, one that cannot be written is told.
        cache.put_file(key("g"), &dir.path().join("none"), NO_TIME);
        assert!(!cache.get_file(key("g"), &to).unwrap());
        cache.put_file(key("f"), &from, NO_TIME);
        assert!(cache.get_file(key("f"), &dir.path().join("none/to")).is_err());
    }

    #[test]
    fn what_is_stopped_is_not_kept() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 1 << 30);
        let content: Vec<u8> = (0..3 * PART + 5).map(|i| u8::try_from(i % 251).unwrap()).collect();
        let asked = std::cell::Cell::new(0);
        cache.put(Shelf::Objects, key("a"), &content, NO_TIME, &|| {
            asked.set(asked.get() + 1);
            asked.get() > 2
        });
        assert_eq!((asked.get(), cache.get(Shelf::Objects, key("a")), cache.failures()), (3, None, 0));
        assert_eq!(cache.usage().entries, 0);
        put(&cache, Shelf::Objects, "a", &content);
        assert_eq!(cache.get(Shelf::Objects, key("a")).unwrap(), content);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn what_is_no_entry_is_in_nobodys_way() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 1 << 20);
        let path = cache.path(Shelf::Objects, key("a"));
        // A folder in an entry's place: nothing can be kept there, and nothing fails.
        fs::create_dir_all(&path).unwrap();
        put(&cache, Shelf::Objects, "a", b"content");
        assert_eq!((cache.get(Shelf::Objects, key("a")), cache.failures()), (None, 1));
        fs::remove_dir(&path).unwrap();
        // A pipe, which nobody ever writes to.
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        assert_eq!(cache.get(Shelf::Objects, key("a")), None);
        fs::remove_file(&path).unwrap();
        // A file that is longer than any memory, with a seal that confirms it.
        put(&cache, Shelf::Objects, "a", b"content");
        let seal = fs::read(&path).unwrap().split_off(7);
        let length = 1_u64 << 43;
        let file = File::create(&path).unwrap();
        file.set_len(length).unwrap();
        let mut file = fs::OpenOptions::new().append(true).open(&path).unwrap();
        file.write_all(&[&seal[..8], &length.to_ne_bytes(), &seal[16..]].concat()).unwrap();
        assert_eq!(cache.get(Shelf::Objects, key("a")), None);
        assert!(!path.exists());
        // What a process left that was killed goes at the next tidying, and what a live one is writing stays.
        let folder = path.parent().unwrap();
        fs::write(folder.join(".x.4294967295.0.tmp"), "").unwrap();
        fs::write(folder.join(".x.1.0.tmp"), "").unwrap();
        put(&cache, Shelf::Objects, "b", b"content");
        cache.tidy();
        assert!(folder.join(".x.1.0.tmp").exists() && !folder.join(".x.4294967295.0.tmp").exists());
    }
}
