//! Files as they are on disk or in a revision of a repository.
use crate::graph_files::{read, text};
use crate::quit::Quit;
use shibo_bridge::GraphText;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A file of a version, and its name for people.
pub(crate) struct Version {
    pub(crate) name: String,
    pub(crate) graph: GraphText,
}

/// Reads a file, or `REV:path`.
///
/// # Errors
/// [`Quit::Usage`] if there is no such file, or if it is no text.
pub(crate) fn version(given: &Path) -> Result<Version, Quit> {
    let unreadable = |quit: Quit| Quit::Usage(quit.text());
    let name = given.display().to_string();
    if !given.exists()
        && let Some((revision, path)) = name.split_once(':')
        && !revision.is_empty()
        && !path.is_empty()
    {
        let repository = Repository::here()?;
        let text = repository.text(revision, path).map_err(unreadable)?;
        let path = repository.path(path.strip_prefix("./").unwrap_or(path));
        return Ok(Version { name, graph: GraphText { path, text } });
    }
    let text = text(given, read(given).map_err(Quit::Usage)?).map_err(unreadable)?;
    Ok(Version { name, graph: GraphText { path: given.to_owned(), text } })
}

/// The repository of the working folder.
pub(crate) struct Repository {
    /// The folder of its files; empty for a bare repository.
    root: PathBuf,
}

/// A file that differs from a revision, by its path below the root.
pub(crate) struct Changed {
    /// The path in the revision, if it has the file.
    pub(crate) before: Option<String>,
    /// The path now, if the file is there.
    pub(crate) after: Option<String>,
}

impl Repository {
    /// Finds the repository.
    pub(crate) fn here() -> Result<Self, Quit> {
        let bare = git(["rev-parse", "--is-bare-repository"])?;
        let root = if line(&bare) == "true" { String::new() } else { line(&git(["rev-parse", "--show-toplevel"])?) };
        Ok(Self { root: root.into() })
    }

    /// Returns true if the repository has no files of its own.
    pub(crate) fn is_bare(&self) -> bool {
        self.root.as_os_str().is_empty()
    }

    /// The place of a file on disk.
    pub(crate) fn path(&self, inside: &str) -> PathBuf {
        self.root.join(inside)
    }

    /// A path below the root, as the repository names it; other paths stay as they are.
    pub(crate) fn inside(&self, path: &Path) -> PathBuf {
        let root = self.root.canonicalize().unwrap_or_else(|_| self.root.clone());
        path.strip_prefix(root).unwrap_or(path).to_owned()
    }

    /// The text of a file in a revision.
    pub(crate) fn text(&self, revision: &str, path: &str) -> Result<String, Quit> {
        let bytes = git(["cat-file", "blob", &format!("{revision}:{path}")])?;
        text(Path::new(&format!("{revision}:{path}")), bytes)
    }

    /// The graph files that differ from a revision, below some paths or everywhere.
    pub(crate) fn changed(&self, revision: &str, paths: &[PathBuf]) -> Result<Vec<Changed>, Quit> {
        let options = ["diff", "--name-status", "--no-ext-diff", "-M", "-z", "--end-of-options"];
        let args = options.into_iter().chain([revision, "--"]).map(OsString::from);
        let found = git(args.chain(paths.iter().map(OsString::from)))?;
        let found = String::from_utf8_lossy(&found);
        let mut words = found.split('\0').map(str::to_owned);
        let mut changed = Vec::new();
        while let (Some(status), Some(path)) = (words.next().filter(|status| !status.is_empty()), words.next()) {
            let (before, after) = match status.chars().next() {
                Some('A') => (None, Some(path)),
                Some('D') => (Some(path), None),
                Some('R' | 'C') => (Some(path), words.next()),
                _ => (Some(path.clone()), Some(path)),
            };
            let is_ron = |path: &Option<String>| path.as_ref().is_some_and(|path| path.ends_with(".ron"));
            if is_ron(&before) || is_ron(&after) {
                changed.push(Changed { before, after });
            }
        }
        Ok(changed)
    }

    /// The texts that a file had, the newest first; at most `most`.
    pub(crate) fn past_texts(&self, path: &Path, most: usize) -> impl Iterator<Item = String> + '_ {
        let whole = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let inside = self.inside(&whole).to_string_lossy().into_owned();
        let args = ["log", &format!("-n{most}"), "--format=%H", "--"].map(OsString::from);
        let found = git(args.into_iter().chain([whole.into_os_string()])).unwrap_or_default();
        let revisions: Vec<String> = String::from_utf8_lossy(&found).lines().map(str::to_owned).collect();
        revisions.into_iter().filter_map(move |revision| self.text(&revision, &inside).ok())
    }

    /// The graph files that the repository has, below some paths or everywhere.
    pub(crate) fn graphs(&self, paths: &[PathBuf]) -> Result<Vec<PathBuf>, Quit> {
        let args = ["ls-files", "-z", "--full-name", "--"].map(OsString::from);
        let all = [OsString::from(":/")];
        let paths: Vec<OsString> =
            if paths.is_empty() { all.to_vec() } else { paths.iter().map(OsString::from).collect() };
        let found = git(args.into_iter().chain(paths))?;
        let names = String::from_utf8_lossy(&found).into_owned();
        Ok(names.split('\0').filter(|name| name.ends_with(".ron")).map(|name| self.path(name)).collect())
    }
}

/// Merges the lines of three files, as git does for files without a driver: our version, the base, and theirs. Returns the result, and
/// the number of conflicts marked in it. The files need not be UTF-8.
///
/// # Errors
/// [`Quit::Fatal`] if git cannot merge them: they are no text, or git cannot be run.
pub(crate) fn merge_lines(files: [&Path; 3], marker_size: u8) -> Result<(Vec<u8>, u64), Quit> {
    let size = format!("--marker-size={marker_size}");
    let args = ["merge-file", "-p", "--diff3", &size, "-L", "ours", "-L", "base", "-L", "theirs", "--"].map(OsStr::new);
    let mut command = Command::new("git");
    command.args(args).args(files).stdin(Stdio::null());
    let output = command.output().map_err(|error| Quit::Fatal(format!("cannot run `git`: {error}")))?;
    match output.status.code() {
        // Above 127 it is a failure.
        Some(conflicts @ 0..=127) => Ok((output.stdout, conflicts.unsigned_abs().into())),
        _ => Err(Quit::Fatal(format!("git merge-file: {}", said(&output.stderr)))),
    }
}

/// The first line of an error of git.
fn said(stderr: &[u8]) -> String {
    let said = String::from_utf8_lossy(stderr);
    let said = said.lines().next().unwrap_or("it failed");
    said.trim_start_matches("fatal: ").trim_start_matches("error: ").to_owned()
}

/// The first line of an output.
pub(super) fn line(output: &[u8]) -> String {
    String::from_utf8_lossy(output).lines().next().unwrap_or_default().to_owned()
}

/// Runs git in the working folder; returns its output.
pub(super) fn git<A: AsRef<OsStr>>(args: impl IntoIterator<Item = A>) -> Result<Vec<u8>, Quit> {
    let mut command = Command::new("git");
    command.args(args).stdin(Stdio::null());
    let output = command.output().map_err(|error| Quit::failed(format!("cannot run `git`: {error}")))?;
    if output.status.success() {
        return Ok(output.stdout);
    }
    Err(Quit::Usage(format!("git: {}", said(&output.stderr))))
}
