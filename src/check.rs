//! `shibo check`: all errors of graph files.
use crate::args::{EngineArgs, ValueArgs, resolution};
use crate::graph_files::{Rewritten, read, text, written};
use crate::interrupt;
use crate::library;
use crate::open;
use crate::progress::Progress;
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use serde_json::{Value as Json, json};
use shibo_bridge::check::{Located, advice, located_within};
use shibo_bridge::fix::{ROUNDS, repair, unified};
use shibo_bridge::{FixRequest, GraphText};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::Failure;
use shibo_graph::Graph;
use shibo_ide::fixes::{Applies, Budget};
use shibo_value::Resolution;
use shibo_value::diagnostics::{Diagnostic, SourceMap};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo check calf.ron
  shibo check graphs/*.ron --format json     for editors and scripts
  shibo check --fix calf.ron                 repair what has one meaning only; `--fix=likely`: also best guesses
  shibo check --fix --dry-run calf.ron       print what would change
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
    /// Repair errors whose fix is sure, before the check; `likely`: also by best guesses. Comments stay.
    #[arg(long, value_name = "LEVEL", num_args = 0..=1, require_equals = true, default_missing_value = "sure")]
    fix: Option<FixArg>,
    /// Change no file; print what `--fix` would change as a diff, and the errors that would remain.
    #[arg(long, requires = "fix", conflicts_with = "format")]
    dry_run: bool,
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

/// The least certain fixes that are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FixArg {
    Sure,
    Likely,
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
        let text = args.fix.map(|level| repaired(path, level, args.dry_run, terminal)).transpose()?.flatten();
        found.push(check(path, text, args, terminal)?);
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

/// Repairs a file. Returns the new text if it was not written; `None` if the file has the best text.
fn repaired(path: &Path, level: FixArg, dry_run: bool, terminal: &Terminal) -> Result<Option<String>, Quit> {
    // A file that cannot be read is reported by the check.
    let Ok(before) = read(path).map_err(Quit::failed).and_then(|bytes| text(path, bytes)) else { return Ok(None) };
    let applies = if level == FixArg::Sure { Applies::Sure } else { Applies::Likely };
    let graph = GraphText { path: path.to_owned(), text: before.clone() };
    let mut budget = Budget::default();
    let fixed = repair(&library::tools(), &FixRequest { graph, applies, rounds: ROUNDS }, &mut budget);
    if let Some(note) = budget.note() {
        terminal.warning(&format!("{}: {note}", path.display()));
    }
    if fixed.text == before {
        return Ok(None);
    }
    let name = path.display();
    if dry_run {
        terminal.data(&unified(&name.to_string(), &before, &fixed.text))?;
        return Ok(Some(fixed.text));
    }
    let text = Rewritten { before, after: fixed.text };
    if written(path, &text, ("repaired", "repair it"), terminal) {
        fixed.applied.iter().for_each(|title| terminal.say(&format!("  {title}")));
    }
    Ok(None)
}

fn check(path: &Path, text: Option<String>, args: &CheckArgs, terminal: &Terminal) -> Result<Found, Quit> {
    let tools = library::tools();
    let loaded = open::load_text(path, text, &tools.registry, &args.values, args.resolution);
    let mut diagnostics = loaded.diagnostics;
    if let Some(graph) = &loaded.graph {
        diagnostics.extend(advice(&tools, graph));
        diagnostics.extend(graph.too_large(u64::from(args.engine.memory) << 20));
        if args.verify {
            diagnostics.extend(verify(graph, args, terminal)?);
        }
    }
    Ok(Found { diagnostics, sources: loaded.sources })
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

/// JSON of all files together. Warnings have a list of their own, because only entries of `errors` fail the command. `notes` are there
/// only if some fixes were not tried.
fn json_of(found: &[Found]) -> Json {
    let tools = library::tools();
    let (mut all, mut notes): (Vec<Located>, Vec<String>) = (Vec::new(), Vec::new());
    for one in found {
        let mut budget = Budget::default();
        all.extend(located_within(&tools, &one.diagnostics, &one.sources, &mut budget));
        let path = one.sources.sources().first().map(|source| source.path.display().to_string());
        notes.extend(budget.note().map(|note| format!("{}: {note}", path.unwrap_or_default())));
    }
    let (warnings, errors): (Vec<&Located>, Vec<&Located>) = all.iter().partition(|one| one.warning);
    let mut json = json!({ "errors": errors, "warnings": warnings });
    if !notes.is_empty() {
        json["notes"] = notes.into();
    }
    json
}
