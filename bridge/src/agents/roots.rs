//! Opened folders. A file counts by its real location: it is found beneath an opened folder, and a link that leads out of that folder
//! is refused, even if another program puts it there between a check and the opening of the file.
//!
//! A file is named by its path relative to the first folder. Names of files in the second folder begin with `2:`, and so on.
//! Absolute paths of the machine reach neither graphs nor messages.
use cap_std::ambient_authority;
use cap_std::fs::{Dir, Metadata, OpenOptions};
use shibo_value::files::{Content, Facts, FileKind, Files};
use std::ffi::OsString;
use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// An opened folder.
pub(super) struct Root {
    /// The beginning of the names of its files: empty for the first folder.
    pub(super) name: PathBuf,
    /// The path as given, made absolute.
    given: PathBuf,
    /// The path without links.
    real: PathBuf,
    pub(super) dir: Dir,
}

/// Folders in an order.
#[derive(Clone, Default)]
pub(super) struct Roots(Arc<[Root]>);

impl fmt::Debug for Roots {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.0.iter().map(|root| &root.real)).finish()
    }
}

/// A path that the system takes for the folder itself if it is empty.
fn within(inside: &Path) -> &Path {
    if inside.as_os_str().is_empty() { Path::new(".") } else { inside }
}

impl Root {
    fn open_folder(index: usize, path: &Path) -> io::Result<Self> {
        let name = if index == 0 { PathBuf::new() } else { PathBuf::from(format!("{}:", index + 1)) };
        let given = std::path::absolute(path)?;
        let real = path.canonicalize()?;
        let dir = Dir::open_ambient_dir(&real, ambient_authority())?;
        Ok(Self { name, given, real, dir })
    }

    /// The name of a file in the folder.
    fn named(&self, inside: &Path) -> PathBuf {
        let parts = inside.components().filter(|part| !matches!(part, Component::CurDir));
        parts.fold(self.name.clone(), |name, part| name.join(part))
    }

    /// The name of a file without links; `None` if it is outside. A file that does not exist keeps its path.
    pub(super) fn resolve(&self, inside: &Path) -> Option<PathBuf> {
        match self.dir.canonicalize(within(inside)) {
            Ok(real) => Some(self.named(&real)),
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                // A dangling link may point anywhere.
                let dangling = self.dir.symlink_metadata(inside).is_ok();
                let plain = inside.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
                (plain && !dangling).then(|| self.named(inside))
            }
            Err(_) => None,
        }
    }

    /// The facts of a file.
    pub(super) fn facts(&self, inside: &Path) -> io::Result<Facts> {
        self.dir.metadata(within(inside)).map(|metadata| facts(&metadata))
    }

    /// Opens a regular file; also returns its facts.
    pub(super) fn open(&self, inside: &Path) -> io::Result<(File, Facts)> {
        open_in(&self.dir, inside)
    }
}

/// Opens a regular file in a folder; also returns its facts.
pub(super) fn open_in(dir: &Dir, path: &Path) -> io::Result<(File, Facts)> {
    let mut options = OpenOptions::new();
    options.read(true);
    // Another program may put a pipe in the place of the file. The opening must not wait for a writer.
    #[cfg(unix)]
    cap_std::fs::OpenOptionsExt::custom_flags(&mut options, rustix::fs::OFlags::NONBLOCK.bits().cast_signed());
    let file = dir.open_with(path, &options)?.into_std();
    let facts = Facts::of(&file.metadata()?);
    if facts.is_file() { Ok((file, facts)) } else { Err(io::Error::other("it is not a regular file")) }
}

fn facts(metadata: &Metadata) -> Facts {
    let ty = metadata.file_type();
    let kind = match () {
        () if ty.is_file() => FileKind::Regular,
        () if ty.is_dir() => FileKind::Folder,
        () => FileKind::Other("something else than a file"),
    };
    let modified = metadata.modified().ok().map(|time| time.into_std());
    let (changed, identity) = unix(metadata);
    Facts::new((kind, metadata.len()), modified, changed, identity)
}

#[cfg(unix)]
fn unix(metadata: &Metadata) -> (Option<std::time::SystemTime>, [u64; 2]) {
    use cap_std::fs::MetadataExt;
    use std::time::{Duration, SystemTime};
    let seconds = u64::try_from(metadata.ctime()).ok();
    let nanos = u64::try_from(metadata.ctime_nsec()).unwrap_or(0);
    let changed = seconds.map(|s| SystemTime::UNIX_EPOCH + Duration::from_secs(s) + Duration::from_nanos(nanos));
    (changed, [metadata.dev(), metadata.ino()])
}

#[cfg(not(unix))]
fn unix(_metadata: &Metadata) -> (Option<std::time::SystemTime>, [u64; 2]) {
    (None, [0; 2])
}

impl Roots {
    /// Opens folders.
    pub(super) fn of(paths: &[PathBuf]) -> Result<Self, String> {
        let open = |(index, path): (usize, &PathBuf)| {
            let failed = |error: io::Error| format!("the folder `{}` cannot be opened: {error}", path.display());
            Root::open_folder(index, path).map_err(failed)
        };
        paths.iter().enumerate().map(open).collect::<Result<Vec<_>, _>>().map(|roots| Self(roots.into()))
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Root> {
        self.0.iter()
    }

    /// The folder of a path, and the path within it. A relative path is one in the first folder, unless it begins with the name of
    /// another one.
    pub(super) fn find(&self, path: &Path) -> Option<(&Root, PathBuf)> {
        let odd = |part: Component<'_>| {
            let part = part.as_os_str().to_string_lossy();
            part.starts_with('~') || part.to_ascii_lowercase().starts_with("file:") || part.contains('\0')
        };
        if path.components().any(odd) {
            return None;
        }
        let found = |root| {
            let Root { name, given, real, .. }: &Root = root;
            let inside = if path.is_relative() {
                path.strip_prefix(name)
            } else {
                path.strip_prefix(real).or_else(|_| path.strip_prefix(given))
            };
            Some((root, inside.ok()?.to_owned()))
        };
        // The first folder has the relative paths that no other one has, and so comes last.
        if path.is_relative() { self.0.iter().rev().find_map(found) } else { self.0.iter().find_map(found) }
    }

    fn located(&self, path: &Path) -> io::Result<(&Root, PathBuf)> {
        self.find(path).ok_or_else(|| ErrorKind::PermissionDenied.into())
    }
}

impl Files for Roots {
    fn facts(&self, path: &Path) -> io::Result<Facts> {
        let (root, inside) = self.located(path)?;
        root.facts(&inside)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Content>> {
        let (root, inside) = self.located(path)?;
        root.open(&inside).map(|(file, _)| Box::new(file) as Box<dyn Content>)
    }

    fn identity(&self, path: &Path) -> PathBuf {
        self.real(path).unwrap_or_else(|| path.to_owned())
    }

    fn names(&self, folder: &Path) -> io::Result<Vec<OsString>> {
        let (root, inside) = self.located(folder)?;
        Ok(root.dir.read_dir(within(&inside))?.flatten().map(|entry| entry.file_name()).collect())
    }

    fn real(&self, path: &Path) -> Option<PathBuf> {
        let (root, inside) = self.find(path)?;
        root.resolve(&inside)
    }

    fn above(&self, folder: &Path) -> Vec<PathBuf> {
        let Some((root, inside)) = self.find(folder) else { return Vec::new() };
        inside.ancestors().skip(1).map(|above| root.named(above)).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use std::fs;

    /// Two folders, each with a graph.
    fn desk() -> (tempfile::TempDir, Roots) {
        let desk = tempfile::tempdir().unwrap();
        let at = |path: &str| desk.path().join(path);
        fs::create_dir_all(at("one/deep")).unwrap();
        fs::create_dir(at("two")).unwrap();
        for file in ["one/a.ron", "one/deep/b.ron", "two/a.ron", "secret.ron"] {
            fs::write(at(file), file).unwrap();
        }
        let roots = Roots::of(&[at("one"), at("two")]).unwrap();
        (desk, roots)
    }

    fn text(roots: &Roots, path: &str) -> io::Result<String> {
        let mut text = String::new();
        io::Read::read_to_string(&mut roots.open(Path::new(path))?, &mut text)?;
        Ok(text)
    }

    #[test]
    fn files_have_names_without_the_path_of_their_folder() {
        let (desk, roots) = desk();
        let real = |path: &str| roots.real(Path::new(path)).map(|path| path.to_str().unwrap().to_owned());
        for (path, name) in [
            ("a.ron", "a.ron"),
            ("./deep/../a.ron", "a.ron"),
            ("2:/a.ron", "2:/a.ron"),
            ("none.ron", "none.ron"),
            ("2:/none.ron", "2:/none.ron"),
            ("3:/a.ron", "3:/a.ron"),
        ] {
            assert_eq!(real(path).as_deref(), Some(name), "{path}");
        }
        let whole = |path: &str| real(desk.path().join(path).to_str().unwrap());
        assert_eq!(whole("one/deep/b.ron").as_deref(), Some("deep/b.ron"));
        assert_eq!(whole("two/a.ron").as_deref(), Some("2:/a.ron"));
        for outside in ["../two/a.ron", "2:/../one/a.ron", "2:/../../secret.ron"] {
            assert_eq!(real(outside), None, "{outside}");
            assert!(text(&roots, outside).is_err(), "{outside}");
        }
        assert_eq!(whole("secret.ron"), None);
        assert_eq!(text(&roots, "2:/a.ron").unwrap(), "two/a.ron");
        assert_eq!(roots.above(Path::new("deep")), [Path::new("")]);
        assert_eq!(roots.above(Path::new("2:/x/y")), [Path::new("2:/x"), Path::new("2:")]);
        let mut names = roots.names(Path::new("")).unwrap();
        names.sort();
        assert_eq!(names, ["a.ron", "deep"]);
    }

    #[test]
    fn facts_are_those_of_the_machine() {
        let (desk, roots) = desk();
        let facts = |path: &str| roots.facts(Path::new(path)).unwrap();
        let file = Facts::of(&fs::metadata(desk.path().join("one/a.ron")).unwrap());
        assert_eq!(facts("a.ron"), file);
        assert_eq!(facts("deep").kind, FileKind::Folder);
        assert_eq!(facts("").kind, FileKind::Folder);
        assert!(roots.open(Path::new("deep")).is_err());
    }

    /// Another program exchanges a file after it was checked.
    #[test]
    #[cfg(unix)]
    fn a_file_that_is_exchanged_leads_nowhere() {
        let (desk, roots) = desk();
        let gate = shibo_graph::Gate::of(roots.clone());
        let path = desk.path().join("one/a.ron");
        let exchanges: [&dyn Fn(); 3] = [
            &|| std::os::unix::fs::symlink("../secret.ron", &path).unwrap(),
            &|| std::os::unix::fs::symlink(desk.path().join("secret.ron"), &path).unwrap(),
            &|| assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success()),
        ];
        for exchange in exchanges {
            let file = gate.file(Path::new("a.ron")).unwrap();
            assert!(file.facts().unwrap().is_file());
            fs::remove_file(&path).unwrap();
            exchange();
            assert!(file.bytes(100).is_err());
            // The last moment is that between the facts and the opening.
            assert!(roots.open(Path::new("a.ron")).is_err());
            fs::remove_file(&path).unwrap();
            fs::write(&path, "one/a.ron").unwrap();
        }
        let file = gate.file(Path::new("deep/b.ron")).unwrap();
        fs::rename(desk.path().join("one/deep"), desk.path().join("one/other")).unwrap();
        fs::create_dir(desk.path().join("out")).unwrap();
        fs::write(desk.path().join("out/b.ron"), "secret").unwrap();
        std::os::unix::fs::symlink("../out", desk.path().join("one/deep")).unwrap();
        assert!(file.bytes(100).is_err());
        assert!(gate.file(Path::new("deep/b.ron")).is_none());
    }
}
