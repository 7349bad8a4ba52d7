//! Finds imported files: beside the graph, in a folder named by the caller or by `shibo.toml`, or in the library that
//! comes with the program.
use super::gate::Gate;
use super::report::Report;
use super::text_file::{Fault, read_text};
use crate::diagnostics::{Code, Diagnostic, SourceMap, Span};
use crate::registry::Library;
use std::path::{Component, Path, PathBuf};

/// Prefix of the path of a library graph.
pub(super) const LIBRARY: &str = "shibo:";
/// Settings file in the folder of a graph, or in the nearest folder above; names more folders for imports.
const SETTINGS: &str = "shibo.toml";
/// Maximum size of the settings file in bytes.
const MOST: u64 = 1 << 20;

/// The place of an import, or the first place where it should be.
pub(super) struct Found {
    /// The path; for a library graph it begins with [`LIBRARY`].
    pub(super) path: PathBuf,
    /// The files that were tried before.
    pub(super) missing: Vec<PathBuf>,
}

/// The path of a file within the library, without `.` and `..`; `None` for other files.
pub(super) fn within(path: &Path) -> Option<String> {
    let mut parts = path.components();
    if parts.next()?.as_os_str() != LIBRARY {
        return None;
    }
    let mut inside: Vec<String> = Vec::new();
    for part in parts {
        match part {
            Component::Normal(name) => inside.push(name.to_string_lossy().into_owned()),
            Component::ParentDir => drop(inside.pop()),
            _ => {}
        }
    }
    Some(inside.join("/"))
}

/// The full path of a library file.
pub(super) fn library_path(inside: &str) -> PathBuf {
    Path::new(LIBRARY).join(inside)
}

/// The library graph `name`.
pub(super) fn in_library(name: &str, library: Option<&dyn Library>) -> Option<PathBuf> {
    let name = name.trim_start_matches('/');
    library?.find(name.strip_suffix(".ron").unwrap_or(name)).map(|path| library_path(&path))
}

/// Returns true if a file exists.
type IsFile<'a> = &'a dyn Fn(&Path) -> bool;

/// Finds the import `name` of a graph in `folder`; `paths` are additional folders, and `is_file` checks for files. The
/// extension may be left out.
pub(super) fn find(
    name: &str,
    folder: &Path,
    (paths, is_file): (&[PathBuf], IsFile<'_>),
    library: Option<&dyn Library>,
) -> Found {
    let inside = within(folder).is_some();
    let exists = |path: &Path| match within(path) {
        Some(inside) => library.is_some_and(|library| library.text(&inside).is_some()),
        None => is_file(path),
    };
    let folders = std::iter::once(folder).chain(paths.iter().map(PathBuf::as_path).filter(|_| !inside));
    let mut missing = Vec::new();
    for folder in folders {
        let exact = folder.join(name);
        let mut with_extension = exact.clone().into_os_string();
        with_extension.push(".ron");
        for path in [exact, PathBuf::from(with_extension)] {
            if exists(&path) {
                return Found { path, missing };
            }
            missing.push(path);
        }
    }
    // Errors such as "is a folder" are reported for the name as written.
    Found { path: missing.first().cloned().unwrap_or_default(), missing }
}

/// The path of the import `name` in the graph file `from`, which is the graph being rendered; for a library graph it
/// begins with `shibo:`. `further` are additional folders besides those of `shibo.toml`. `None` if there is no such
/// file that `gate` lets pass; files that are `open` in an editor need not be saved.
pub fn import_path(
    from: &Path,
    name: &str,
    (library, further, gate): (Option<&dyn Library>, &[PathBuf], &Gate),
    open: &dyn Fn(&Path) -> bool,
) -> Option<PathBuf> {
    if let Some(name) = name.strip_prefix(LIBRARY) {
        return in_library(name, library);
    }
    let folder = from.parent().unwrap_or(Path::new(""));
    let settings = search_paths((from, gate), &mut Vec::new(), &mut SourceMap::default(), &mut Report::default());
    let paths = [further, &settings].concat();
    let is_file = |path: &Path| open(path) || gate.has(path);
    let found = find(name, folder, (&paths, &is_file), library).path;
    let exists = match within(&found) {
        Some(inside) => library.is_some_and(|library| library.text(&inside).is_some()),
        None => is_file(&found),
    };
    exists.then_some(found)
}

/// The help for a missing import.
pub(super) fn help(name: &str, searched: &[PathBuf], library: Option<&dyn Library>) -> String {
    let stem = Path::new(name).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    if library.is_some_and(|library| library.find(&stem).is_some()) {
        return format!("write `\"{LIBRARY}{stem}\"` for the graph that comes with the program");
    }
    let folders: Vec<_> = searched.iter().map(|path| format!("`{}`", path.display())).collect();
    match &folders[..] {
        [] => format!(
            "paths are relative to this file; more folders can be named with `--import-path`, or in `{SETTINGS}` beside the graph or above it"
        ),
        folders => format!("paths are relative to this file, and to {}", folders.join(", ")),
    }
}

/// The possible places of the settings of a graph in `folder`: this folder and the folders above, nearest first.
fn places(folder: &Path, gate: &Gate) -> Vec<PathBuf> {
    let above = gate.files().above(folder);
    std::iter::once(folder.to_path_buf()).chain(above).map(|folder| folder.join(SETTINGS)).collect()
}

/// The import folders named in the nearest `shibo.toml`: `[imports]`, `paths = ["…"]`. The search begins in the folder
/// of the graph and goes upwards, as far as the gate lets it. Paths in the file are relative to it.
pub(super) fn search_paths(
    (graph, gate): (&Path, &Gate),
    looked_at: &mut Vec<PathBuf>,
    sources: &mut SourceMap,
    report: &mut Report,
) -> Vec<PathBuf> {
    let folder = graph.parent().unwrap_or(Path::new(""));
    if within(graph).is_some() {
        return Vec::new();
    }
    let exists = |path: &PathBuf| {
        // Also record missing files: a nearer one could be created.
        looked_at.push(path.clone());
        gate.pass(path).is_ok_and(|file| file.facts().is_ok())
    };
    let Some(path) = places(folder, gate).into_iter().find(exists) else { return Vec::new() };
    let folder = path.parent().unwrap_or(folder).to_path_buf();
    let text = match gate.pass(&path).and_then(|file| read_text(&file, MOST)) {
        Ok(text) => text,
        Err(Fault { code, message, .. }) => {
            let file = sources.add(path, String::new());
            report.push(Diagnostic::new(code, Span { file, start: 0, end: 0 }, message));
            return Vec::new();
        }
    };
    let file = sources.add(path, text.clone());
    match read_settings(&text) {
        Ok(paths) => paths.into_iter().map(|path| folder.join(path)).collect(),
        Err((start, end, message)) => {
            let error = Diagnostic::new(Code::Syntax, Span { file, start, end }, message);
            report.push(error.help("the file holds `[imports]` and, below it, `paths = [\"folder\", \"folder\"]`"));
            Vec::new()
        }
    }
}

/// The start and end of an error in bytes, and its message.
type Wrong = (usize, usize, String);

/// Reads the subset of TOML needed for settings: tables, keys, texts and lists of texts.
fn read_settings(text: &str) -> Result<Vec<String>, Wrong> {
    let mut paths = Vec::new();
    let mut table = String::new();
    let mut rest = text;
    let at = |rest: &str| text.len() - rest.len();
    loop {
        rest = skip(rest);
        if rest.is_empty() {
            return Ok(paths);
        }
        let line = &rest[..rest.find('\n').unwrap_or(rest.len())];
        let start = at(rest);
        let whole = (start, start + line.trim_end().len());
        if let Some(name) = line.strip_prefix('[') {
            let Some(end) = name.find(']') else {
                return Err((whole.0, whole.1, "a table has no `]`".to_owned()));
            };
            name[..end].trim().clone_into(&mut table);
            if table != "imports" {
                return Err((whole.0, whole.1, format!("there is no table `[{table}]`")));
            }
            rest = &rest[end + 2..];
            continue;
        }
        let Some((key, _)) = line.split_once('=') else {
            return Err((whole.0, whole.1, "this is neither a table nor `key = value`".to_owned()));
        };
        let name = key.trim();
        if (table.as_str(), name) != ("imports", "paths") {
            let place = if table.is_empty() { "before the first table".to_owned() } else { format!("in `[{table}]`") };
            return Err((start, start + key.trim_end().len(), format!("there is no key `{name}` {place}")));
        }
        rest = skip(&rest[key.len() + 1..]);
        let Some(list) = rest.strip_prefix('[') else {
            return Err((at(rest), at(rest), "`paths` is a list of texts".to_owned()));
        };
        rest = skip(list);
        while !rest.starts_with(']') {
            let (path, after) = string(rest).map_err(|message| (at(rest), at(rest), message.to_owned()))?;
            paths.push(path);
            rest = skip(after);
            match rest.strip_prefix(',') {
                Some(after) => rest = skip(after),
                None if rest.starts_with(']') => {}
                None => return Err((at(rest), at(rest), "a comma or `]` is missing here".to_owned())),
            }
        }
        rest = &rest[1..];
    }
}

/// Skips blanks and comments.
fn skip(mut text: &str) -> &str {
    loop {
        text = text.trim_start();
        match text.strip_prefix('#') {
            Some(comment) => text = comment.find('\n').map_or("", |end| &comment[end..]),
            None => return text,
        }
    }
}

/// Reads a quoted text; returns it and the rest.
fn string(text: &str) -> Result<(String, &str), &'static str> {
    if let Some(literal) = text.strip_prefix('\'') {
        let end = literal.find('\'').ok_or("a text has no end")?;
        return Ok((literal[..end].to_owned(), &literal[end + 1..]));
    }
    let body = text.strip_prefix('"').ok_or("a text in quotes is missing here")?;
    let mut out = String::new();
    let mut chars = body.char_indices();
    while let Some((i, c)) = chars.next() {
        match c {
            '"' => return Ok((out, &body[i + 1..])),
            '\\' => match chars.next().map(|(_, c)| c) {
                Some(c @ ('"' | '\\')) => out.push(c),
                _ => return Err("write paths with `/`, or in single quotes"),
            },
            '\n' => break,
            c => out.push(c),
        }
    }
    Err("a text has no end")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_read() {
        let text = "# where\n[imports] # tables\npaths = [\n  \"lib\", 'C:\\x', # two\n  \"a\\\"b\",\n]\n";
        assert_eq!(read_settings(text), Ok(vec!["lib".to_owned(), "C:\\x".to_owned(), "a\"b".to_owned()]));
        assert_eq!(read_settings("  \n# nothing"), Ok(Vec::new()));
        let wrong = |text: &str| {
            let (start, end, message) = read_settings(text).unwrap_err();
            (text[start..end].to_owned(), message)
        };
        assert_eq!(wrong("[import]\n"), ("[import]".into(), "there is no table `[import]`".into()));
        assert_eq!(wrong("paths = []").0, "paths");
        assert!(wrong("[imports]\npath = []").1.contains("no key `path` in `[imports]`"));
        assert!(wrong("[imports]\npaths = \"lib\"").1.contains("a list"));
        assert!(wrong("[imports]\npaths = [\"lib\" \"x\"]").1.contains("comma"));
        assert!(wrong("[imports]\npaths = [\"lib").1.contains("no end"));
        assert!(wrong("[imports]\npaths = [lib]").1.contains("quotes"));
        assert!(wrong("[imports").1.contains(']'));
        assert!(wrong("[imports]\nx").1.contains("neither"));
    }

    #[test]
    fn normalizes_paths_within_the_library() {
        assert_eq!(within(Path::new("shibo:/lib/../pictures/./a.png")), Some("pictures/a.png".into()));
        assert_eq!(within(Path::new("lib/shibo:")), None);
        assert_eq!(within(&library_path("calf.ron")), Some("calf.ron".into()));
    }
}
