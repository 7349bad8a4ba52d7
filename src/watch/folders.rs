//! Hints that files may have changed. Watches folders instead of files, since an atomic save replaces the file, and
//! also the folders of symbolic link targets. Hints may be missing or wrong; the contents decide (see
//! [`super::files`]).
use super::signal::Signal;
use notify::event::{AccessKind, AccessMode, EventKind, ModifyKind};
use notify::{Event, RecommendedWatcher, RecursiveMode, Watcher};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::mpsc::Sender;

/// Maximum number of links followed.
const LINKS: usize = 16;

/// The watched folders.
pub(super) struct Folders {
    watcher: RecommendedWatcher,
    /// Watched paths, each with the identity of its folder when the watch began.
    watched: BTreeMap<PathBuf, [u64; 2]>,
}

impl Folders {
    /// Creates a watcher without folders; hints go to `signals`.
    ///
    /// # Errors
    /// Fails if the system cannot watch folders or has no resources left for it.
    pub(super) fn new(signals: Sender<Signal>) -> notify::Result<Self> {
        let watcher = notify::recommended_watcher(move |event: notify::Result<Event>| {
            // An error, such as lost events, is a hint too.
            let closed = match event.map(|event| event.kind) {
                Ok(EventKind::Access(AccessKind::Close(AccessMode::Write))) => true,
                Ok(EventKind::Access(_)) => return,
                Ok(EventKind::Modify(ModifyKind::Name(_))) => true,
                _ => false,
            };
            // The receiver lives until the program ends.
            let _ = signals.send(Signal::Touched { closed });
        })?;
        Ok(Self { watcher, watched: BTreeMap::new() })
    }

    /// Watches the folders of these files and no others. A folder that cannot be watched is covered by polling.
    ///
    /// # Errors
    /// Returns the error of the last folder that could not be watched.
    pub(super) fn keep<'a>(&mut self, files: impl Iterator<Item = &'a Path>) -> notify::Result<()> {
        let mut wanted: BTreeMap<PathBuf, [u64; 2]> = BTreeMap::new();
        for folder in files.flat_map(folders) {
            if let Some(identity) = identity(&folder) {
                wanted.insert(folder, identity);
            }
        }
        let gone: Vec<PathBuf> = self
            .watched
            .iter()
            .filter(|(path, id)| wanted.get(*path) != Some(*id))
            .map(|(path, _)| path.clone())
            .collect();
        for path in gone {
            // The watch of a removed folder is gone already.
            let _ = self.watcher.unwatch(&path);
            self.watched.remove(&path);
        }
        let mut result = Ok(());
        for (path, identity) in wanted {
            if self.watched.contains_key(&path) {
                continue;
            }
            match self.watcher.watch(&path, RecursiveMode::NonRecursive) {
                Ok(()) => {
                    self.watched.insert(path, identity);
                }
                Err(error) => result = Err(error),
            }
        }
        result
    }
}

#[cfg(unix)]
fn identity(path: &Path) -> Option<[u64; 2]> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).ok().filter(fs::Metadata::is_dir).map(|m| [m.dev(), m.ino()])
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<[u64; 2]> {
    path.is_dir().then_some([0; 2])
}

/// Folders in which a change can affect `path`: its own or the nearest existing one, and the folders of links on the
/// way.
fn folders(path: &Path) -> Vec<PathBuf> {
    let mut folders = Vec::new();
    let mut path = path.to_owned();
    for _ in 0..LINKS {
        let parent = match path.parent() {
            Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
            Some(parent) => parent,
            None => break,
        };
        let existing = parent.ancestors().find(|folder| folder.is_dir() || folder.as_os_str().is_empty());
        let existing = existing.filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        folders.push(existing.to_owned());
        // A folder on the way may be a link that is replaced.
        folders.extend(link_on_the_way(parent));
        let Ok(target) = fs::read_link(&path) else { break };
        path = parent.join(target);
    }
    folders
}

/// Folder that contains the last link in a path of folders.
fn link_on_the_way(folder: &Path) -> Option<PathBuf> {
    let link = folder.ancestors().find(|a| a.is_symlink() && a.components().next_back() != Some(Component::CurDir))?;
    link.parent().map(|p| if p.as_os_str().is_empty() { PathBuf::from(".") } else { p.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_folders_of_links_and_missing_files() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        assert_eq!(folders(&at("a.ron")), [dir.path()]);
        assert_eq!(folders(&at("no/such/folder/a.ron")), [dir.path()]);
        assert_eq!(folders(Path::new("a.ron")), [Path::new(".")]);
        #[cfg(unix)]
        {
            fs::create_dir(at("real")).unwrap();
            std::os::unix::fs::symlink("real/b.ron", at("link.ron")).unwrap();
            assert_eq!(folders(&at("link.ron")), [dir.path().to_owned(), at("real")]);
            std::os::unix::fs::symlink("real", at("current")).unwrap();
            assert_eq!(folders(&at("current/b.ron")), [at("current"), dir.path().to_owned()]);
            std::os::unix::fs::symlink("loop", at("loop")).unwrap();
            assert!(folders(&at("loop")).len() <= LINKS);
        }
    }
}
