//! `shibo.lock` of a folder, on disk.
use crate::graph_files::{read, text};
use crate::quit::Quit;
use shibo_bridge::lock::{Entry, LOCK, Lock, MOST_BYTES};
use shibo_bridge::write::{self, Refused};
use shibo_value::diagnostics::Code;
use std::path::{Path, PathBuf};

/// The lock of a folder.
pub(crate) struct LockFile {
    path: PathBuf,
    /// The text on disk, if there is a file.
    before: Option<String>,
    lock: Lock,
}

impl LockFile {
    /// Reads the lock beside a graph; an empty one if there is no file.
    pub(crate) fn beside(graph: &Path) -> Result<Self, Quit> {
        let path = graph.with_file_name(LOCK);
        let Ok(metadata) = std::fs::metadata(&path) else {
            return Ok(Self { path, before: None, lock: Lock::default() });
        };
        let wrong = |says: String| {
            let (shown, code) = (path.display(), Code::BadFile.as_str());
            Quit::failed(format!(
                "`{shown}` is no lock (`{code}`): {says}; `shibo pin` writes it anew if you remove it"
            ))
        };
        if metadata.len() > MOST_BYTES {
            return Err(wrong(format!("it has more than {MOST_BYTES} bytes")));
        }
        let before = text(&path, read(&path).map_err(Quit::failed)?)?;
        let lock = Lock::read(&before).map_err(wrong)?;
        Ok(Self { path, before: Some(before), lock })
    }

    /// The entry of a graph.
    pub(crate) fn entry(&self, graph: &Path) -> Option<&Entry> {
        self.lock.0.get(&name(graph))
    }

    /// Replaces or removes the entry of a graph.
    pub(crate) fn set(&mut self, graph: &Path, entry: Option<Entry>) {
        match entry {
            Some(entry) => self.lock.0.insert(name(graph), entry),
            None => self.lock.0.remove(&name(graph)),
        };
    }

    /// Writes the file, unless nothing changed. A lock that another program changed meanwhile is left alone.
    pub(crate) fn save(&self) -> Result<(), Quit> {
        let (shown, after) = (self.path.display(), self.lock.written());
        let written = match &self.before {
            Some(before) if *before == after => Ok(()),
            Some(before) => write::change(&self.path, before, &after),
            None if self.lock.0.is_empty() => Ok(()),
            None if self.path.exists() => Err(Refused::Changed),
            None => write::whole(&self.path, after.as_bytes()).map_err(Refused::Failed),
        };
        written.map_err(|refused| match refused {
            Refused::Changed => {
                Quit::failed(format!("`{shown}` was changed meanwhile, and left alone; pin the graphs again"))
            }
            Refused::Failed(error) => Quit::failed(format!("cannot write `{shown}`: {error}")),
        })
    }
}

/// The name of a graph in the lock of its folder.
fn name(graph: &Path) -> String {
    graph.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}
