//! `shibo check`: all errors of graph files.
use crate::args::{EngineArgs, ValueArgs, resolution};
use crate::interrupt;
use crate::library;
use crate::open;
use crate::progress::Progress;
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use serde_json::{Value as Json, json};
use shibo_bridge::lock::news;
use shibo_engine::eval::CancelToken;
use shibo_engine::session::Failure;
use shibo_graph::Graph;
use shibo_ide::{Cx, Section, Workspace, diagnose};
use shibo_node::registry::Registry;
use shibo_value::Resolution;
use shibo_value::diagnostics::{Code, Diagnostic, FileId, SourceMap, Span, to_json};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const EXAMPLES: &str = "\
Examples:
  shibo check calf.ron
  shibo check graphs/*.ron --format json     for editors and scripts
  shibo check calf.ron --resolution 65536    also what would not fit the memory at that size
  shibo check calf.ron --verify              also prove that the cache gives what a cold run gives (slow)";

/// Report all errors of graph files.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CheckArgs {
    /// The graph files.
    #[arg(required = true, value_name = "GRAPH")]
    graphs: Vec<PathBuf>,
    /// For people, on stderr, or for programs, on stdout.
    #[arg(long, default_value = "human")]
    format: FormatArg,
    /// Compute everything with and without the cache, and compare the bytes.
    #[arg(long)]
    verify: bool,
    /// The pixels of pictures, instead of the graph's: of the longer side, or width and height.
    #[arg(long, value_name = "N|WxH", value_parser = resolution)]
    resolution: Option<Resolution>,
    #[command(flatten)]
    values: ValueArgs,
    #[command(flatten)]
    engine: EngineArgs,
}

/// Output format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FormatArg {
    Human,
    Json,
}

/// Findings of one file.
struct Found {
    diagnostics: Vec<Diagnostic>,
    sources: SourceMap,
}

/// Runs the command.
pub(crate) fn run(args: &CheckArgs, terminal: &Terminal) -> Result<(), Quit> {
    let mut found = Vec::new();
    for path in &args.graphs {
        found.push(check(path, args, terminal)?);
    }
    let errors = found.iter().flat_map(|f| &f.diagnostics).filter(|d| !d.warning).count();
    match args.format {
        FormatArg::Json => terminal.json(&json_of(&found))?,
        FormatArg::Human => {
            found.iter().for_each(|f| report::show(terminal, &f.diagnostics, &f.sources));
            if errors > 0 {
                terminal.say(&report::count(errors as u64, "error"));
            }
        }
    }
    if errors > 0 { Err(Quit::Shown) } else { Ok(()) }
}

fn check(path: &Path, args: &CheckArgs, terminal: &Terminal) -> Result<Found, Quit> {
    let registry = Arc::new(library::registry());
    let loaded = open::load(path, &registry, &args.values, args.resolution);
    let mut diagnostics = loaded.diagnostics;
    if let Some(graph) = &loaded.graph {
        diagnostics.extend(graph.advice());
        diagnostics.extend(news(registry.changes(), graph));
        diagnostics.extend(advice(&loaded.sources, registry));
        diagnostics.extend(graph.too_large(u64::from(args.engine.memory) << 20));
        if args.verify {
            diagnostics.extend(verify(graph, args, terminal)?);
        }
    }
    Ok(Found { diagnostics, sources: loaded.sources })
}

/// Nodes that no output needs, and names that hide others in formulas, as in editors.
fn advice(sources: &SourceMap, registry: Arc<Registry>) -> Vec<Diagnostic> {
    let Some(source) = sources.sources().first() else { return Vec::new() };
    let mut workspace =
        Workspace::new(registry, Vec::new()).with_import_paths(crate::environment::import_paths().to_vec());
    let file = workspace.open(&source.path, source.text.clone());
    let at = |range: &Range<usize>| Span { file: FileId(0), start: range.start, end: range.end };
    let mut found = Vec::new();
    for graph in file.scopes() {
        let cx = Cx { world: &workspace, file: &graph };
        let entries = graph.entries(Section::Nodes);
        for key in diagnose::unused(cx).into_iter().filter_map(|index| entries[index].key.as_ref()) {
            let message = format!("no output needs `{}`", key.name);
            let help = format!("leave it out, or call it `_{}` if it shall stay", key.name);
            found.push(Diagnostic::new(Code::Advice, at(&key.range), message).help(help).as_warning());
        }
        for (range, message) in diagnose::hiding(cx) {
            let warning = Diagnostic::new(Code::Advice, at(&range), message).help("give it another name");
            found.push(warning.as_warning());
        }
    }
    found
}

/// Finds nodes whose result differs the second time. Only this step starts threads and opens caches.
fn verify(graph: &Graph, args: &CheckArgs, terminal: &Terminal) -> Result<Vec<Diagnostic>, Quit> {
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let session = open::session(library::registry(), &args.engine, terminal)?;
    let progress = Progress::new(terminal, args.format == FormatArg::Json);
    let result = session.verify(graph, &cancel, &progress);
    let mut found = progress.finish();
    match result {
        Ok(impure) => found.extend(impure),
        Err(Failure::Errors(errors)) => found.extend(errors),
        Err(failure) => return Err(open::failed(failure, &graph.sources, terminal)),
    }
    Ok(found)
}

/// JSON of all files together. Warnings have a list of their own, because only entries of `errors` fail the command.
fn json_of(found: &[Found]) -> Json {
    let mut all = json!({ "errors": [], "warnings": [] });
    for one in found {
        let Json::Object(lists) = to_json(&one.diagnostics, &one.sources) else { continue };
        for (name, list) in lists {
            if let (Some(Json::Array(all)), Json::Array(list)) = (all.get_mut(&name), list) {
                all.extend(list);
            }
        }
    }
    all
}
