//! `shibo pack`: a graph and all that it reads in one file.
use crate::args::ValueArgs;
use crate::environment;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use crate::zip;
use clap::Args;
use shibo_engine::diagnostics::{Code, Diagnostic, Origin};
use shibo_engine::graph::Graph;
use std::collections::BTreeSet;
use std::fs;
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
    let mut paths = BTreeSet::new();
    let graph = load(&args.graph, ValueArgs::default(), terminal)?;
    collect(&graph, &mut paths, terminal)?;
    for preset in &graph.presets {
        let values = ValueArgs { set: Vec::new(), preset: Some(preset.clone()) };
        collect(&load(&args.graph, values, terminal)?, &mut paths, terminal)?;
    }
    if args.list {
        let folder = common_folder(&paths);
        return terminal.data(&paths.iter().map(|path| name(path, &folder) + "\n").collect::<String>());
    }
    let out = args.out.clone().unwrap_or_else(|| args.graph.with_extension("zip"));
    let files = read(&paths)?;
    let archive = zip::zip(&files).map_err(|zip::TooLarge| Quit::failed("the files are larger than 4 GiB together"))?;
    write(&out, &archive).map_err(|e| Quit::failed(format!("cannot write `{}`: {e}", out.display())))?;
    terminal.say(&format!("wrote {}, {}", out.display(), report::count(files.len() as u64, "file")));
    Ok(())
}

/// What a graph with these values reads, and which of the files is the graph's own.
pub(crate) fn gather(path: &Path, values: &ValueArgs, terminal: &Terminal) -> Result<(Files, String), Quit> {
    if path.starts_with("shibo:") || path.to_string_lossy().starts_with("shibo:") {
        let message = "a graph that comes with the program has no file";
        return Err(Quit::Usage(format!("{message}; copy it first with `shibo new NAME --from GRAPH`")));
    }
    let mut paths = BTreeSet::new();
    collect(&load(path, values.clone(), terminal)?, &mut paths, terminal)?;
    let main = name(&plain(path), &common_folder(&paths));
    Ok((read(&paths)?, main))
}

/// Names and contents.
type Files = Vec<(String, Vec<u8>)>;

fn read(paths: &BTreeSet<PathBuf>) -> Result<Files, Quit> {
    let folder = common_folder(paths);
    let mut files = Vec::new();
    for path in paths {
        let content = fs::read(path).map_err(|e| Quit::failed(format!("cannot read `{}`: {e}", path.display())))?;
        files.push((name(path, &folder), content));
    }
    Ok(files)
}

/// The name of a file in a folder, with slashes.
fn name(path: &Path, folder: &Path) -> String {
    let inside = path.strip_prefix(folder).unwrap_or(path);
    inside.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

fn load(path: &Path, values: ValueArgs, terminal: &Terminal) -> Result<Graph, Quit> {
    open::graph(open::load(path, &library::registry(), &values, None), terminal)
}

/// Adds all files of a graph but those that come with the program.
fn collect(graph: &Graph, paths: &mut BTreeSet<PathBuf>, terminal: &Terminal) -> Result<(), Quit> {
    let texts = graph.sources.sources().iter().filter(|source| source.origin == Origin::File);
    paths.extend(texts.map(|source| &source.path).filter(|path| !path.starts_with("shibo:")).map(|path| plain(path)));
    let unpacked = environment::library_dir();
    let mut absolute = Vec::new();
    for node in graph.nodes.node_weights() {
        for (field, path) in node.files.iter().filter(|(_, path)| !path.starts_with(&unpacked)) {
            let written = node.node.files().into_iter().find(|(name, _)| name == field);
            if written.is_some_and(|(_, written)| Path::new(&written.0).is_absolute()) {
                let message = format!("`{}` is an absolute path, which would lead nowhere elsewhere", path.display());
                let error = Diagnostic::new(Code::BadFile, node.field_span(Some(field)), message);
                absolute.push(error.help("write it relative to the graph file"));
            }
            paths.insert(plain(path));
        }
    }
    if absolute.is_empty() {
        return Ok(());
    }
    report::show(terminal, &absolute, &graph.sources);
    Err(Quit::Shown)
}

/// An absolute path without `.` and `..`.
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

/// The innermost folder that holds all of these files.
fn common_folder(paths: &BTreeSet<PathBuf>) -> PathBuf {
    let mut folders = paths.iter().filter_map(|path| path.parent());
    let mut common = folders.next().unwrap_or(Path::new("")).to_owned();
    for folder in folders {
        while !folder.starts_with(&common) && common.pop() {}
    }
    common
}

/// Writes a file as a whole or not at all.
fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(format!(".{}.part", std::process::id()));
    let part = PathBuf::from(part);
    fs::write(&part, bytes).and_then(|()| fs::rename(&part, path)).inspect_err(|_| {
        let _ = fs::remove_file(&part);
    })
}
