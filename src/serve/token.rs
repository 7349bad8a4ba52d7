//! The token in the address of the page. With a port that the user names, the token is kept for the next run, so that
//! open pages and bookmarks go on.
use crate::environment;
use crate::quit::Quit;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;

/// Length of a token in characters.
const LENGTH: usize = 32;

/// Returns the token for a port: that of the last run on this port, or a new one of 128 random bits. A port of 0 always
/// has a new token.
pub(super) fn token(port: u16) -> Result<String, Quit> {
    let folder = environment::runtime_dir().filter(|_| port != 0);
    kept(folder.as_deref(), port)
}

fn kept(folder: Option<&Path>, port: u16) -> Result<String, Quit> {
    let path = folder.map(|folder| folder.join(format!("token-{port}")));
    if let Some(known) = path.as_deref().and_then(read) {
        return Ok(known);
    }
    let made = random()?;
    if let (Some(folder), Some(path)) = (folder, path) {
        // Without the file, the next run has another address.
        let _ = write(folder, &path, &made);
    }
    Ok(made)
}

/// A new token.
pub(super) fn random() -> Result<String, Quit> {
    let mut bytes = [0_u8; LENGTH / 2];
    getrandom::fill(&mut bytes).map_err(|e| Quit::failed(format!("the system has no random numbers: {e}")))?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

/// Reads a token. A file that is not a plain one, or that others may read or write, does not count.
fn read(path: &Path) -> Option<String> {
    if !fs::symlink_metadata(path).ok()?.is_file() {
        return None;
    }
    let file = File::open(path).ok()?;
    if !is_private(&file) {
        return None;
    }
    let mut text = String::new();
    file.take(LENGTH as u64 + 1).read_to_string(&mut text).ok()?;
    let is_token = text.len() == LENGTH && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
    is_token.then_some(text)
}

#[cfg(unix)]
fn is_private(file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    file.metadata().is_ok_and(|metadata| metadata.mode() & 0o077 == 0)
}

#[cfg(not(unix))]
fn is_private(_file: &File) -> bool {
    true
}

fn write(folder: &Path, path: &Path, token: &str) -> std::io::Result<()> {
    let mut dirs = DirBuilder::new();
    dirs.recursive(true);
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    {
        std::os::unix::fs::DirBuilderExt::mode(&mut dirs, 0o700);
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    }
    dirs.create(folder)?;
    let _ = fs::remove_file(path);
    options.open(path)?.write_all(token.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_tokens_by_port() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("shibo");
        let of = |port| kept(Some(&folder), port).ok().unwrap();
        let first = of(7007);
        assert_eq!(first.len(), LENGTH);
        assert_eq!(of(7007), first);
        assert_ne!(of(7008), first);
        // A damaged file is replaced.
        let path = folder.join("token-7007");
        for text in ["", "short", &"x".repeat(LENGTH), &"a".repeat(LENGTH + 1)] {
            fs::write(&path, text).unwrap();
            let made = of(7007);
            assert!(made != first && made.len() == LENGTH && of(7007) == made);
        }
        let other = kept(None, 7007).ok().unwrap();
        assert_ne!(kept(None, 7007).ok().unwrap(), other);
    }

    #[cfg(unix)]
    #[test]
    fn refuses_files_that_others_can_read() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let first = kept(Some(dir.path()), 7007).ok().unwrap();
        let path = dir.path().join("token-7007");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        assert_ne!(kept(Some(dir.path()), 7007).ok().unwrap(), first);
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
