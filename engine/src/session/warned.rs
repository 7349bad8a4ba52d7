//! Stores files with the warnings about them.
//!
//! A file without warnings lies under its own key. Warnings lie under a second key, and their file under a third key, which
//! is made of the warnings. If one of the two is lost, the file counts as missing, so no file is found without its warnings.
use crate::eval::{Shelf, Store, Warnings, bytes_of_warnings, warnings_from};
use crate::value::Key;
use std::io;
use std::path::Path;
use std::time::Duration;

/// The key of the warnings about a file.
fn of_warnings(file: Key) -> Key {
    Key::of("warnings", &[file.as_bytes()])
}

/// The key of a file with these warnings.
fn of_warned(file: Key, warnings: &[u8]) -> Key {
    Key::of("warned file", &[file.as_bytes(), warnings])
}

/// Stores the file at `from`, and the warnings about it, under the key `file`; making it again takes `spared` of CPU time.
pub(super) fn put(store: &dyn Store, file: Key, from: &Path, warnings: &Warnings, spared: Duration) {
    let bytes = bytes_of_warnings(warnings);
    if bytes.is_empty() {
        return store.put_file(file, from, spared);
    }
    store.put(Shelf::Files, of_warnings(file), &bytes, spared, &|| false);
    store.put_file(of_warned(file, &bytes), from, spared);
}

/// Writes the file under the key `file` to `to`, and returns the warnings about it. `None` if something is missing or
/// damaged; `to` is then unchanged.
///
/// # Errors
/// `to` cannot be written.
pub(super) fn get(store: &dyn Store, file: Key, to: &Path) -> io::Result<Option<Warnings>> {
    if store.get_file(file, to)? {
        return Ok(Some(Warnings::default()));
    }
    let Some(bytes) = store.get(Shelf::Files, of_warnings(file)) else { return Ok(None) };
    let Some(warnings) = warnings_from(&bytes) else { return Ok(None) };
    Ok(store.get_file(of_warned(file, &bytes), to)?.then_some(warnings))
}
