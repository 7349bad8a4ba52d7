//! The gate to files: where a graph reads files, and which of them, for programs that load graphs of strangers.
use super::text_file::Fault;
use crate::diagnostics::Code;
use crate::value::files::{Disk, FileHandle, Files};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Has the files that a graph may read. The default has every file of the machine.
#[derive(Clone, Debug)]
pub struct Gate(Arc<dyn Files>);

impl Default for Gate {
    fn default() -> Self {
        Self::of(Disk)
    }
}

impl Gate {
    /// A gate to those of these files that [may be read](Files::real), and to no others.
    pub fn of(files: impl Files + 'static) -> Self {
        Self(Arc::new(files))
    }

    /// A path that is equal for all paths to one file.
    pub fn identity(&self, path: &Path) -> PathBuf {
        self.0.identity(path)
    }

    /// The files, whether they may be read or not.
    pub(super) fn files(&self) -> &dyn Files {
        &*self.0
    }

    /// A file; `None` for a file outside. It need not exist.
    pub fn file(&self, path: &Path) -> Option<FileHandle> {
        self.0.real(path).map(|real| FileHandle::new(self.0.clone(), real))
    }

    /// The names in a folder, in any order; none if it is outside or cannot be read.
    pub fn names(&self, folder: &Path) -> Vec<OsString> {
        self.0.real(folder).and_then(|folder| self.0.names(&folder).ok()).unwrap_or_default()
    }

    /// True if a file exists and may be read.
    pub fn has(&self, path: &Path) -> bool {
        self.file(path).is_some_and(|file| file.facts().is_ok_and(|facts| facts.is_file()))
    }

    /// A file that may be read. It need not exist.
    pub(super) fn pass(&self, path: &Path) -> Result<FileHandle, Fault> {
        self.file(path).ok_or_else(outside)
    }

    /// A file of a set that may be read. It keeps its path, which has the number of its tile.
    pub(super) fn pass_in_set(&self, path: PathBuf) -> Result<FileHandle, Fault> {
        self.pass(&path)?;
        Ok(FileHandle::new(self.0.clone(), path))
    }

    /// The path of a set of files, `<UDIM>` in its name. Only its folder is a file.
    pub(super) fn pass_set(&self, path: &Path) -> Result<PathBuf, Fault> {
        match (path.parent(), path.file_name()) {
            (Some(folder), Some(name)) => Ok(self.pass(folder)?.path().join(name)),
            _ => Ok(self.pass(path)?.path().to_owned()),
        }
    }
}

/// The refusal of a file. It does not tell whether the file exists.
fn outside() -> Fault {
    Fault::new(Code::Outside, "this file is outside of the folders that may be read".to_owned())
}
