//! Writes a text in an opened folder, whole and never over a text that another program saved meanwhile.
use super::Refusal;
use super::roots::open_in;
use cap_std::fs::{Dir, OpenOptions};
use sha2::{Digest, Sha256};
use shibo_value::clock::Stopwatch;
use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The largest text of a graph in bytes.
pub const MOST_TEXT: u64 = 1 << 20;
/// The longest wait for another program that has locked the file.
const PATIENCE: Duration = Duration::from_secs(1);

/// Writes a file. `meanwhile` is called after the hash was compared and the new text is on disk.
///
/// The file is locked, so two calls never replace it at once. Its text is compared again right before the new one takes its
/// place. A save between that comparison and the renaming is lost if the other program locks no files.
pub(super) fn save(
    folder: &Dir,
    name: &Path,
    path: &str,
    text: &str,
    expect: Option<&str>,
    meanwhile: &mut dyn FnMut(),
) -> Result<Option<String>, Refusal> {
    let failed = |error: std::io::Error| {
        Refusal::new("bad-file", format!("`{path}` cannot be written: {error}"), "check the folder and its free space")
    };
    let changed = |message: String, help: &'static str| Refusal::new("changed", message, help);
    let metadata = match folder.symlink_metadata(name) {
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => return Err(failed(error)),
        Ok(metadata) if !metadata.is_file() => return Err(Refusal::outside(path)),
        Ok(metadata) => Some(metadata),
    };
    let (metadata, expect) = match (metadata, expect) {
        (None, None) => return created(folder, name, text).map(|()| None).map_err(failed),
        (None, Some(_)) => {
            return Err(changed(format!("`{path}` does not exist"), "leave `expect` out for a new file"));
        }
        (Some(_), None) => {
            let help = "give the SHA-256 of the text that you replace as `expect`";
            return Err(changed(format!("`{path}` exists"), help));
        }
        (Some(metadata), Some(expect)) => (metadata, expect),
    };
    let _lock = locked(folder, name).map_err(failed)?;
    let other = || changed(format!("`{path}` has changed"), "read the file again, and merge your changes");
    let before = content(folder, name).map_err(failed)?;
    if !sha256(&before).eq_ignore_ascii_case(expect) {
        return Err(other());
    }
    // The file is whole at any time: the new text takes its place in one step.
    let part = PathBuf::from(format!(".{}.{}.part", name.to_string_lossy(), std::process::id()));
    let _ = folder.remove_file(&part);
    let replaced = created(folder, &part, text).map_err(failed).and_then(|()| {
        folder.set_permissions(&part, metadata.permissions()).map_err(failed)?;
        meanwhile();
        match content(folder, name) {
            Ok(now) if now == before => folder.rename(&part, folder, name).map_err(failed),
            _ => Err(other()),
        }
    });
    if replaced.is_err() {
        let _ = folder.remove_file(&part);
    }
    replaced.map(|()| Some(String::from_utf8_lossy(&before).into_owned()))
}

/// The SHA-256 of bytes, in lower-case hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Makes a new file. After a failure there is none: a part of a text is no graph.
fn created(folder: &Dir, name: &Path, text: &str) -> std::io::Result<()> {
    let mut file = folder.open_with(name, OpenOptions::new().write(true).create_new(true))?;
    let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
    if written.is_err() {
        let _ = folder.remove_file(name);
    }
    written
}

/// The bytes of a file, which are cut where they are longer than any graph.
fn content(folder: &Dir, name: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_in(folder, name)?.0.take(MOST_TEXT + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Locks a file against other programs that lock it; `None` where the system has no locks.
fn locked(folder: &Dir, name: &Path) -> std::io::Result<Option<File>> {
    if !cfg!(unix) {
        // On such a system a lock would also block reading by this program.
        return Ok(None);
    }
    let (file, _) = open_in(folder, name)?;
    let waited = Stopwatch::wall();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::WouldBlock) if waited.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(5))
            }
            Err(TryLockError::WouldBlock) => {
                return Err(std::io::Error::new(ErrorKind::ResourceBusy, "another program has locked it"));
            }
            // A file system without locks.
            Err(TryLockError::Error(_)) => return Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use cap_std::ambient_authority;
    use std::fs;

    fn folder(content: &str) -> (tempfile::TempDir, Dir, PathBuf) {
        let desk = tempfile::tempdir().unwrap();
        let path = desk.path().join("a.ron");
        fs::write(&path, content).unwrap();
        let dir = Dir::open_ambient_dir(desk.path(), ambient_authority()).unwrap();
        (desk, dir, path)
    }

    fn replace(dir: &Dir, before: &str, meanwhile: &mut dyn FnMut()) -> Result<Option<String>, Refusal> {
        save(dir, Path::new("a.ron"), "a.ron", "agent", Some(&sha256(before.as_bytes())), meanwhile)
    }

    #[test]
    fn keeps_a_save_between_the_hash_and_the_replacement() {
        let over = |path: &Path| fs::write(path, "editor").unwrap();
        let renamed = |path: &Path| {
            fs::write(path.with_extension("new"), "editor").unwrap();
            fs::rename(path.with_extension("new"), path).unwrap();
        };
        let ways: [&dyn Fn(&Path); 2] = [&over, &renamed];
        for way in ways {
            let (desk, dir, path) = folder("before");
            let refused = replace(&dir, "before", &mut || way(&path)).unwrap_err();
            assert_eq!((refused.code.as_str(), fs::read_to_string(&path).unwrap()), ("changed", "editor".to_owned()));
            assert_eq!(fs::read_dir(desk.path()).unwrap().count(), 1, "nothing is left behind");
        }
        let (_desk, dir, path) = folder("before");
        let refused = replace(&dir, "before", &mut || fs::remove_file(&path).unwrap()).unwrap_err();
        assert_eq!((refused.code.as_str(), path.exists()), ("changed", false));
    }

    #[test]
    fn one_of_several_calls_replaces_a_text() {
        let (_desk, dir, path) = folder("before");
        let made: usize = std::thread::scope(|scope| {
            let calls: Vec<_> = (0..8).map(|_| scope.spawn(|| replace(&dir, "before", &mut || {}).is_ok())).collect();
            calls.into_iter().map(|call| usize::from(call.join().unwrap())).sum()
        });
        assert_eq!((made, fs::read_to_string(&path).unwrap().as_str()), (1, "agent"));
    }

    #[test]
    #[cfg(unix)]
    fn waits_for_a_lock_and_keeps_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let (_desk, dir, path) = folder("before");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        let other = File::open(&path).unwrap();
        other.lock().unwrap();
        assert_eq!(replace(&dir, "before", &mut || {}).unwrap_err().code, "bad-file");
        drop(other);
        assert_eq!(replace(&dir, "before", &mut || {}), Ok(Some("before".to_owned())));
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }
}
