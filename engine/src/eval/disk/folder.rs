//! Cache folders and the entries in them. No other file is removed, and no link is followed.
use crate::eval::Shelf;
use crate::eval::entry::is_hex;
use crate::picture::{AtomicFile, is_temporary};
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// The file that marks a folder as a cache, for programs that make backups too: <https://bford.info/cachedir>.
const NAME: &str = "CACHEDIR.TAG";
/// Its text: the first line is that of the convention, the second names this program.
const TAG: &str =
    "Signature: 8a477f597d28d172789f06886806bc55\n# This folder is a cache of shibo: it may be deleted.\n";

/// Kinds of folders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// A cache.
    Marked,
    /// Without any file but those that are being written.
    Empty,
    /// Something else.
    Foreign,
}

/// Tells the kind of the folder `dir`.
///
/// # Errors
/// A folder that cannot be read.
pub(super) fn state(dir: &Path) -> io::Result<State> {
    let mut empty = true;
    for entry in fs::read_dir(dir)? {
        // Another process may be making the same cache.
        empty &= entry?.file_name().to_str().is_some_and(is_temporary);
    }
    // Looked at last: another process may have marked it meanwhile.
    Ok(match is_marked(dir) {
        true => State::Marked,
        false if empty => State::Empty,
        false => State::Foreign,
    })
}

/// Returns true if the folder `dir` has the marker.
pub(super) fn is_marked(dir: &Path) -> bool {
    let path = dir.join(NAME);
    let mut start = String::new();
    let mut read = || fs::File::open(&path)?.take(TAG.len() as u64).read_to_string(&mut start);
    is_file(&path) && read().is_ok() && start == TAG
}

/// Marks the folder `dir` as a cache.
///
/// # Errors
/// A folder that cannot be written.
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

/// Returns true if a folder without marker holds nothing but entries and the folders for them.
pub(super) fn holds_only_entries(dir: &Path) -> bool {
    let shelf = |name: &str| Shelf::ALL.iter().any(|shelf| shelf.name() == name);
    // Earlier versions had other names for temporary files.
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

/// The folders of the shelves.
fn shelves(dir: &Path) -> impl Iterator<Item = PathBuf> {
    Shelf::ALL.into_iter().map(|shelf| dir.join(shelf.name())).filter(|path| is_folder(path))
}

/// The folders that hold entries.
pub(super) fn fans(dir: &Path) -> impl Iterator<Item = PathBuf> {
    let list = |shelf: PathBuf| fs::read_dir(shelf).into_iter().flatten().flatten();
    let is_fan = |entry: &fs::DirEntry| entry.file_name().to_str().is_some_and(|name| is_hex(name, Shelf::LETTERS[0]));
    shelves(dir).flat_map(list).filter(is_fan).map(|entry| entry.path()).filter(|path| is_folder(path))
}

/// Removes the folders of entries, of those that are empty.
pub(super) fn remove_empty(dir: &Path) {
    let (fans, shelves): (Vec<_>, Vec<_>) = (fans(dir).collect(), shelves(dir).collect());
    fans.iter().chain(&shelves).for_each(|folder| drop(fs::remove_dir(folder)));
}

/// Returns true if a file of this name in a folder of entries is an entry.
pub(super) fn is_entry(name: &str) -> bool {
    is_hex(name, Shelf::LETTERS[1])
}

/// Returns true if no folder between the cache `dir` and `path` is a link.
pub(super) fn is_inside(dir: &Path, path: &Path) -> bool {
    let folders = path.ancestors().skip(1).take_while(|folder| *folder != dir);
    folders.into_iter().all(|folder| fs::symlink_metadata(folder).is_ok_and(|meta| meta.is_dir()))
}

/// Returns true if there is a file, and not a link to one.
pub(super) fn is_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|meta| meta.is_file())
}

fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|meta| meta.is_dir())
}
