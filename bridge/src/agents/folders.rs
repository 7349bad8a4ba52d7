//! The folders that an agent may read and write.
use super::Refusal;
use super::roots::{Roots, open_in};
use super::save::{MOST_TEXT, save};
use cap_std::fs::Dir;
use shibo_graph::Gate;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// The deepest folder that is listed.
const DEEPEST: usize = 8;
/// The most files that are listed.
const MOST_FILES: usize = 2000;

/// The folders that an agent may read and write.
#[derive(Clone, Debug, Default)]
pub struct Folders {
    read: Roots,
    write: Roots,
}

impl Folders {
    /// Opens folders for reading and for writing.
    ///
    /// # Errors
    /// A folder that cannot be opened.
    pub fn open(read: &[PathBuf], write: &[PathBuf]) -> Result<Self, String> {
        Ok(Self { read: Roots::of(read)?, write: Roots::of(write)? })
    }

    /// A gate for graphs: they may read files in the folders for reading.
    pub fn gate(&self) -> Gate {
        Gate::of(self.read.clone())
    }

    /// A file for reading: its name without links, and the opened file.
    ///
    /// # Errors
    /// A path outside, and a file that cannot be read or is too large.
    pub fn file(&self, path: &str, most: u64) -> Result<(PathBuf, File), Refusal> {
        let found = self.read.find(Path::new(path));
        let (root, inside) = found.ok_or_else(|| Refusal::outside(path))?;
        let real = root.resolve(&inside).ok_or_else(|| Refusal::outside(path))?;
        let failed = |error: std::io::Error| match error.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => {
                Refusal::new("file-not-found", format!("there is no file `{path}`"), "`list_graphs` names the graphs")
            }
            _ => Refusal::new("bad-file", format!("`{path}` cannot be read"), "give the path of a readable file"),
        };
        if !root.facts(&inside).map_err(failed)?.is_file() {
            let message = format!("`{path}` is not a regular file");
            return Err(Refusal::new("bad-file", message, "give the path of a file"));
        }
        let (file, facts) = root.open(&inside).map_err(failed)?;
        if facts.length > most {
            let message = format!("`{path}` is larger than {most} bytes");
            return Err(Refusal::new("too-large", message, "give a smaller file"));
        }
        Ok((real, file))
    }

    /// The text of a file: its name without links, and the text.
    ///
    /// # Errors
    /// Those of [`file`](Self::file), and a text that is not UTF-8.
    pub fn text(&self, path: &str) -> Result<(PathBuf, String), Refusal> {
        let (real, file) = self.file(path, MOST_TEXT)?;
        let unread = || Refusal::new("bad-file", format!("`{path}` is not UTF-8 text"), "give the path of a graph");
        Ok((real, text_of(file).ok_or_else(unread)?))
    }

    /// Visits the graph files in the folders for reading, at most 2000, with paths as an agent may give them, and texts. The visit
    /// ends once `each` returns false.
    pub fn graphs(&self, each: &mut dyn FnMut(String, String) -> bool) {
        let mut left = MOST_FILES;
        for root in self.read.iter() {
            if !visit(&root.dir, &root.name, 0, &mut left, each) {
                return;
            }
        }
    }

    /// Writes a text to a file in the folders for writing. Returns the text before, if there was a file.
    ///
    /// # Errors
    /// A path outside, a name that is no `*.ron`, a file that exists and has another hash than `expect`, and a file that cannot be
    /// written.
    pub fn write(&self, path: &str, text: &str, expect: Option<&str>) -> Result<Option<String>, Refusal> {
        if self.write.is_empty() {
            let message = "nothing may be written".to_owned();
            return Err(Refusal::new("outside", message, "the server was started without `--write FOLDER`"));
        }
        let outside = || Refusal::outside(path);
        let (root, inside) = self.write.find(Path::new(path)).ok_or_else(outside)?;
        let name = inside.file_name().filter(|_| !path.ends_with(['/', '.'])).ok_or_else(outside)?.to_owned();
        let hidden = name.to_string_lossy().starts_with('.');
        if hidden || inside.extension().is_none_or(|ending| ending != "ron") {
            let message = format!("`{path}` is not the name of a graph");
            return Err(Refusal::new("bad-name", message, "write a file whose name ends in `.ron`"));
        }
        let above = inside.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = root.dir.open_dir(above).map_err(|_| outside())?;
        save(&folder, Path::new(&name), path, text, expect, &mut || {})
    }
}

/// The text of a file, cut where it is longer than any graph.
fn text_of(file: File) -> Option<String> {
    let mut bytes = Vec::new();
    file.take(MOST_TEXT + 1).read_to_end(&mut bytes).ok()?;
    String::from_utf8(bytes).ok()
}

/// Visits the graph files of a folder and of the folders in it, in order. Links are not followed. Returns false once the visit ends.
fn visit(dir: &Dir, base: &Path, depth: usize, left: &mut usize, each: &mut dyn FnMut(String, String) -> bool) -> bool {
    let Ok(entries) = dir.entries() else { return true };
    let mut names: Vec<_> = entries.flatten().map(|entry| entry.file_name()).collect();
    names.sort();
    for name in names.into_iter().filter(|name| !name.to_string_lossy().starts_with('.')) {
        if *left == 0 {
            return false;
        }
        let Ok(metadata) = dir.symlink_metadata(&name) else { continue };
        let path = base.join(&name);
        if metadata.is_dir() && depth < DEEPEST {
            if let Ok(inner) = dir.open_dir(&name)
                && !visit(&inner, &path, depth + 1, left, each)
            {
                return false;
            }
        } else if metadata.is_file()
            && metadata.len() <= MOST_TEXT
            && path.extension().is_some_and(|ending| ending == "ron")
            && let Ok((file, _)) = open_in(dir, Path::new(&name))
            && let Some(text) = text_of(file)
        {
            *left -= 1;
            if !each(path.to_string_lossy().into_owned(), text) {
                return false;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::super::save::sha256;
    use super::*;
    use std::fs;

    /// A folder `data` with a graph and links, and a folder `data-2` beside it.
    fn desk() -> (tempfile::TempDir, Folders) {
        let desk = tempfile::tempdir().unwrap();
        let at = |path: &str| desk.path().join(path);
        fs::create_dir_all(at("data/deep")).unwrap();
        fs::create_dir(at("data-2")).unwrap();
        for file in ["data/a.ron", "data/deep/b.ron", "data-2/secret.ron", "secret.ron"] {
            fs::write(at(file), "(nodes: {})").unwrap();
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::symlink;
            symlink("../secret.ron", at("data/link.ron")).unwrap();
            symlink("../data-2", at("data/folder")).unwrap();
            symlink("a.ron", at("data/good.ron")).unwrap();
            symlink("../nothing.ron", at("data/dangling.ron")).unwrap();
        }
        let folders = Folders::open(&[at("data")], &[at("data")]).unwrap();
        (desk, folders)
    }

    #[test]
    fn reads_only_beneath_its_folders() {
        let (desk, folders) = desk();
        let whole = |path: &str| desk.path().join(path).to_string_lossy().into_owned();
        for good in ["a.ron".to_owned(), "deep/b.ron".to_owned(), "deep/../a.ron".to_owned(), whole("data/a.ron")] {
            assert!(folders.text(&good).is_ok(), "{good}");
        }
        let escapes = [
            "../secret.ron",
            "../data-2/secret.ron",
            "deep/../../secret.ron",
            "missing/../../secret.ron",
            "~/a.ron",
            "file:a.ron",
            "/etc/passwd",
        ];
        let mut escapes: Vec<String> = escapes.map(str::to_owned).to_vec();
        escapes.extend(["secret.ron", "data-2/secret.ron", "data-2/none.ron"].map(whole));
        if cfg!(unix) {
            escapes.extend(["link.ron", "folder/secret.ron", "dangling.ron"].map(str::to_owned));
            assert!(folders.text("good.ron").is_ok());
        }
        for bad in escapes {
            let refusal = folders.text(&bad).unwrap_err();
            assert_eq!((refusal.code.as_str(), refusal.message.contains(&bad)), ("outside", true), "{bad}");
        }
        assert_eq!(folders.text("none.ron").unwrap_err().code, "file-not-found");
        assert_eq!(folders.text("deep").unwrap_err().code, "bad-file");
        assert!(Folders::default().text("a.ron").is_err());
        let listed = |most: usize| {
            let mut paths = Vec::new();
            folders.graphs(&mut |path, _| {
                paths.push(path);
                paths.len() < most
            });
            paths
        };
        assert_eq!(listed(9), ["a.ron", "deep/b.ron"]);
        assert_eq!(listed(1), ["a.ron"], "the visit ends");
    }

    #[test]
    fn writes_only_what_it_knows() {
        let (desk, folders) = desk();
        let read = |path: &str| fs::read_to_string(desk.path().join(path)).unwrap();
        assert_eq!(folders.write("new.ron", "new", None), Ok(None));
        assert_eq!(folders.write("new.ron", "newer", None).unwrap_err().code, "changed");
        assert_eq!(folders.write("new.ron", "newer", Some(&sha256(b"old"))).unwrap_err().code, "changed");
        assert_eq!(folders.write("new.ron", "newer", Some(&sha256(b"new"))), Ok(Some("new".to_owned())));
        assert_eq!(read("data/new.ron"), "newer");
        assert_eq!(folders.write("absent.ron", "x", Some(&sha256(b"new"))).unwrap_err().code, "changed");
        for bad in ["../out.ron", "folder/out.ron", "link.ron", "dangling.ron", "../data-2/x.ron", "/tmp/x.ron", "deep"]
        {
            assert!(folders.write(bad, "x", None).is_err(), "{bad}");
        }
        for bad in ["a.sh", ".hidden.ron", "shibo.toml"] {
            assert_eq!(folders.write(bad, "x", None).unwrap_err().code, "bad-name", "{bad}");
        }
        assert_eq!(read("secret.ron"), "(nodes: {})");
        assert_eq!(fs::read_dir(desk.path().join("data-2")).unwrap().count(), 1);
        let names = fs::read_dir(desk.path().join("data")).unwrap();
        assert!(!names.flatten().any(|entry| entry.file_name().to_string_lossy().ends_with(".part")));
    }
}
