//! `shibo migrate`: rewrites graph files from kinds of nodes that formulas replace, and to newer versions of nodes.
use crate::graph_files::{Rewritten, files, read, show_errors, text, written};
use crate::quit::Quit;
use crate::terminal::Terminal;
use crate::{environment, library, report};
use clap::Args;
use shibo_graph::{LoadOptions, Loaded, load_text};
use shibo_ide::Workspace;
use shibo_ide::actions::{answered, pinned, pinned_at};
use shibo_ide::migrate::{Change, migrate};
use shibo_node::registry::Registry;
use shibo_value::diagnostics::{Code, Diagnostic, SourceMap, Span};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const EXAMPLES: &str = "\
Examples:
  shibo migrate calf.ron               replace `Math` and others by formulas, and parts of trees by `Tree`
  shibo migrate --dry-run calf.ron     print the new text, and change nothing
  shibo migrate --check graphs         only list the files that would change; exit code 1 if there are any

Chains of nodes become one formula, and a formula with one reader is written where it is read. Comments stay above what
they describe, and nothing else moves. Pictures stay the same, except where a warning says otherwise. A file with a
syntax error is reported, and left alone.

A graph with pins gets the edits that the table of changes names for later versions of its nodes, and then the newest pin. Warnings
name the changes after which its picture differs all the same. Versions that its pins hold stay. A version that the program does
not have any more, held or in an import, is an error that says where it is and how to release it.";

/// Rewrite graph files that use kinds of nodes that formulas replace.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct MigrateArgs {
    /// Graph files, or folders of them.
    #[arg(value_name = "GRAPH", required = true)]
    graphs: Vec<PathBuf>,
    /// Change nothing; print the new texts of the files that would change.
    #[arg(long, conflicts_with = "check")]
    dry_run: bool,
    /// Change nothing; print the files that would change.
    #[arg(long)]
    check: bool,
    /// For graphs with pins: the change to pin at, instead of the newest.
    #[arg(long, value_name = "CHANGE")]
    to: Option<u32>,
}

/// Runs the command.
pub(crate) fn run(args: &MigrateArgs, terminal: &Terminal) -> Result<(), Quit> {
    let registry = Arc::new(library::registry());
    let newest = registry.changes().newest();
    let to = args.to.unwrap_or(newest);
    if !(1..=newest).contains(&to) {
        return Err(Quit::Usage(format!("change {to} is unknown: changes have the numbers 1 to {newest}")));
    }
    let (mut good, mut listed, mut texts) = (true, String::new(), Vec::new());
    for path in files(&args.graphs)? {
        match read(&path).map_err(Quit::failed).and_then(|bytes| rewrite(&path, bytes, (&registry, to), terminal)) {
            Ok((text, is_whole)) => {
                good &= is_whole;
                match text {
                    text if text.before == text.after => {}
                    _ if args.check => listed += &format!("{}\n", path.display()),
                    text if args.dry_run => texts.push((path, text.after)),
                    text => good &= written(&path, &text, ("rewrote", "rewrite it"), terminal),
                }
            }
            // The remaining files are rewritten nevertheless.
            Err(quit) => {
                quit.code(terminal);
                good = false;
            }
        }
    }
    let several = texts.len() > 1;
    for (path, text) in texts {
        // A comment, so that each text stays a valid graph.
        listed += &if several { format!("// {}\n{text}", path.display()) } else { text };
    }
    terminal.data(&listed)?;
    if good && (listed.is_empty() || args.dry_run) { Ok(()) } else { Err(Quit::Shown) }
}

/// Rewrites the text of a file; shows syntax errors, and warnings. The second value is false if the program does not have the
/// versions of the new text.
fn rewrite(
    path: &Path,
    bytes: Vec<u8>,
    (registry, to): (&Arc<Registry>, u32),
    terminal: &Terminal,
) -> Result<(Rewritten, bool), Quit> {
    let before = text(path, bytes)?;
    match migrate(&before, registry) {
        Ok(migration) => {
            show_warnings(path, &before, &migration.warnings, terminal);
            let after = raised(path, migration.text, registry, to, terminal);
            let is_whole = has_versions(path, &after, registry, terminal);
            Ok((Rewritten { before, after }, is_whole))
        }
        Err(errors) => {
            show_errors(path, before, &errors, terminal);
            Err(Quit::Shown)
        }
    }
}

/// A text with pins, edited as later changes ask and pinned at `to`; warns of pictures that differ. Other texts stay.
fn raised(path: &Path, text: String, registry: &Arc<Registry>, to: u32, terminal: &Terminal) -> String {
    let Some(from) = pinned_at(&text).filter(|from| *from < to) else { return text };
    let world = Workspace::new(registry.clone(), Vec::new());
    let answered = answered(&world, path, &text, (from, to));
    for (number, node) in &answered.differing {
        let Some(change) = registry.changes().since(number - 1).next() else { continue };
        let (shown, says) = (path.display(), change.difference(change.worst));
        terminal.warning(&format!("{shown}: `{node}` looks different since change {number}: {says}"));
    }
    pinned(&answered.text, Some(to)).unwrap_or(answered.text)
}

/// Returns whether the program has the versions that a text means; shows those that it does not have. Texts without pins mean
/// the newest versions.
fn has_versions(path: &Path, text: &str, registry: &Registry, terminal: &Terminal) -> bool {
    if pinned_at(text).is_none() {
        return true;
    }
    let options = LoadOptions { import_paths: environment::import_paths().to_vec(), ..LoadOptions::default() };
    let Loaded { diagnostics, sources, .. } = load_text(path, text, registry, &options);
    let is_gone = |one: &Diagnostic| matches!(one.code, Code::ChangedKind | Code::UnknownVersion);
    let gone: Vec<_> = diagnostics.into_iter().filter(is_gone).collect();
    report::show(terminal, &gone, &sources);
    gone.is_empty()
}

fn show_warnings(path: &Path, text: &str, warnings: &[Change], terminal: &Terminal) {
    let mut sources = SourceMap::default();
    let file = sources.add(path, text.to_owned());
    let located = |warning: &Change| {
        let span = Span { file, start: warning.range.start, end: warning.range.end };
        Diagnostic::new(Code::Advice, span, warning.message.clone()).as_warning()
    };
    let warnings: Vec<_> = warnings.iter().map(located).collect();
    report::show(terminal, &warnings, &sources);
}
