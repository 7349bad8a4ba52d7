//! The gate to files: decides which files a graph may read, for programs that load graphs of strangers.
use super::text_file::Fault;
use crate::diagnostics::Code;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Returns the real path of a file that may be read; `None` for a file outside, whether it exists or not. A file that does not
/// exist in a folder that may be read keeps its path.
type Allow = dyn Fn(&Path) -> Option<PathBuf> + Send + Sync;

/// Decides which files a graph may read. The default lets every file pass.
#[derive(Clone, Default)]
pub struct Gate(Option<Arc<Allow>>);

impl fmt::Debug for Gate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Gate(some)" } else { "Gate(all)" })
    }
}

impl Gate {
    /// A gate that asks `allow` for the real path of each file in a graph and in its imports. `None` refuses the file.
    pub fn new(allow: impl Fn(&Path) -> Option<PathBuf> + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(allow)))
    }

    /// The real path of a file that may be read; `None` for a file outside.
    pub fn real(&self, path: &Path) -> Option<PathBuf> {
        self.0.as_ref().map_or_else(|| Some(path.to_owned()), |allow| allow(path))
    }

    /// The real path of a file that may be read.
    pub(super) fn pass(&self, path: PathBuf) -> Result<PathBuf, Fault> {
        self.real(&path).ok_or_else(outside)
    }

    /// The path of a set of files, `<UDIM>` in its name. Only its folder is a file.
    pub(super) fn pass_set(&self, path: PathBuf) -> Result<PathBuf, Fault> {
        match (path.parent(), path.file_name()) {
            (Some(folder), Some(name)) => Ok(self.pass(folder.to_owned())?.join(name)),
            _ => self.pass(path),
        }
    }
}

/// The refusal of a file. It does not tell whether the file exists.
fn outside() -> Fault {
    Fault::new(Code::Outside, "this file is outside of the folders that may be read".to_owned())
}
