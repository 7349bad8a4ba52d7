//! Support for editors: they find the page of a graph, and show the line of a clicked node.
use crate::environment;
use crate::serve::SourcePosition;
use serde_json::json;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Older notes belong to pages that have ended.
const OLD: Duration = Duration::from_secs(30 * 24 * 3600);

/// Starts the user's editor at a source position. The command is split at blanks; words may be quoted.
pub(super) fn open(command: &str, place: &SourcePosition) {
    let mut words = words(command).into_iter().map(|word| {
        let word = word.replace("{line}", &place.line.to_string()).replace("{column}", &place.column.to_string());
        word.replace("{file}", &place.file.to_string_lossy())
    });
    let Some(program) = words.next() else { return };
    let mut command = Command::new(program);
    command.args(words).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    if let Ok(mut child) = command.spawn() {
        // Waiting for the child process keeps it from becoming a zombie.
        std::thread::spawn(move || child.wait());
    }
}

/// Words of a command line.
fn words(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote = None;
    for c in command.chars() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (None, '"' | '\'') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, c) if c.is_whitespace() => words.extend(word.take()),
            (_, c) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

/// File with the address of a page, deleted with the page.
pub(super) struct Note(PathBuf);

impl Note {
    /// Writes the address of the page of a graph to a file that only this user can read. Without it, editors start a
    /// page of their own.
    pub(super) fn write(graph: &Path, url: &str) -> Option<Self> {
        let path = environment::page_note(&graph.canonicalize().ok()?);
        fs::create_dir_all(path.parent()?).ok()?;
        tidy(path.parent()?);
        let _ = fs::remove_file(&path);
        let mut options = fs::OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let note = json!({ "url": url, "pid": std::process::id() });
        options.open(&path).ok()?.write_all(note.to_string().as_bytes()).ok()?;
        Some(Self(path))
    }
}

/// Removes old notes, left by processes that were killed.
fn tidy(folder: &Path) {
    let old = |path: &Path| {
        let file = fs::symlink_metadata(path).ok().filter(fs::Metadata::is_file);
        let modified = file.and_then(|metadata| metadata.modified().ok());
        let age = modified.and_then(|time| time.elapsed().ok());
        age.is_some_and(|age| age > OLD)
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let hash = name.to_str().and_then(|name| name.strip_prefix("page-")?.strip_suffix(".json"));
        let note = hash.is_some_and(|hash| hash.len() == 20 && hash.bytes().all(|byte| byte.is_ascii_hexdigit()));
        if note && old(&entry.path()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

impl Drop for Note {
    fn drop(&mut self) {
        // Another page of the same graph may have replaced the note by its own.
        let own = format!("\"pid\":{}", std::process::id());
        if fs::read_to_string(&self.0).is_ok_and(|note| note.contains(&own)) {
            let _ = fs::remove_file(&self.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_commands_into_words() {
        assert_eq!(words("code -g {file}:{line}"), ["code", "-g", "{file}:{line}"]);
        assert_eq!(words("  'a b'\"c\"  '' d"), ["a bc", "", "d"]);
        assert_eq!(words(""), Vec::<String>::new());
    }
}
