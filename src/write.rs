//! Writing files that people wrote: all of it or nothing, in place.
use shibo_engine::picture::AtomicFile;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

/// Replaces the content of a file, or of what a link to a file leads to. It keeps its permissions.
pub(crate) fn replace(path: &Path, text: &str) -> io::Result<()> {
    let path = path.canonicalize()?;
    let permissions = fs::metadata(&path)?.permissions();
    let mut file = AtomicFile::create(&path)?;
    file.write_all(text.as_bytes())?;
    file.set_permissions(permissions)?;
    file.commit()
}
