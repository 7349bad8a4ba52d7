//! Cache folders and the entries in them. No other file is removed, and no link is followed.
use crate::eval::Shelf;
use crate::eval::entry::is_hex;
use crate::picture::{AtomicFile, is_temporary};
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Name of the marker file, which backup programs also recognize: <https://bford.info/cachedir>.
const NAME: &str = "CACHEDIR.TAG";
/// Content of the marker: the first line is set by the convention, the second names this program.
const TAG: &str =
    "Signature: 8a477f597d28d172789f06886806bc55\n# This folder is a cache of shibo: it may be deleted.\n";

/// Kinds of folders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FolderState {
    /// A cache.
    Marked,
    /// No files except temporary ones.
    Empty,
    /// Anything else.
    Foreign,
}

/// Returns the kind of the folder `dir`.
///
/// # Errors
/// The folder cannot be read.
pub(super) fn state(dir: &Path) -> io::Result<FolderState> {
    let mut empty = true;
    for entry in fs::read_dir(dir)? {
        // Temporary files are ignored: another process may be creating the same cache.
        empty &= entry?.file_name().to_str().is_some_and(is_temporary);
    }
    // Checked last: another process may have marked the folder meanwhile.
    Ok(match is_marked(dir) {
        true => FolderState::Marked,
        false if empty => FolderState::Empty,
        false => FolderState::Foreign,
    })
}

/// Returns true if the folder `dir` contains the marker.
pub(super) fn is_marked(dir: &Path) -> bool {
    let path = dir.join(NAME);
    let mut start = String::new();
    let mut read = || fs::File::open(&path)?.take(TAG.len() as u64).read_to_string(&mut start);
    is_file(&path) && read().is_ok() && start == TAG
}

/// Marks the folder `dir` as a cache.
///
/// # Errors
/// The folder cannot be written.
pub(super) fn mark(dir: &Path) -> io::Result<()> {
    let mut file = AtomicFile::create(dir.join(NAME))?;
    file.write_all(TAG.as_bytes())?;
    file.commit()
}

/// Removes the marker and the folder `dir` if nothing else is in it.
pub(super) fn unmark(dir: &Path) {
    let names = || fs::read_dir(dir).into_iter().flatten().flatten().map(|entry| entry.file_name());
    if is_marked(dir) && names().all(|name| name == NAME) && fs::remove_file(dir.join(NAME)).is_ok() {
        let _ = fs::remove_dir(dir);
    }
}

/// Returns true if a folder without the marker contains only entries and their folders.
pub(super) fn holds_only_entries(dir: &Path) -> bool {
    let shelf = |name: &str| Shelf::ALL.iter().any(|shelf| shelf.name() == name);
    // Earlier versions used other names for temporary files.
    let entry = |name: &str| is_hex(name, Shelf::LETTERS[1]) || (name.starts_with('.') && name.ends_with(".tmp"));
    let all = |dir: &Path, fits: &dyn Fn(&str, &fs::FileType) -> bool| {
        let list = fs::read_dir(dir).map(|list| list.collect::<io::Result<Vec<_>>>());
        let fits = |entry: &fs::DirEntry| {
            entry.file_name().to_str().zip(entry.file_type().ok()).is_some_and(|(name, kind)| fits(name, &kind))
        };
        list.is_ok_and(|list| list.is_ok_and(|list| list.iter().all(fits)))
    };
    let folder_of = |name: &str, kind: &fs::FileType| kind.is_dir() && is_hex(name, Shelf::LETTERS[0]);
    all(dir, &|name, kind| kind.is_dir() && shelf(name) || kind.is_file() && is_temporary(name))
        && shelves(dir).all(|shelf| all(&shelf, &folder_of))
        && fans(dir).all(|fan| all(&fan, &|name, kind| kind.is_file() && entry(name)))
}

/// The shelf folders that exist.
fn shelves(dir: &Path) -> impl Iterator<Item = PathBuf> {
    Shelf::ALL.into_iter().map(|shelf| dir.join(shelf.name())).filter(|path| is_folder(path))
}

/// The folders that contain entries.
pub(super) fn fans(dir: &Path) -> impl Iterator<Item = PathBuf> {
    let list = |shelf: PathBuf| fs::read_dir(shelf).into_iter().flatten().flatten();
    let is_fan = |entry: &fs::DirEntry| entry.file_name().to_str().is_some_and(|name| is_hex(name, Shelf::LETTERS[0]));
    shelves(dir).flat_map(list).filter(is_fan).map(|entry| entry.path()).filter(|path| is_folder(path))
}

/// Removes empty entry folders and shelf folders.
pub(super) fn remove_empty(dir: &Path) {
    let (fans, shelves): (Vec<_>, Vec<_>) = (fans(dir).collect(), shelves(dir).collect());
    fans.iter().chain(&shelves).for_each(|folder| drop(fs::remove_dir(folder)));
}

/// Returns true if a file of this name in an entry folder is an entry.
pub(super) fn is_entry(name: &str) -> bool {
    is_hex(name, Shelf::LETTERS[1])
}

/// Returns true if no folder between the cache `dir` and `path` is a symbolic link.
pub(super) fn is_inside(dir: &Path, path: &Path) -> bool {
    let folders = path.ancestors().skip(1).take_while(|folder| *folder != dir);
    folders.into_iter().all(|folder| fs::symlink_metadata(folder).is_ok_and(|meta| meta.is_dir()))
}

/// Returns true if `path` is a regular file, not a link to one.
pub(super) fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|meta| meta.is_file())
}

fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|meta| meta.is_dir())
}
