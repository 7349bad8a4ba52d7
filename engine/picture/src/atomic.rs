//! Atomic files: a file appears under its name only when it is complete.
//!
//! A file is written next to its target, under a hidden name that identifies the writing process;
//! [`AtomicFile::commit`] renames it. A program that opens the target sees either the old content or the new one. If
//! the writer dies, the old content stays. Dropping a file without a commit removes it; [`remove_stale_temporaries`]
//! removes files of killed processes.
//!
//! WebAssembly has no disk: there, files are in memory until [`taken_files`] takes them.
mod memory;
mod owner;

pub use memory::taken_files;

use memory::Content;
use owner::Owner;
use std::fs::OpenOptions;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A temporary file that was written to within this time may still be in use.
const STALE: Duration = Duration::from_secs(24 * 3600);

/// A file under construction.
///
/// It is not buffered. The data is handed to the system but not forced to the disk: the guarantee covers killed
/// processes, not power loss. A target that is a symbolic link is replaced, not followed.
#[derive(Debug)]
pub struct AtomicFile {
    /// `None` after the commit, so that `drop` has nothing to remove.
    file: Option<Content>,
    temporary: PathBuf,
    target: PathBuf,
}

impl AtomicFile {
    /// Starts a file that is to replace `target`.
    ///
    /// # Errors
    /// When the folder cannot be written, or when the target exists and is not a regular file: a rename would destroy
    /// it.
    pub fn create(target: impl Into<PathBuf>) -> io::Result<Self> {
        let target = target.into();
        if cfg!(target_family = "wasm") {
            return Ok(Self::in_memory(target));
        }
        if let Ok(existing) = target.metadata()
            && !existing.is_file()
        {
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, "the name is taken by something that is no file"));
        }
        let name =
            target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"))?;
        for counter in 0_u32.. {
            let temporary = target.with_file_name(Owner::this().name(&name.to_string_lossy(), counter));
            match OpenOptions::new().write(true).read(true).create_new(true).open(&temporary) {
                Ok(file) => return Ok(Self { file: Some(Content::Disk(file)), temporary, target }),
                // Another thread writes the same target: take the next number.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, "no temporary name is free"))
    }

    /// Starts a file in memory. [`taken_files`] takes it after the commit.
    pub(super) fn in_memory(target: impl Into<PathBuf>) -> Self {
        let target = target.into();
        Self { file: Some(Content::default()), temporary: target.clone(), target }
    }

    /// The content of a file in memory; that of a file on disk is empty. The file is not committed.
    pub(super) fn into_bytes(mut self) -> Vec<u8> {
        self.file.take().map_or_else(Vec::new, Content::into_bytes)
    }

    /// The path that the file will have.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The path that the file has until it is complete.
    #[must_use]
    pub fn temporary(&self) -> &Path {
        &self.temporary
    }

    /// Gives the file these permissions.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn set_permissions(&mut self, permissions: std::fs::Permissions) -> io::Result<()> {
        match self.file() {
            Content::Disk(file) => file.set_permissions(permissions),
            Content::Memory(_) => Ok(()),
        }
    }

    /// Gives the file its name, replacing any existing file.
    ///
    /// # Errors
    /// When the system refuses. Then the target is unchanged and the temporary file is removed.
    pub fn commit(mut self) -> io::Result<()> {
        self.file().flush()?;
        match self.file.take() {
            Some(Content::Memory(bytes)) => memory::put(&self.target, bytes.into_inner()),
            // A refused renaming leaves the file to `drop`, which removes it.
            on_disk => {
                self.file = on_disk;
                std::fs::rename(&self.temporary, &self.target)?;
                self.file = None;
            }
        }
        Ok(())
    }

    /// Swaps the two files atomically. The temporary file then has the old content of the target, which can be read and
    /// swapped back. Dropping `self` removes the temporary file.
    ///
    /// # Errors
    /// When the system or the file system cannot swap, or the target is missing. Then both files are unchanged.
    pub fn exchange(&mut self) -> io::Result<()> {
        self.file().flush()?;
        exchange(&self.temporary, &self.target)
    }

    fn file(&mut self) -> &mut Content {
        self.file.as_mut().expect("the file is taken by commit only, which consumes it")
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

impl Read for AtomicFile {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.file().read(bytes)
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.file().seek(position)
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if let Some(Content::Disk(_)) = self.file.take() {
            // A failure here is ignored; the next run tries again.
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchange(_one: &Path, _other: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Removes a file from the disk, or from memory where there is no disk.
///
/// # Errors
/// When the file does not exist, or the system refuses.
pub(super) fn remove(path: &Path) -> io::Result<()> {
    if cfg!(target_family = "wasm") { memory::remove(path) } else { std::fs::remove_file(path) }
}

/// Removes abandoned temporary files from a folder; returns their number. A file is abandoned if it was not written to
/// for 24 hours and its process does not run on this machine. Links are not removed.
///
/// # Errors
/// When the folder cannot be read. A file that cannot be removed is not counted.
pub fn remove_stale_temporaries(folder: &Path) -> io::Result<usize> {
    let mut removed = 0;
    for entry in folder.read_dir()? {
        let entry = entry?;
        let Some(owner) = entry.file_name().to_str().and_then(Owner::of) else { continue };
        // Metadata of the entry itself, not of the target of a link.
        let file = entry.metadata().ok().filter(std::fs::Metadata::is_file);
        let age = file.and_then(|file| file.modified().ok()?.elapsed().ok());
        if age.is_some_and(|age| age > STALE) && !owner.may_run() && std::fs::remove_file(entry.path()).is_ok() {
            removed += 1;
        }
    }
    Ok(removed)
}

/// Returns true if a file of this name is a temporary file of this program.
pub fn is_temporary(name: &str) -> bool {
    Owner::of(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            folder.read_dir().unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn appears_at_commit_and_replaces() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.png");
        std::fs::write(&target, "old").unwrap();
        let mut file = AtomicFile::create(&target).unwrap();
        file.write_all(b"new").unwrap();
        assert_eq!(std::fs::read(&target).unwrap(), b"old");
        file.commit().unwrap();
        assert_eq!(std::fs::read(&target).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn removes_the_file_on_drop() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = AtomicFile::create(folder.path().join("a.png")).unwrap();
        let second = AtomicFile::create(folder.path().join("a.png")).unwrap();
        first.write_all(b"half").unwrap();
        let own = |counter| Owner::this().name("a.png", counter);
        assert_eq!(names(folder.path()), [own(0), own(1)]);
        assert!(is_temporary(&own(0)) && !is_temporary("a.png"));
        drop((first, second));
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn refuses_targets_that_are_not_files() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("a.png")).unwrap();
        assert!(AtomicFile::create(folder.path().join("a.png")).is_err());
        assert!(AtomicFile::create(folder.path().join("none/a.png")).is_err());
        assert!(AtomicFile::create("/").is_err());
        #[cfg(target_os = "linux")]
        assert!(AtomicFile::create("/dev/null").is_err());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn removes_stale_files_of_other_hosts_and_dead_processes() {
        let folder = tempfile::tempdir().unwrap();
        let this = Owner::this().name("a.png", 0);
        let (start, end) = this.split_once("shibo-").unwrap();
        let parts: Vec<&str> = end.split('-').collect();
        let of = |host: &str, boot: &str, process: &str, start_time: &str, counter: u32| {
            format!("{start}shibo-{host}-{boot}-{process}-{start_time}-{counter}.tmp")
        };
        let [host, boot, process, time] = [parts[0], parts[1], parts[2], parts[3]];
        // Real process ids are far below this number.
        let dead = of(host, boot, "4294967295", "1", 1);
        let reused = of(host, boot, "1", "0", 2);
        let elsewhere = of("0badcafe", boot, process, time, 3);
        let before = of(host, "0badcafe", process, time, 4);
        let live = of(host, boot, process, time, 5);
        let all = [&dead, &reused, &elsewhere, &before, &live, "b.png", ".x.tmp", ".a.png.4294967295.0.tmp"];
        let make = |hours: u64| {
            for name in all {
                let file = File::create(folder.path().join(name)).unwrap();
                file.set_modified(std::time::SystemTime::now() - Duration::from_secs(hours * 3600)).unwrap();
            }
        };
        make(23);
        assert_eq!(remove_stale_temporaries(folder.path()).unwrap(), 0, "all of them are young");
        make(25);
        // A link with such a name points to a file of the user.
        let link = of(host, boot, "4294967295", "1", 6);
        std::os::unix::fs::symlink(folder.path().join("b.png"), folder.path().join(&link)).unwrap();
        assert_eq!(remove_stale_temporaries(folder.path()).unwrap(), 4);
        let mut left = vec![live, link, "b.png".into(), ".x.tmp".into(), ".a.png.4294967295.0.tmp".into()];
        left.sort();
        assert_eq!(names(folder.path()), left);
    }
}
