//! The gate to files: where a graph reads files, and which of them, for programs that load graphs of strangers.
use super::text_file::Fault;
use crate::diagnostics::Code;
use crate::value::files::{Disk, FileHandle, Files};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Returns the real path of a file that may be read; `None` for a file outside, whether it exists or not. A file that does not
/// exist in a folder that may be read keeps its path.
type Allow = dyn Fn(&Path) -> Option<PathBuf> + Send + Sync;

/// Has the files that a graph may read. The default has every file of the machine.
#[derive(Clone)]
pub struct Gate {
    files: Arc<dyn Files>,
    allow: Option<Arc<Allow>>,
}

impl Default for Gate {
    fn default() -> Self {
        Self { files: Arc::new(Disk), allow: None }
    }
}

impl fmt::Debug for Gate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Gate({:?}, {})", self.files, if self.allow.is_some() { "some" } else { "all" })
    }
}

impl Gate {
    /// A gate to the files of the machine that asks `allow` for the real path of each file in a graph and in its imports.
    /// `None` refuses the file.
    pub fn new(allow: impl Fn(&Path) -> Option<PathBuf> + Send + Sync + 'static) -> Self {
        Self { allow: Some(Arc::new(allow)), ..Self::default() }
    }

    /// A gate to all of these files and to no others.
    pub fn of(files: impl Files + 'static) -> Self {
        Self { files: Arc::new(files), allow: None }
    }

    /// A path that is equal for all paths to one file.
    pub(super) fn identity(&self, path: &Path) -> PathBuf {
        self.files.identity(path)
    }

    /// The files, whether they may be read or not.
    pub(super) fn files(&self) -> &dyn Files {
        &*self.files
    }

    /// The real path of a file that may be read; `None` for a file outside.
    pub fn real(&self, path: &Path) -> Option<PathBuf> {
        self.allow.as_ref().map_or_else(|| Some(path.to_owned()), |allow| allow(path))
    }

    /// A file that may be read. It need not exist.
    pub(super) fn pass(&self, path: &Path) -> Result<FileHandle, Fault> {
        self.real(path).map(|real| FileHandle::new(self.files.clone(), real)).ok_or_else(outside)
    }

    /// A file of a set that may be read. It keeps its path, which has the number of its tile.
    pub(super) fn pass_in_set(&self, path: PathBuf) -> Result<FileHandle, Fault> {
        self.pass(&path)?;
        Ok(FileHandle::new(self.files.clone(), path))
    }

    /// True if a file exists and may be read.
    pub(super) fn has(&self, path: &Path) -> bool {
        self.pass(path).is_ok_and(|file| file.facts().is_ok_and(|facts| facts.is_file()))
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
