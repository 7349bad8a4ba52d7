//! `shibo fmt`: formats graph files.
use crate::graph_files::{Rewritten, files, read, show_errors, text, written};
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::Args;
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
