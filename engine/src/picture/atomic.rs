//! Files that appear under their name only when they are complete.
//!
//! What is written goes to `.NAME.PID.COUNTER.tmp` beside the target; [`AtomicFile::commit`] renames it. Whoever opens the
//! target sees the old content or the new one, and a program that dies leaves the old one. A file that is dropped without
//! commit is removed; what a killed process leaves behind is removed by [`remove_stale_temporaries`].

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file under construction.
///
/// It is not buffered. The data is handed to the system but not forced to the disk, so the promise holds for processes
/// that die, not for a machine that loses its power. A target that is a symbolic link is replaced, not followed.
#[derive(Debug)]
pub struct AtomicFile {
    /// Taken at commit, so that `drop` knows there is nothing left to remove.
    file: Option<File>,
    temporary: PathBuf,
    target: PathBuf,
}

impl AtomicFile {
    /// Starts a file that is to replace `target`.
    ///
    /// # Errors
    /// When the folder cannot be written, or when the target exists and is no regular file: a rename would destroy it.
    pub fn create(target: impl Into<PathBuf>) -> io::Result<Self> {
        let target = target.into();
        if let Ok(existing) = target.metadata()
            && !existing.is_file()
        {
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, "the name is taken by something that is no file"));
        }
        let name = target
            .file_name()
            .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"))?
            .to_os_string();
        for counter in 0_u32.. {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(&name);
            hidden.push(format!(".{}.{counter}.tmp", std::process::id()));
            let temporary = target.with_file_name(hidden);
            match OpenOptions::new().write(true).read(true).create_new(true).open(&temporary) {
                Ok(file) => return Ok(Self { file: Some(file), temporary, target }),
                // Another thread writes the same target, or an earlier process of this id died: take the next number.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, "no temporary name is free"))
    }

    /// The path that the file will have.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Gives the file these permissions.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn set_permissions(&mut self, permissions: std::fs::Permissions) -> io::Result<()> {
        self.file().set_permissions(permissions)
    }

    /// Gives the file its name, replacing what has it now.
    ///
    /// # Errors
    /// When the system refuses; then the target is as it was and the temporary file is removed.
    pub fn commit(mut self) -> io::Result<()> {
        self.file().flush()?;
        std::fs::rename(&self.temporary, &self.target)?;
        self.file = None;
        Ok(())
    }

    fn file(&mut self) -> &mut File {
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
        if self.file.take().is_some() {
            // Nothing can be done about a failure here; the next run tries again.
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// Removes the temporary files that processes which no longer run have left in a folder; returns how many.
///
/// Works where `/proc` lists the processes (Linux); elsewhere nothing is removed, since the owner may be alive. A folder
/// that several machines write at once must not be cleaned while they do: their processes are not listed here.
///
/// # Errors
/// When the folder cannot be read. A file that cannot be removed is left and not counted.
pub fn remove_stale_temporaries(folder: &Path) -> io::Result<usize> {
    let processes = Path::new("/proc");
    if !processes.join("self").exists() {
        return Ok(0);
    }
    let mut removed = 0;
    for entry in folder.read_dir()? {
        let entry = entry?;
        let name = entry.file_name();
        let Some(process) = name.to_str().and_then(owner) else { continue };
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && !processes.join(process.to_string()).exists() && std::fs::remove_file(entry.path()).is_ok() {
            removed += 1;
        }
    }
    Ok(removed)
}

/// The process id in a temporary file's name.
fn owner(name: &str) -> Option<u32> {
    let (rest, counter) = name.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once('.')?;
    let (target, process) = rest.rsplit_once('.')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    (!target.is_empty() && digits(counter) && digits(process)).then(|| process.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn dropped_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = AtomicFile::create(folder.path().join("a.png")).unwrap();
        let second = AtomicFile::create(folder.path().join("a.png")).unwrap();
        first.write_all(b"half").unwrap();
        let process = std::process::id();
        assert_eq!(names(folder.path()), [format!(".a.png.{process}.0.tmp"), format!(".a.png.{process}.1.tmp")]);
        drop((first, second));
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn refuses_what_is_no_file() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("a.png")).unwrap();
        assert!(AtomicFile::create(folder.path().join("a.png")).is_err());
        assert!(AtomicFile::create(folder.path().join("none/a.png")).is_err());
        assert!(AtomicFile::create("/").is_err());
        #[cfg(target_os = "linux")]
        assert!(AtomicFile::create("/dev/null").is_err());
    }

    #[test]
    fn owners_are_read_from_names() {
        assert_eq!(owner(".a.b.png.123.0.tmp"), Some(123));
        for name in [".a.png.x.0.tmp", "a.png.1.0.tmp", ".1.0.tmp", ".a.png.1..tmp", ".a.png.1.0.tmp~", ".a.+1.0.tmp"] {
            assert_eq!(owner(name), None, "{name}");
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn removes_what_the_dead_left() {
        let folder = tempfile::tempdir().unwrap();
        // Process ids are far below this number.
        for name in [".a.png.4294967295.0.tmp", ".a.png.1.0.tmp", "b.png", ".x.tmp"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(remove_stale_temporaries(folder.path()).unwrap(), 1);
        assert_eq!(names(folder.path()), [".a.png.1.0.tmp", ".x.tmp", "b.png"]);
    }
}
