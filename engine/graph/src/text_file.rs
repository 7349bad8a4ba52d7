//! Reads text files.
use crate::diagnostics::Code;
use std::io::Read;
use std::path::Path;

/// Reason why a file cannot be used.
pub(super) struct Fault {
    pub(super) code: Code,
    pub(super) message: String,
    /// The text before the fault.
    pub(super) prefix: String,
}

impl Fault {
    pub(super) fn new(code: Code, message: String) -> Self {
        Self { code, message, prefix: String::new() }
    }

    pub(super) fn too_large(path: &Path, limit: u64) -> Self {
        let shown = path.display();
        Self::new(
            Code::TooLarge,
            format!("`{shown}` is larger than {limit} bytes, the most that a graph file may have"),
        )
    }
}

/// Opens a readable file. Only regular files are opened, since opening a pipe could block forever.
pub(super) fn check_file(path: &Path) -> Result<std::fs::File, Fault> {
    let shown = path.display();
    let explain = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => {
            Fault::new(Code::FileNotFound, format!("there is no file `{shown}`"))
        }
        _ => Fault::new(Code::BadFile, format!("`{shown}` cannot be read: {error}")),
    };
    let metadata = std::fs::metadata(path).map_err(explain)?;
    if metadata.is_dir() {
        return Err(Fault::new(Code::BadFile, format!("`{shown}` is a folder; it must be a file")));
    }
    if !metadata.is_file() {
        return Err(Fault::new(Code::BadFile, format!("`{shown}` is not a regular file")));
    }
    std::fs::File::open(path).map_err(explain)
}

/// Reads a text of limited length.
pub(super) fn read_text(path: &Path, limit: u64) -> Result<String, Fault> {
    let file = check_file(path)?;
    let shown = path.display();
    let mut bytes = Vec::new();
    let read = file.take(limit + 1).read_to_end(&mut bytes);
    read.map_err(|e| Fault::new(Code::BadFile, format!("`{shown}` cannot be read: {e}")))?;
    if bytes.len() as u64 > limit {
        return Err(Fault::too_large(path, limit));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let prefix = String::from_utf8_lossy(&error.as_bytes()[..at]).into_owned();
        Fault { prefix, ..Fault::new(Code::BadFile, format!("`{shown}` is not UTF-8 text: byte {at} is not")) }
    })
}
