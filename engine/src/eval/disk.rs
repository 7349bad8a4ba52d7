//! The cache on disk: shared by processes, bounded, and never trusted.
//!
//! An entry is a file `DIR/SHELF/xx/NAME`: its content, then its [`Seal`]. Entries are written under a temporary name
//! and renamed. An entry that does not match its seal is removed and computed again. When the cache exceeds its bound,
//! the least recently used entries are removed first.
//!
//! A marker file identifies the folder as a cache; without the marker, nothing in the folder is touched.
mod folder;
mod size;

pub use size::DiskUse;

use super::entry::{Digest, Digester};
use super::{Seal, Shelf, Store};
use crate::picture::AtomicFile;
use crate::value::Key;
use crate::value::clock::time_of_day;
use folder::FolderState;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Bytes written between two checks for cancellation: about a millisecond of work.
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
    /// Opens the cache in `dir`, kept below `bound` bytes; creates the folder if it does not exist. The cache reads and
    /// writes entries of the build of `seal`, and counts and removes entries of all builds.
    ///
    /// # Errors
    /// The folder cannot be created or written, or it contains files but no cache marker.
    pub fn open(dir: impl Into<PathBuf>, bound: u64, seal: Seal) -> Result<Self, CacheError> {
        let dir = dir.into();
        match made(&dir) {
            Ok(()) => Ok(Self { dir, bound, seal, written: AtomicU64::new(0), failures: AtomicU64::new(0) }),
            Err(source) => Err(CacheError { dir: dir.display().to_string(), source }),
        }
    }

    /// Marks the folder `dir`, which an earlier version created without a marker, as a cache; only if it contains
    /// nothing but entries. Meant for the default cache folder.
    pub fn adopt(dir: &Path) {
        if matches!(folder::state(dir), Ok(FolderState::Foreign)) && folder::holds_only_entries(dir) {
            // A failure is harmless: a folder without the marker is not used.
            let _ = folder::mark(dir);
        }
    }

    /// Returns true if the folder `dir` is a cache.
    pub fn is_cache(dir: &Path) -> bool {
        folder::is_marked(dir)
    }

    /// Removes all entries, then the folder if nothing else is in it.
    pub fn remove_all(self) {
        self.clear();
        folder::remove_empty(&self.dir);
        folder::unmark(&self.dir);
    }

    /// Number of entries that could not be written.
    pub fn failures(&self) -> u64 {
        self.failures.load(Ordering::Relaxed)
    }

    /// The file of an entry.
    pub fn path(&self, shelf: Shelf, key: Key) -> PathBuf {
        let name = self.seal.name(key).to_string();
        self.dir.join(shelf.name()).join(&name[..2]).join(&name[2..])
    }

    /// Opens an entry that looks intact: the file positioned at its content, the content's length, and the seal.
    /// Removes a damaged entry.
    fn look(&self, path: &Path) -> Option<(File, u64, [u8; Seal::BYTES])> {
        // Opening a pipe or device could block forever.
        let length = fs::symlink_metadata(path).ok().filter(fs::Metadata::is_file)?.len();
        if !folder::is_inside(&self.dir, path) {
            return None;
        }
        let look = || -> io::Result<Option<_>> {
            let Some(content) = length.checked_sub(Seal::BYTES as u64) else { return Ok(None) };
            let mut file = File::open(path)?;
            let mut seal = [0; Seal::BYTES];
            file.seek(SeekFrom::Start(content))?;
            file.read_exact(&mut seal)?;
            file.rewind()?;
            // No entry is larger than the cache, so a seal with a greater length is damaged.
            Ok(Some((file, content, seal)).filter(|_| Seal::length(&seal) == Some(content) && content <= self.bound))
        };
        look().ok()?.or_else(|| {
            let _ = fs::remove_file(path);
            None
        })
    }

    fn create(&self, shelf: Shelf, key: Key) -> io::Result<AtomicFile> {
        let path = self.path(shelf, key);
        let parent = path.parent().unwrap_or(&self.dir);
        if !parent.exists() {
            // Another process may have removed the whole cache.
            if !self.dir.exists() {
                made(&self.dir)?;
            }
            fs::create_dir_all(parent)?;
        }
        if !folder::is_inside(&self.dir, &path) {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "a folder of the cache is a link"));
        }
        AtomicFile::create(&path)
    }

    /// Seals an entry whose content is written, and gives it its final name.
    fn finish(&self, mut file: AtomicFile, shelf: Shelf, key: Key, content: &Digest) -> io::Result<u64> {
        file.write_all(&self.seal.of(shelf, key, content))?;
        file.commit()?;
        Ok(content.length)
    }

    /// Counts the bytes written or the failure. A failed write only costs time later, so it is not reported.
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
        let path = self.path(shelf, key);
        if folder::is_inside(&self.dir, &path) {
            let _ = fs::remove_file(path);
        }
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

    /// Removes the least recently used entries until the cache is below its bound; does nothing if nothing was written.
    fn tidy(&self) {
        if self.written.swap(0, Ordering::Relaxed) > 0 {
            self.trim_to(self.bound);
        }
    }
}

/// Creates and marks the folder of a cache if needed.
fn made(dir: &Path) -> io::Result<()> {
    fs::create_dir_all(dir)?;
    match folder::state(dir)? {
        // Only creating a file shows reliably that the folder is writable.
        FolderState::Marked => AtomicFile::create(dir.join("probe")).map(drop),
        FolderState::Empty => folder::mark(dir),
        FolderState::Foreign => {
            let message = "it holds files and is not marked as a cache of shibo; name a new folder, or an empty one";
            Err(io::Error::new(io::ErrorKind::AlreadyExists, message))
        }
    }
}

/// Marks an entry as just used.
fn touch(file: &File) {
    let _ = file.set_modified(time_of_day());
}

/// The side of a copy that failed.
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
mod tests;
