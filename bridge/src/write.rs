//! Writes files completely or not at all, and never over a text that another program saved at the same time.
use shibo_picture::AtomicFile;
use shibo_value::clock::Stopwatch;
use std::fs::{self, File};
use std::io::{self, Read, Seek, Write};
use std::path::Path;
use std::time::Duration;

/// Maximum wait for a lock on the file held by another program.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time in which a program that opened the file before the exchange can still write into it.
const LINGER: Duration = Duration::from_millis(10);
/// Maximum number of saves by other programs while a file is put back.
const TURNS: usize = 100;

/// Writes a whole file. After a failure the old content remains.
pub fn whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(content)?;
    file.commit()
}

/// Like [`whole`], and creates missing parent folders.
pub fn whole_with_folders(path: &Path, content: &[u8]) -> io::Result<()> {
    path.parent().map_or(Ok(()), fs::create_dir_all)?;
    whole(path, content)
}

/// Reason why a file was not changed.
#[derive(Debug)]
pub enum Refused {
    /// The file has another content than the change is based on, because another program has saved it.
    Changed,
    /// A system error.
    Failed(io::Error),
}

impl From<io::Error> for Refused {
    fn from(error: io::Error) -> Self {
        Self::Failed(error)
    }
}

/// Changes the content of a user's file from `before` to `after`; follows symbolic links and keeps permissions. A file
/// with another content is left alone.
///
/// Where the system supports it, the new and the old file are exchanged in one step and the old content is compared
/// afterwards. A text that another program saves at any moment is either taken out and put back, or is written later
/// and stays.
pub fn change(path: &Path, before: &str, after: &str) -> Result<(), Refused> {
    changed(path, (before.as_bytes(), after.as_bytes()), AtomicFile::exchange, &mut |_| {})
}

/// Moments during a change at which another program may save.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Moment {
    /// After the comparison, before the exchange.
    Compared,
    /// After the exchange.
    Exchanged,
    /// Before the other program's content is put back.
    Returning,
}

/// Swaps a temporary file and its target.
type Exchange = fn(&mut AtomicFile) -> io::Result<()>;

fn changed(
    path: &Path,
    (before, after): (&[u8], &[u8]),
    exchange: Exchange,
    meanwhile: &mut dyn FnMut(Moment),
) -> Result<(), Refused> {
    let path = path.canonicalize()?;
    let mut old = File::open(&path)?;
    let permissions = old.metadata()?.permissions();
    let mut new = AtomicFile::create(&path)?;
    new.write_all(after)?;
    new.set_permissions(permissions)?;
    let _lock = lock(&old)?;
    if fs::read(&path)? != before {
        return Err(Refused::Changed);
    }
    meanwhile(Moment::Compared);
    if exchange(&mut new).is_err() {
        // The file system cannot exchange files: a save between the comparison and the renaming is lost.
        return if fs::read(&path)? == before { Ok(new.commit()?) } else { Err(Refused::Changed) };
    }
    meanwhile(Moment::Exchanged);
    let taken = fs::read(new.temporary())?;
    if taken != before {
        put_back(&mut new, (&path, after), taken, exchange, meanwhile)?;
        return Err(Refused::Changed);
    }
    // A program that opened the old file earlier still writes into it under its new name.
    std::thread::sleep(LINGER);
    let mut late = Vec::new();
    old.rewind().and_then(|()| old.read_to_end(&mut late))?;
    if late != before {
        put_back(&mut new, (&path, after), late, exchange, meanwhile)?;
        return Err(Refused::Changed);
    }
    Ok(())
}

/// Puts back `theirs`, saved by another program. A text saved meanwhile is newer, and is put back in turn.
fn put_back(
    file: &mut AtomicFile,
    (path, ours): (&Path, &[u8]),
    theirs: Vec<u8>,
    exchange: Exchange,
    meanwhile: &mut dyn FnMut(Moment),
) -> io::Result<()> {
    let (mut here, mut away) = (ours.to_vec(), theirs);
    for _ in 0..TURNS {
        meanwhile(Moment::Returning);
        exchange(file)?;
        let taken = fs::read(file.temporary())?;
        if taken == here {
            return Ok(());
        }
        // A newer content is there; the one just put back is older.
        (here, away) = (away, taken);
    }
    // So many saves are not realistic. The newest content is written over the older one.
    whole(path, &away)
}

/// Locks a file against other runs of this program; `None` where the system has no locks.
fn lock(file: &File) -> io::Result<Option<File>> {
    if !cfg!(unix) {
        // On such a system a lock would also block reading by this program.
        return Ok(None);
    }
    let Ok(file) = file.try_clone() else { return Ok(None) };
    let clock = Stopwatch::wall();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(fs::TryLockError::WouldBlock) if clock.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(5))
            }
            Err(fs::TryLockError::WouldBlock) => {
                return Err(io::Error::new(io::ErrorKind::ResourceBusy, "another program has locked it"));
            }
            // A file system without locks.
            Err(fs::TryLockError::Error(_)) => return Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    /// An exchange on a system that does not support it.
    fn unable(_: &mut AtomicFile) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }

    fn file(content: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ron");
        fs::write(&path, content).unwrap();
        (folder, path)
    }

    /// Changes a file from `before` to `after` while `saves` happen; returns its content, and true if the change was
    /// made.
    fn during(exchange: Exchange, saves: &mut dyn FnMut(Moment, &Path)) -> (String, bool) {
        let (folder, path) = file("before");
        let made = changed(&path, (b"before", b"after"), exchange, &mut |moment| saves(moment, &path));
        assert!(matches!(made, Ok(()) | Err(Refused::Changed)), "{made:?}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left behind");
        (fs::read_to_string(&path).unwrap(), made.is_ok())
    }

    /// Ways in which editors save: over the file, or to a new file that is renamed.
    const WAYS: [fn(&Path, &str); 2] = [
        |path, text| fs::write(path, text).unwrap(),
        |path, text| {
            fs::write(path.with_extension("new"), text).unwrap();
            fs::rename(path.with_extension("new"), path).unwrap();
        },
    ];

    #[test]
    fn changes_file_without_other_saves() {
        for exchange in [AtomicFile::exchange as Exchange, unable] {
            assert_eq!(during(exchange, &mut |_, _| {}), ("after".to_owned(), true));
        }
        let (_folder, path) = file("other");
        assert!(matches!(change(&path, "before", "after"), Err(Refused::Changed)));
        assert_eq!(fs::read_to_string(&path).unwrap(), "other");
        assert!(matches!(change(&path.with_extension("none"), "", "after"), Err(Refused::Failed(_))));
    }

    #[test]
    fn keeps_a_save_between_check_and_exchange() {
        for save in WAYS {
            for exchange in [AtomicFile::exchange as Exchange, unable] {
                let saved = during(exchange, &mut |moment, path| {
                    if moment == Moment::Compared {
                        save(path, "editor");
                    }
                });
                assert_eq!(saved, ("editor".to_owned(), false));
            }
        }
    }

    #[test]
    #[cfg(any(target_os = "linux", target_vendor = "apple"))]
    fn keeps_the_newest_of_several_saves() {
        for save in WAYS {
            let mut number = 0;
            let saved = during(AtomicFile::exchange, &mut |moment, path| {
                if moment == Moment::Compared || (moment == Moment::Returning && number < 5) {
                    number += 1;
                    save(path, &format!("editor {number}"));
                }
            });
            assert_eq!(saved, ("editor 5".to_owned(), false));
        }
    }

    #[test]
    #[cfg(any(target_os = "linux", target_vendor = "apple"))]
    fn keeps_a_save_into_the_file_that_was_open_before() {
        let (_folder, path) = file("before");
        // An editor has opened the file, and writes after the file was renamed.
        let mut open = Some(fs::OpenOptions::new().write(true).open(&path).unwrap());
        let made = changed(&path, (b"before", b"after"), AtomicFile::exchange, &mut |moment| {
            if moment == Moment::Exchanged {
                open.take().unwrap().write_all(b"editor").unwrap();
            }
        });
        assert!(matches!(made, Err(Refused::Changed)), "{made:?}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "editor");
    }

    #[test]
    #[cfg(any(target_os = "linux", target_vendor = "apple"))]
    fn a_save_after_the_exchange_stays() {
        for save in WAYS {
            let saved = during(AtomicFile::exchange, &mut |moment, path| {
                if moment == Moment::Exchanged {
                    save(path, "editor");
                }
            });
            assert_eq!(saved, ("editor".to_owned(), true));
        }
    }

    #[test]
    #[cfg(unix)]
    fn waits_for_a_lock_and_then_gives_up() {
        let (_folder, path) = file("before");
        let other = File::open(&path).unwrap();
        other.lock().unwrap();
        let refused = change(&path, "before", "after");
        assert!(matches!(refused, Err(Refused::Failed(error)) if error.kind() == io::ErrorKind::ResourceBusy));
        assert_eq!(fs::read_to_string(&path).unwrap(), "before");
        drop(other);
        change(&path, "before", "after").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "after");
    }

    #[test]
    #[cfg(unix)]
    fn keeps_permissions_and_follows_links_to_the_file() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let (folder, path) = file("before");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        let link = folder.path().join("link.ron");
        symlink(&path, &link).unwrap();
        change(&link, "before", "after").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&path).unwrap(), "after");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }
}
