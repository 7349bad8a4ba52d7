//! Writing files: all of it or nothing.
use shibo_engine::picture::AtomicFile;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

/// Writes a file, and the folders that it lies in if need be: all of it, or what was there before stays.
pub(crate) fn whole(path: &Path, content: &[u8]) -> io::Result<()> {
    path.parent().map_or(Ok(()), fs::create_dir_all)?;
    let mut file = AtomicFile::create(path)?;
    file.write_all(content)?;
    file.commit()
}

/// Replaces the content of a file, or of what a link to a file leads to. It keeps its permissions.
pub(crate) fn replace(path: &Path, text: &str) -> io::Result<()> {
    let path = path.canonicalize()?;
    let permissions = fs::metadata(&path)?.permissions();
    let mut file = AtomicFile::create(&path)?;
    file.write_all(text.as_bytes())?;
    file.set_permissions(permissions)?;
    file.commit()
}
