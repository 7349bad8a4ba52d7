//! `shibo fmt`: formats graph files, and converts them to the JSON form and back.
use crate::graph_files::{Rewritten, files, read, show_errors, show_faults, text, utf8, written};
use crate::library;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use shibo_bridge::{GraphText, to_json, to_ron};
use shibo_graph::Limits;
use shibo_graph::syntax::format;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo fmt calf.ron                   lay out one file
  shibo fmt graphs                     and all graphs of a folder
  shibo fmt --check graphs             only list those that would change; exit code 1 if there are any
  shibo fmt --stdin < calf.ron         for editors
  shibo fmt --to json calf.ron         print a graph in the JSON form, for programs
  shibo fmt --to ron calf.json         print the graph that a text in the JSON form means

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
    /// Convert one graph, and print it.
    #[arg(long, value_name = "FORM", conflicts_with = "check")]
    to: Option<FormArg>,
}

/// A notation of graphs.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormArg {
    Json,
    Ron,
}

/// Runs the command.
pub(crate) fn run(args: &FmtArgs, terminal: &Terminal) -> Result<(), Quit> {
    match (args.to, &args.graphs[..]) {
        (Some(to), []) => return convert(to, Path::new("<stdin>"), of_stdin()?, terminal),
        (Some(to), [path]) => return convert(to, path, read(path).map_err(Quit::failed)?, terminal),
        (Some(_), _) => return Err(Quit::Usage("`--to` converts one graph at a time".to_owned())),
        (None, _) if args.stdin => return stdin(args, terminal),
        (None, _) => {}
    }
    let (mut good, mut listed) = (true, String::new());
    for path in files(&args.graphs)? {
        match read(&path).map_err(Quit::failed).and_then(|bytes| lay_out(&path, bytes, terminal)) {
            Ok(text) if text.before == text.after => {}
            Ok(_) if args.check => listed += &format!("{}\n", path.display()),
            Ok(text) => {
                good &= written(&path, &text, ("laid out", "lay it out"), terminal);
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

/// The bytes of stdin; of a text that is too long, enough to refuse it.
fn of_stdin() -> Result<Vec<u8>, Quit> {
    let mut bytes = Vec::new();
    let limit = Limits::default().max_file_bytes;
    let read = io::stdin().lock().take(limit + 1).read_to_end(&mut bytes);
    read.map_err(|e| Quit::failed(format!("cannot read stdin: {e}")))?;
    Ok(bytes)
}

/// Prints a graph in another notation.
fn convert(to: FormArg, path: &Path, bytes: Vec<u8>, terminal: &Terminal) -> Result<(), Quit> {
    let graph = GraphText { path: path.to_owned(), text: utf8(path, bytes)? };
    let converted = match to {
        FormArg::Json => to_json(&library::tools(), &graph),
        FormArg::Ron => to_ron(&library::tools(), &graph),
    };
    match converted {
        Ok(text) => terminal.data(&text),
        Err(faults) => {
            show_faults(path, graph.text, &faults, terminal);
            Err(Quit::Shown)
        }
    }
}

fn stdin(args: &FmtArgs, terminal: &Terminal) -> Result<(), Quit> {
    let text = lay_out(Path::new("<stdin>"), of_stdin()?, terminal)?;
    match args.check {
        true if text.before != text.after => Err(Quit::Shown),
        true => Ok(()),
        false => terminal.data(&text.after),
    }
}

/// Formats the text of a file; shows syntax errors.
fn lay_out(path: &Path, bytes: Vec<u8>, terminal: &Terminal) -> Result<Rewritten, Quit> {
    let before = text(path, bytes)?;
    match format(&before) {
        Ok(after) => Ok(Rewritten { before, after }),
        Err(errors) => {
            show_errors(path, before, &errors, terminal);
            Err(Quit::Shown)
        }
    }
}
