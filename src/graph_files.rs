//! Commands that rewrite graph files: reads them, shows their syntax errors, and writes the new texts.
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use shibo_bridge::json::TextFault;
use shibo_bridge::write::{self, Refused};
use shibo_graph::Limits;
use shibo_graph::syntax::{SyntaxError, Tree};
use shibo_value::diagnostics::{Code, Diagnostic, SourceMap, Span};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Maximum number of syntax errors shown per file.
const MOST: usize = 20;

/// A text and its new version.
pub(crate) struct Rewritten {
    pub(crate) before: String,
    pub(crate) after: String,
}

/// The given files, and the files of the given folders.
pub(crate) fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Quit> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            graphs_of(path, &mut files).map_err(|e| Quit::failed(format!("cannot read `{}`: {e}", path.display())))?;
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

/// Graphs of a folder and its sub-folders, in order.
fn graphs_of(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut paths: Vec<_> = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()?;
    paths.sort();
    for path in paths {
        if path.is_dir() && !path.is_symlink() {
            graphs_of(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "ron") && is_graph(&path) {
            files.push(path);
        }
    }
    Ok(())
}

/// Returns whether a file looks like a graph, that is, has nodes.
fn is_graph(path: &Path) -> bool {
    let text = read(path).ok().and_then(|bytes| String::from_utf8(bytes).ok());
    text.is_some_and(|text| Tree::parse(text).value().is_some_and(|top| top.entry("nodes").is_some()))
}

/// The bytes of a regular file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, String> {
    let shown = path.display();
    let metadata = fs::metadata(path).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => format!("there is no file `{shown}`"),
        _ => format!("`{shown}` cannot be read: {e}"),
    })?;
    if !metadata.is_file() {
        return Err(format!("`{shown}` is not a regular file"));
    }
    fs::read(path).map_err(|e| format!("`{shown}` cannot be read: {e}"))
}

/// The text of a graph file. The JSON form is refused.
pub(crate) fn text(path: &Path, bytes: Vec<u8>) -> Result<String, Quit> {
    let is_json = path.extension().is_some_and(|ending| ending == "json") && bytes.starts_with(b"{");
    if is_json {
        let path = path.display();
        let convert = format!("`shibo fmt --to ron {path}` converts it");
        return Err(Quit::failed(format!("`{path}` is a graph in the JSON form; graphs are RON: {convert}")));
    }
    utf8(path, bytes)
}

/// The text of a file that is not too large.
pub(crate) fn utf8(path: &Path, bytes: Vec<u8>) -> Result<String, Quit> {
    let limit = Limits::default().max_file_bytes;
    if bytes.len() as u64 > limit {
        let message = format!("`{}` is larger than {limit} bytes, the most that a graph file may have", path.display());
        return Err(Quit::failed(message));
    }
    String::from_utf8(bytes).map_err(|e| Quit::failed(format!("`{}` is not UTF-8 text: {e}", path.display())))
}

/// Shows the syntax errors of a text.
pub(crate) fn show_errors(path: &Path, text: String, errors: &[SyntaxError], terminal: &Terminal) {
    let mut sources = SourceMap::default();
    let file = sources.add(path, text);
    let errors: Vec<_> = errors.iter().take(MOST).map(|error| error.located(file)).collect();
    report::show(terminal, &errors, &sources);
}

/// Shows the mistakes that a conversion found in a text.
pub(crate) fn show_faults(path: &Path, text: String, faults: &[TextFault], terminal: &Terminal) {
    let mut sources = SourceMap::default();
    let file = sources.add(path, text);
    let errors = faults.iter().take(MOST).map(|fault| {
        let span = Span { file, start: fault.range.start, end: fault.range.end };
        let error = Diagnostic::new(Code::Syntax, span, fault.message.clone());
        match &fault.help {
            Some(help) => error.help(help.clone()),
            None => error,
        }
    });
    report::show(terminal, &errors.collect::<Vec<_>>(), &sources);
}

/// Writes the new text of a file, unless another program saved the file at the same time. Returns true if it was written.
/// `done` and `again` name the change: `laid out`, `lay it out`.
pub(crate) fn written(path: &Path, text: &Rewritten, (done, again): (&str, &str), terminal: &Terminal) -> bool {
    let name = path.display();
    let message = match write::change(path, &text.before, &text.after) {
        Ok(()) => {
            terminal.say(&format!("{done} {name}"));
            return true;
        }
        Err(Refused::Changed) => format!("`{name}` was saved meanwhile, and left alone; {again} again"),
        Err(Refused::Failed(error)) => format!("cannot write `{name}`: {error}"),
    };
    terminal.error(&message);
    false
}
