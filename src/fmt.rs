//! `shibo fmt`: formats graph files.
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use crate::write::{self, Refused};
use clap::Args;
use shibo_graph::Limits;
use shibo_graph::syntax::{Tree, format};
use shibo_value::diagnostics::SourceMap;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo fmt calf.ron                   lay out one file
  shibo fmt graphs                     and all graphs of a folder
  shibo fmt --check graphs             only list those that would change; exit code 1 if there are any
  shibo fmt --stdin < calf.ron         for editors

Comments, the order of things, and numbers stay as they are. A file with a syntax error is reported, and left alone.";

/// Lay out graph files.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FmtArgs {
    /// Graph files, or folders of them.
    #[arg(value_name = "GRAPH", required_unless_present = "stdin")]
    graphs: Vec<PathBuf>,
    /// Change nothing; print the files that would change.
    #[arg(long)]
    check: bool,
    /// Read a graph from stdin, and write it to stdout.
    #[arg(long, conflicts_with = "graphs")]
    stdin: bool,
}

/// A text and its formatted version.
struct Text {
    before: String,
    after: String,
}

/// Runs the command.
pub(crate) fn run(args: &FmtArgs, terminal: &Terminal) -> Result<(), Quit> {
    if args.stdin {
        return stdin(args, terminal);
    }
    let (mut good, mut listed) = (true, String::new());
    for path in files(&args.graphs)? {
        match read(&path).map_err(Quit::failed).and_then(|bytes| lay_out(&path, bytes, terminal)) {
            Ok(text) if text.before == text.after => {}
            Ok(_) if args.check => listed += &format!("{}\n", path.display()),
            Ok(text) => {
                good &= written(&path, &text, terminal);
            }
            // The remaining files are formatted nevertheless.
            Err(quit) => {
                quit.code(terminal);
                good = false;
            }
        }
    }
    terminal.data(&listed)?;
    if good && listed.is_empty() { Ok(()) } else { Err(Quit::Shown) }
}

/// Writes the formatted text, unless another program saved the file at the same time. Returns true if it was written.
fn written(path: &Path, text: &Text, terminal: &Terminal) -> bool {
    let name = path.display();
    let message = match write::change(path, &text.before, &text.after) {
        Ok(()) => {
            terminal.say(&format!("laid out {name}"));
            return true;
        }
        Err(Refused::Changed) => format!("`{name}` was saved meanwhile, and left alone; lay it out again"),
        Err(Refused::Failed(error)) => format!("cannot write `{name}`: {error}"),
    };
    terminal.error(&message);
    false
}

fn stdin(args: &FmtArgs, terminal: &Terminal) -> Result<(), Quit> {
    let mut bytes = Vec::new();
    let limit = Limits::default().max_file_bytes;
    let read = io::stdin().lock().take(limit + 1).read_to_end(&mut bytes);
    read.map_err(|e| Quit::failed(format!("cannot read stdin: {e}")))?;
    let text = lay_out(Path::new("<stdin>"), bytes, terminal)?;
    match args.check {
        true if text.before != text.after => Err(Quit::Shown),
        true => Ok(()),
        false => terminal.data(&text.after),
    }
}

/// The given files, and the files of the given folders.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Quit> {
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

fn read(path: &Path) -> Result<Vec<u8>, String> {
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

/// Formats the text of a file; shows syntax errors.
fn lay_out(path: &Path, bytes: Vec<u8>, terminal: &Terminal) -> Result<Text, Quit> {
    let limit = Limits::default().max_file_bytes;
    if bytes.len() as u64 > limit {
        let message = format!("`{}` is larger than {limit} bytes, the most that a graph file may have", path.display());
        return Err(Quit::failed(message));
    }
    let before =
        String::from_utf8(bytes).map_err(|e| Quit::failed(format!("`{}` is not UTF-8 text: {e}", path.display())))?;
    match format(&before) {
        Ok(after) => Ok(Text { before, after }),
        Err(errors) => {
            let mut sources = SourceMap::default();
            let file = sources.add(path, before);
            let errors: Vec<_> = errors.iter().take(MOST).map(|error| error.located(file)).collect();
            report::show(terminal, &errors, &sources);
            Err(Quit::Shown)
        }
    }
}

/// Maximum number of syntax errors shown per file.
const MOST: usize = 20;
