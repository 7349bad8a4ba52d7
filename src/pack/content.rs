//! Files of a package: their names in it, and rewritten imports.
use super::{Files, plain};
use shibo_graph::Graph;
use shibo_value::diagnostics::{Code, Diagnostic, Origin, Span};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Prefix of paths of library graphs.
const LIBRARY: &str = "shibo:";
/// Settings file. It is packed if it lies among the packed files; imports do not depend on it there.
const SETTINGS: &str = "shibo.toml";

/// Spans of a text, and their replacements.
type Edits = BTreeMap<(usize, usize), String>;

/// A package under construction.
#[derive(Default)]
pub(super) struct Content {
    /// Absolute paths of the files.
    paths: BTreeSet<PathBuf>,
    /// Imports by file: the span of the text, and the absolute path of the imported file.
    imports: BTreeMap<PathBuf, BTreeMap<(usize, usize), PathBuf>>,
}

impl Content {
    /// Adds the texts of a graph and their imports.
    pub(super) fn add(&mut self, graph: &Graph) {
        let texts = graph.sources.sources().iter().filter(|source| source.origin == Origin::File);
        self.paths.extend(texts.map(|source| &source.path).filter(|path| is_own(path)).map(|path| plain(path)));
        for (span, meant) in &graph.imports {
            let text = graph.sources.path(span.file);
            if is_own(text) && is_own(meant) {
                self.imports.entry(plain(text)).or_default().insert((span.start, span.end), plain(meant));
            }
        }
    }

    /// Adds a file that a node reads, such as a picture.
    pub(super) fn add_file(&mut self, path: &Path) {
        self.paths.insert(plain(path));
    }

    /// Returns true if a file is in the package.
    pub(super) fn holds(&self, path: &Path) -> bool {
        let identity = |path: &Path| path.canonicalize().unwrap_or_else(|_| plain(path));
        self.paths.iter().any(|own| identity(own) == identity(path))
    }

    /// Innermost folder that contains all files except settings.
    fn folder(&self) -> PathBuf {
        let mut folders = self.paths.iter().filter(|path| !path.ends_with(SETTINGS)).filter_map(|path| path.parent());
        let mut common = folders.next().unwrap_or(Path::new("")).to_owned();
        for folder in folders {
            while !folder.starts_with(&common) && common.pop() {}
        }
        common
    }

    /// Name of a file in the package.
    pub(super) fn name(&self, path: &Path) -> String {
        name(path, &self.folder())
    }

    /// Names of all files.
    pub(super) fn names(&self) -> Vec<String> {
        let folder = self.folder();
        self.paths.iter().filter(|path| path.starts_with(&folder)).map(|path| name(path, &folder)).collect()
    }

    /// Returns an error if the path `written`, in the text at `span`, leads out of the package.
    pub(super) fn climbs(&self, graph: &Graph, span: Span, written: &str) -> Option<Diagnostic> {
        let text = graph.sources.path(span.file);
        let is_file = graph.sources.sources().iter().any(|source| source.path == text && source.origin == Origin::File);
        if !is_file || !is_own(text) || follow(&self.name(&plain(text)), written).is_some() {
            return None;
        }
        let message =
            format!("`{written}` climbs out of all folders that the package has, and would lead nowhere elsewhere");
        Some(
            Diagnostic::new(Code::BadFile, span, message)
                .help("write it relative to the graph file, as short as possible"),
        )
    }

    /// Reads the files. Imports that would not find their files in the package are rewritten; each is returned with its
    /// text and its new path.
    pub(super) fn read(&self) -> io::Result<(Files, Vec<(String, String)>)> {
        let folder = self.folder();
        let (mut files, mut rewritten) = (Vec::new(), Vec::new());
        for path in self.paths.iter().filter(|path| path.starts_with(&folder)) {
            let failed =
                |error: io::Error| io::Error::new(error.kind(), format!("cannot read `{}`: {error}", path.display()));
            let (name, mut content) = (name(path, &folder), fs::read(path).map_err(failed)?);
            let edits = self.edits(path, &name, &folder, &content);
            rewritten.extend(edits.values().map(|word| (name.clone(), word.clone())));
            for ((start, end), word) in edits.into_iter().rev() {
                drop(content.splice(start..end, word.into_bytes()));
            }
            files.push((name, content));
        }
        Ok((files, rewritten))
    }

    /// Imports of a text to rewrite.
    fn edits(&self, path: &Path, own: &str, folder: &Path, content: &[u8]) -> Edits {
        let mut edits = Edits::new();
        for ((start, end), meant) in self.imports.get(path).into_iter().flatten() {
            let meant = name(meant, folder);
            let literal = content.get(*start..*end).and_then(|literal| std::str::from_utf8(literal).ok());
            let written = literal.and_then(shibo_graph::syntax::decode);
            let leads = written.and_then(|written| follow(own, &written));
            let right = leads.is_some_and(|leads| leads == meant || format!("{leads}.ron") == meant);
            if !right {
                edits.insert((*start, *end), format!("{:?}", relative(own, &meant)));
            }
        }
        edits
    }
}

/// Returns true for a file of the user.
pub(super) fn is_own(path: &Path) -> bool {
    !path.starts_with(LIBRARY)
}

/// Name of a file relative to a folder, with slashes.
fn name(path: &Path, folder: &Path) -> String {
    let inside = path.strip_prefix(folder).unwrap_or(path);
    inside.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// Resolves a path written in the file `from` of a package; `None` if it leads out of the package.
fn follow(from: &str, written: &str) -> Option<String> {
    if Path::new(written).is_absolute() {
        return None;
    }
    let mut parts: Vec<&str> = from.split('/').collect();
    parts.pop();
    for part in written.split(['/', std::path::MAIN_SEPARATOR]) {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// Path from the file `from` to the file `to` of a package.
fn relative(from: &str, to: &str) -> String {
    let (mut from, to): (Vec<&str>, Vec<&str>) = (from.split('/').collect(), to.split('/').collect());
    from.pop();
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..", from.len() - same);
    up.chain(to[same..].iter().copied()).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolves_and_writes_paths_in_package() {
        for (from, written, to) in [
            ("a.ron", "b.ron", Some("b.ron")),
            ("x/a.ron", "../y/./b.ron", Some("y/b.ron")),
            ("x/a.ron", "../../b.ron", None),
            ("a.ron", "/b.ron", None),
            ("x/y/a.ron", "b.ron", Some("x/y/b.ron")),
        ] {
            assert_eq!(follow(from, written).as_deref(), to, "{from} {written}");
        }
        for (from, to) in [("a", "b"), ("x/a", "b"), ("a", "x/b"), ("x/y/a", "x/z/b"), ("x/y/a", "x/b")] {
            assert_eq!(follow(from, &relative(from, to)).as_deref(), Some(to), "{from} {to}");
        }
    }
}
