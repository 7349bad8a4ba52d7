//! Files that a graph reads, and detection of changes of their content.
use sha2::{Digest, Sha256};
use shibo_value::files::Facts;
use std::collections::BTreeMap;
use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Larger files are not read again merely because their signature may hide a change.
const READ_AGAIN: u64 = 4 << 20;

/// State of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileState {
    /// A file with this hash of its content.
    Content([u8; 32]),
    /// No file.
    Missing,
    /// A directory or other non-file, or an unreadable file.
    Unreadable,
}

#[derive(Clone, Copy, Debug)]
struct Print {
    signature: Option<Facts>,
    read: SystemTime,
    state: FileState,
}

impl Print {
    fn of(path: &Path) -> Self {
        let read = SystemTime::now();
        let metadata = fs::metadata(path);
        let signature = metadata.as_ref().ok().map(Facts::of);
        let state = match &metadata {
            Ok(metadata) if metadata.is_file() => hash(path).map_or_else(|e| without(&e), FileState::Content),
            Ok(_) => FileState::Unreadable,
            Err(error) => without(error),
        };
        Self { signature, read, state }
    }

    /// Returns whether the file has certainly not changed, judged without reading it.
    fn holds(&self, path: &Path) -> bool {
        let signature = fs::metadata(path).ok().as_ref().map(Facts::of);
        let readable = matches!(self.state, FileState::Content(_) | FileState::Missing);
        let tells = |signature: Facts| signature.length > READ_AGAIN || !signature.may_hide_a_change(self.read);
        readable && signature == self.signature && signature.is_none_or(tells)
    }
}

fn without(error: &io::Error) -> FileState {
    match error.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => FileState::Missing,
        _ => FileState::Unreadable,
    }
}

fn hash(path: &Path) -> io::Result<[u8; 32]> {
    let mut hasher = Sha256::new();
    io::copy(&mut File::open(path)?, &mut hasher)?;
    Ok(hasher.finalize().into())
}

/// Hash of a content.
pub(super) fn sha256(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

/// Formats a hash in hexadecimal.
pub(super) fn hex(hash: &[u8; 32]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Files and their last known states.
#[derive(Debug, Default)]
pub(crate) struct Files {
    prints: BTreeMap<PathBuf, Print>,
}

impl Files {
    /// Tracks exactly these files from now on; known states of remaining files are kept.
    pub(crate) fn keep(&mut self, paths: &[PathBuf]) {
        self.prints.retain(|path, _| paths.contains(path));
        for path in paths {
            self.prints.entry(path.clone()).or_insert_with(|| Print::of(path));
        }
    }

    /// The paths.
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        self.prints.keys().map(PathBuf::as_path)
    }

    /// Records the content of a file that was just read elsewhere.
    pub(super) fn note(&mut self, path: &Path, before: Option<Metadata>, state: FileState) {
        let signature = before.as_ref().map(Facts::of);
        self.prints.insert(path.to_owned(), Print { signature, read: SystemTime::now(), state });
    }

    /// Returns the files that have changed since the last call, and records their content.
    pub(crate) fn changed(&mut self) -> Vec<PathBuf> {
        let mut changed = Vec::new();
        for (path, print) in &mut self.prints {
            if print.holds(path) {
                continue;
            }
            let new = Print::of(path);
            if new.state != print.state {
                changed.push(path.clone());
            }
            *print = new;
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn detects_changes_by_content() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        fs::write(&a, "one").unwrap();
        let mut files = Files::default();
        files.keep(&[a.clone(), b.clone()]);
        assert!(files.changed().is_empty());
        fs::write(&a, "one").unwrap();
        assert!(files.changed().is_empty(), "the same content is no change");
        fs::write(&a, "two").unwrap();
        assert_eq!(files.changed(), std::slice::from_ref(&a));
        fs::write(&b, "").unwrap();
        assert_eq!(files.changed(), std::slice::from_ref(&b), "a file that was missing");
        fs::remove_file(&a).unwrap();
        fs::create_dir(&a).unwrap();
        assert_eq!(files.changed(), std::slice::from_ref(&a), "a folder in the place of a file");
        assert!(files.changed().is_empty());
        files.keep(std::slice::from_ref(&b));
        fs::remove_dir(&a).unwrap();
        assert!(files.changed().is_empty(), "what is not kept is not looked at");
    }

    #[test]
    fn detects_change_within_timestamp_resolution() {
        let dir = tempfile::tempdir().unwrap();
        let a = dir.path().join("a");
        fs::write(&a, "0").unwrap();
        let mut files = Files::default();
        files.keep(std::slice::from_ref(&a));
        for i in 0..50_u8 {
            fs::write(&a, [b'a' + i % 2]).unwrap();
            assert_eq!(files.changed().len(), 1, "{i}");
        }
    }
}
