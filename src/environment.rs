//! Environment variables. Only the command reads them, not the crates below.
use sha2::{Digest, Sha256};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name).filter(|value| !value.is_empty())
}

/// Returns whether the user allows colours in terminals.
pub(crate) fn colors() -> bool {
    variable("NO_COLOR").is_none() && variable("TERM").is_none_or(|term| term != "dumb")
}

/// Folder for pictures that editors show, beside the folder for results; the folder for temporary files if there is no
/// home.
pub(crate) fn editor_dir() -> PathBuf {
    let beside = cache_dir().and_then(|dir| Some(dir.parent()?.join("shibo-editor")));
    beside.unwrap_or_else(|| std::env::temp_dir().join("shibo-editor"))
}

/// Folder for what the user's running programs share: of the session, or else beside the folder for results.
pub(crate) fn runtime_dir() -> Option<PathBuf> {
    let session = variable("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|path| path.is_absolute());
    session.map(|dir| dir.join("shibo")).or_else(|| Some(cache_dir()?.parent()?.join("shibo-editor")))
}

/// File with the address of the page that shows a graph file, for editors.
pub(crate) fn page_note(graph: &Path) -> PathBuf {
    let hash: String = Sha256::digest(graph.as_os_str().as_encoded_bytes())
        .iter()
        .take(10)
        .map(|byte| format!("{byte:02x}"))
        .collect();
    editor_dir().join(format!("page-{hash}.json"))
}

/// Import folders, set once the command line is parsed.
static IMPORTS: OnceLock<Vec<PathBuf>> = OnceLock::new();

/// Sets the import folders that are searched after the folder of the graph.
pub(crate) fn set_import_paths(given: Vec<PathBuf>) {
    let named = variable("SHIBO_IMPORT_PATH").unwrap_or_default();
    let named = std::env::split_paths(&named).filter(|folder| !folder.as_os_str().is_empty()).collect();
    let _ = IMPORTS.set([given, named].concat());
}

/// Further import folders: first those of the command line, then those of the environment.
pub(crate) fn import_paths() -> &'static [PathBuf] {
    IMPORTS.get().map_or(&[], Vec::as_slice)
}

/// Address of the shared cache, if there is one.
pub(crate) fn shared_cache() -> Option<String> {
    variable("SHIBO_SHARED_CACHE").map(|url| url.to_string_lossy().into_owned())
}

/// Secret shared by all who may write to the shared cache.
pub(crate) fn cache_key() -> Option<Vec<u8>> {
    variable("SHIBO_CACHE_KEY").map(OsString::into_encoded_bytes)
}

/// Folder for results: `$XDG_CACHE_HOME/shibo`, else `~/.cache/shibo`.
pub(crate) fn cache_dir() -> Option<PathBuf> {
    // The XDG specification says to ignore relative paths.
    let absolute = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache"))).map(|dir| dir.join("shibo"))
}

/// The user's attributes of git: `$XDG_CONFIG_HOME/git/attributes`, else `~/.config/git/attributes`.
pub(crate) fn git_attributes() -> Option<PathBuf> {
    let folder = variable("XDG_CONFIG_HOME").map(PathBuf::from);
    let folder = folder.or_else(|| Some(PathBuf::from(variable("HOME")?).join(".config")));
    folder.map(|folder| folder.join("git").join("attributes"))
}

/// This program as a word for a shell: its name if the shell finds it by that, else its path in quotes.
pub(crate) fn program() -> String {
    let Ok(path) = std::env::current_exe() else { return "shibo".to_owned() };
    let name = path.file_name().unwrap_or_default();
    let same = |folder: PathBuf| match (folder.join(name).canonicalize(), path.canonicalize()) {
        (Ok(found), Ok(path)) => found == path,
        _ => false,
    };
    // The first program of that name in the search path is the one that a shell starts.
    let found = std::env::split_paths(&variable("PATH").unwrap_or_default()).find(|folder| folder.join(name).is_file());
    if found.is_some_and(same) {
        return name.to_string_lossy().into_owned();
    }
    // Git for Windows runs a POSIX shell, too.
    format!("'{}'", path.to_string_lossy().replace('\\', "/").replace('\'', "'\\''"))
}
