//! `shibo pack`: packs a graph and all files that it reads into one archive.
mod content;

use crate::args::ValueArgs;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use crate::zip;
use clap::Args;
use content::{Content, is_own};
use shibo_bridge::write;
use shibo_graph::Graph;
use shibo_value::diagnostics::{Code, Diagnostic};
use std::path::{Component, Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo pack inlay.ron -o inlay.zip    the graph, its sub-graphs, and the pictures that they read
  shibo pack inlay.ron --list          only say what it would hold

What comes with the program (`shibo:walnut`) is not packed. Pictures that only a preset reads are.";

/// Put a graph and all that it reads into one file.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct PackArgs {
    /// The graph file.
    graph: PathBuf,
    /// The archive to write; GRAPH with the extension `zip` if not given.
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the names of the files, and write nothing.
    #[arg(long)]
    list: bool,
}

/// Runs the command.
pub(crate) fn run(args: &PackArgs, terminal: &Terminal) -> Result<(), Quit> {
    let mut content = Content::default();
    let graph = load(&args.graph, ValueArgs::default(), terminal)?;
    collect(&graph, &mut content, terminal)?;
    for preset in &graph.presets {
        let values = ValueArgs { preset: Some(preset.clone()), ..ValueArgs::default() };
        collect(&load(&args.graph, values, terminal)?, &mut content, terminal)?;
    }
    if args.list {
        return terminal.data(&content.names().iter().map(|name| format!("{name}\n")).collect::<String>());
    }
    let out = args.out.clone().unwrap_or_else(|| args.graph.with_extension("zip"));
    if content.holds(&out) {
        let message =
            format!("`{}` is one of the files that are packed; name another archive with --out", out.display());
        return Err(Quit::Usage(message));
    }
    let files = read(&content, terminal)?;
    let archive = zip::zip(&files).map_err(|zip::TooLarge| Quit::failed("the files are larger than 4 GiB together"))?;
    write::whole(&out, &archive).map_err(|e| Quit::failed(format!("cannot write `{}`: {e}", out.display())))?;
    terminal.say(&format!("wrote {}, {}", out.display(), report::count(files.len() as u64, "file")));
    Ok(())
}

/// Files that a graph with these values reads, and the name of the graph's own file.
pub(crate) fn gather(path: &Path, values: &ValueArgs, terminal: &Terminal) -> Result<(Files, String), Quit> {
    if path.starts_with("shibo:") || path.to_string_lossy().starts_with("shibo:") {
        let message = "a graph that comes with the program has no file";
        return Err(Quit::Usage(format!("{message}; copy it first with `shibo new NAME --from GRAPH`")));
    }
    let mut content = Content::default();
    collect(&load(path, values.clone(), terminal)?, &mut content, terminal)?;
    let main = content.name(&plain(path));
    Ok((read(&content, terminal)?, main))
}

/// Names and contents.
pub(super) type Files = Vec<(String, Vec<u8>)>;

fn read(content: &Content, terminal: &Terminal) -> Result<Files, Quit> {
    let (files, rewritten) = content.read().map_err(|error| Quit::failed(error.to_string()))?;
    for (name, word) in rewritten {
        terminal.say(&format!("in the package, `{name}` imports {word}"));
    }
    Ok(files)
}

fn load(path: &Path, values: ValueArgs, terminal: &Terminal) -> Result<Graph, Quit> {
    open::graph(open::load(path, &library::registry(), &values, None), terminal)
}

/// Adds all files of a graph except library graphs.
fn collect(graph: &Graph, content: &mut Content, terminal: &Terminal) -> Result<(), Quit> {
    content.add(graph);
    let (mut errors, mut relative) = (Vec::new(), Vec::new());
    for node in graph.nodes.node_weights() {
        for (field, file) in node.files.iter().filter(|(_, file)| is_own(file.path())) {
            let written = node.node.files().into_iter().find(|(name, _)| name == field).map(|(_, written)| &written.0);
            let span = node.field_span(Some(field));
            if let Some(written) = written.filter(|written| Path::new(written).is_absolute()) {
                let message = format!("`{written}` is an absolute path, which would lead nowhere elsewhere");
                let error = Diagnostic::new(Code::BadFile, span, message);
                errors.push(error.help("write it relative to the graph file"));
            } else {
                relative.extend(written.map(|written| (span, written)));
            }
            content.add_file(file.path());
        }
    }
    errors.extend(relative.into_iter().filter_map(|(span, written)| content.climbs(graph, span, written)));
    if errors.is_empty() {
        return Ok(());
    }
    report::show(terminal, &errors, &graph.sources);
    Err(Quit::Shown)
}

/// Makes a path absolute, without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let whole = std::env::current_dir().unwrap_or_default().join(path);
    let mut plain = PathBuf::new();
    for part in whole.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(plain.pop()),
            part => plain.push(part),
        }
    }
    plain
}
