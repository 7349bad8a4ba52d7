//! `BLESS=1` rewrites the expected files of tests where results differ, and names the rewritten files; the test then
//! passes. It works for golden pictures, the node reference, and the marks in graph files with errors.
#![allow(dead_code, clippy::unwrap_used, reason = "each test program uses a part of it, and fails by panicking")]
use std::io::Write;
use std::path::Path;

/// True if `BLESS=1` is set.
pub(crate) fn blessing() -> bool {
    std::env::var_os("BLESS").is_some_and(|value| value == "1")
}

/// Prints a message that also shows when the output of tests is captured.
pub(crate) fn say(what: &str, path: &Path) {
    let mut stderr = std::io::stderr();
    writeln!(stderr, "BLESS: {what} {}", path.display()).unwrap();
}

/// Compares a text with the file at `path`; with `BLESS=1` rewrites the file.
pub(crate) fn compare(path: &Path, made: &[u8]) -> Result<(), String> {
    let kept = std::fs::read(path).unwrap_or_default();
    if kept == made {
        return Ok(());
    }
    if blessing() {
        std::fs::write(path, made).map_err(|error| format!("{}: {error}", path.display()))?;
        say("rewrote", path);
        return Ok(());
    }
    let same = kept.split(|byte| *byte == b'\n').zip(made.split(|byte| *byte == b'\n')).take_while(|(a, b)| a == b);
    Err(format!("{} is out of date from line {} on; BLESS=1 rewrites it", path.display(), same.count() + 1))
}

/// Reports a file without a counterpart; with `BLESS=1` removes it.
pub(crate) fn stray(path: &Path) -> Result<(), String> {
    if blessing() {
        std::fs::remove_file(path).map_err(|error| format!("{}: {error}", path.display()))?;
        say("removed", path);
        return Ok(());
    }
    Err(format!("{} belongs to nothing; BLESS=1 removes it", path.display()))
}
