//! What is read from the environment. Only the command reads it, not the crates below.
use sha2::{Digest, Sha256};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name).filter(|value| !value.is_empty())
}

/// Whether the user allows colours in terminals.
pub(crate) fn colors() -> bool {
    variable("NO_COLOR").is_none() && variable("TERM").is_none_or(|term| term != "dumb")
}

/// The folder for pictures of the library, beside that for results; that for temporary files if there is no home.
pub(crate) fn library_dir() -> PathBuf {
    let beside = cache_dir().and_then(|dir| Some(dir.parent()?.join("shibo-library")));
    beside.unwrap_or_else(|| std::env::temp_dir().join("shibo-library"))
}

/// The folder for pictures that editors show, beside that for results; that for temporary files if there is no home.
pub(crate) fn editor_dir() -> PathBuf {
    let beside = cache_dir().and_then(|dir| Some(dir.parent()?.join("shibo-editor")));
    beside.unwrap_or_else(|| std::env::temp_dir().join("shibo-editor"))
}

/// Where the address of the page is noted that shows a graph file, so that editors find it.
pub(crate) fn page_note(graph: &Path) -> PathBuf {
    let hash: String = Sha256::digest(graph.as_os_str().as_encoded_bytes())
        .iter()
        .take(10)
        .map(|byte| format!("{byte:02x}"))
        .collect();
    editor_dir().join(format!("page-{hash}.json"))
}

/// The folders that were given, once the command line is read.
static IMPORTS: OnceLock<Vec<PathBuf>> = OnceLock::new();

/// Takes the folders of the command line in which imports are looked for, besides that of the graph.
pub(crate) fn set_import_paths(given: Vec<PathBuf>) {
    let named = variable("SHIBO_IMPORT_PATH").unwrap_or_default();
    let named = std::env::split_paths(&named).filter(|folder| !folder.as_os_str().is_empty()).collect();
    let _ = IMPORTS.set([given, named].concat());
}

/// Further folders in which imports are looked for: those of the command line, then those of the environment.
pub(crate) fn import_paths() -> &'static [PathBuf] {
    IMPORTS.get().map_or(&[], Vec::as_slice)
}

/// The address of the cache that machines share, if there is one.
pub(crate) fn shared_cache() -> Option<String> {
    variable("SHIBO_SHARED_CACHE").map(|url| url.to_string_lossy().into_owned())
}

/// What all who may write into the shared cache know.
pub(crate) fn cache_key() -> Option<Vec<u8>> {
    variable("SHIBO_CACHE_KEY").map(OsString::into_encoded_bytes)
}

/// The folder for results: `$XDG_CACHE_HOME/shibo`, else `~/.cache/shibo`.
pub(crate) fn cache_dir() -> Option<PathBuf> {
    // The specification says that relative paths are to be ignored.
    let absolute = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache"))).map(|dir| dir.join("shibo"))
}
