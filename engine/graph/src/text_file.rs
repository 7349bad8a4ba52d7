//! Reads text files.
use crate::diagnostics::Code;
use crate::value::files::{FileHandle, FileKind};
use std::io::ErrorKind;
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

/// Checks that a file is a regular one that exists. Other files are never opened, since opening a pipe could block forever.
pub(super) fn check_file(file: &FileHandle) -> Result<(), Fault> {
    let shown = file.display();
    let facts = file.facts().map_err(|error| match error.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => {
            Fault::new(Code::FileNotFound, format!("there is no file `{shown}`"))
        }
        _ => unreadable(file, &error),
    })?;
    match facts.kind {
        FileKind::Regular => Ok(()),
        FileKind::Folder => Err(Fault::new(Code::BadFile, format!("`{shown}` is a folder; it must be a file"))),
        FileKind::Other(_) => Err(Fault::new(Code::BadFile, format!("`{shown}` is not a regular file"))),
    }
}

fn unreadable(file: &FileHandle, error: &std::io::Error) -> Fault {
    Fault::new(Code::BadFile, format!("`{}` cannot be read: {error}", file.display()))
}

/// Reads a text of limited length.
pub(super) fn read_text(file: &FileHandle, limit: u64) -> Result<String, Fault> {
    check_file(file)?;
    let shown = file.display();
    let bytes = file.bytes(limit).map_err(|error| match error.kind() {
        ErrorKind::FileTooLarge => Fault::too_large(file.path(), limit),
        _ => unreadable(file, &error),
    })?;
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let prefix = String::from_utf8_lossy(&error.as_bytes()[..at]).into_owned();
        Fault { prefix, ..Fault::new(Code::BadFile, format!("`{shown}` is not UTF-8 text: byte {at} is not")) }
    })
}
