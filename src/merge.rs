//! `shibo merge`: merges two changed versions of a graph, or of a lock.
use crate::git::merge_lines;
use crate::graph_files::{read, text};
use crate::library;
use crate::quit::Quit;
use crate::report::count;
use crate::terminal::Terminal;
use clap::Args;
use shibo_bridge::write::{self, Refused};
use shibo_bridge::{MergeRequest, merge};
use shibo_graph::Limits;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo merge base.ron mine.ron other.ron               mine.ron becomes the result
  shibo merge base.ron mine.ron other.ron -o both.ron
  shibo git install                                     `git merge` and `git rebase` call it

Changes of different fields are merged, wherever they are in the file. Where both sides changed one field, both versions and
the base stand between marks, and `shibo check` reports an error there until one is kept.

Files that are not UTF-8 text are merged by lines with `git merge-file`, with a warning. Locks (`shibo.lock`) are merged graph by graph.
A lock that this program cannot read, such as one of a newer Shibo, is left as it is.

Exit code: 0 if merged, 1 if there are conflicts or the file was left as it is, 129 if the files could not be read or written.";

/// Merge two changed versions of a graph.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct MergeArgs {
    /// The common version.
    base: PathBuf,
    /// Our version; the result is written there.
    ours: PathBuf,
    /// Their version.
    theirs: PathBuf,
    /// Write the result to this file, and leave our version alone.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Characters of a conflict mark; at least 7.
    #[arg(long, value_name = "N", default_value_t = 7)]
    marker_size: u8,
    /// Path of the graph, from which imports are searched; that of our version if not given.
    #[arg(long, value_name = "PATH")]
    path: Option<PathBuf>,
}

/// Runs the command.
pub(crate) fn run(args: &MergeArgs, terminal: &Terminal) -> Result<(), Quit> {
    let path = args.path.clone().unwrap_or_else(|| args.output.as_ref().unwrap_or(&args.ours).clone());
    let mut bytes = Vec::new();
    for version in [&args.base, &args.ours, &args.theirs] {
        bytes.push(read(version).map_err(Quit::Fatal)?);
    }
    if let Some(reason) = ["the base", "our version", "their version"].into_iter().zip(&bytes).find_map(no_graph) {
        return by_git(args, &path, &reason, terminal);
    }
    let mut texts = Vec::new();
    for (version, bytes) in [&args.base, &args.ours, &args.theirs].into_iter().zip(bytes) {
        texts.push(text(version, bytes).map_err(|quit| Quit::Fatal(quit.text()))?);
    }
    let [base, ours, theirs] = <[String; 3]>::try_from(texts).unwrap_or_default();
    let request =
        MergeRequest { base, ours: ours.clone(), theirs, path: path.clone(), marker_size: args.marker_size.into() };
    let merged = merge(&library::tools(), &request);
    if let Some(reason) = &merged.refused {
        // Nothing is written, as git expects of a file that it cannot merge: ours stays, and the path counts as unmerged.
        let name = path.display();
        terminal.error(&format!(
            "{name} was not merged: {reason}; a newer Shibo may have made it. Update Shibo and merge again, or keep one version \
             and run `shibo pin` for the graphs that `shibo verify` does not call `same`"
        ));
        return Err(Quit::Shown);
    }
    let target = args.output.as_ref().unwrap_or(&args.ours);
    let written = match &args.output {
        Some(output) => write::whole(output, merged.text.as_bytes()).map_err(Refused::Failed),
        None if merged.text == ours => Ok(()),
        None => write::change(target, &ours, &merged.text),
    };
    match written {
        Ok(()) => {}
        Err(Refused::Changed) => {
            return Err(Quit::Fatal(format!("`{}` was saved meanwhile, and left alone", target.display())));
        }
        Err(Refused::Failed(error)) => {
            return Err(Quit::Fatal(format!("cannot write `{}`: {error}", target.display())));
        }
    }
    let name = path.display();
    for note in &merged.notes {
        terminal.warning(&format!("{name}: {note}"));
    }
    if let Some(reason) = &merged.by_lines {
        terminal.warning(&format!("{name} was merged by lines, so look at it: {reason}"));
    }
    for conflict in &merged.conflicts {
        let error = conflict.error.as_ref().map(|error| format!(" (together: {error})")).unwrap_or_default();
        terminal.say(&format!("{name}:{}: {}{error}", conflict.line, conflict.path.join(".")));
    }
    if merged.is_clean() {
        return Ok(());
    }
    if !merged.conflicts.is_empty() {
        terminal.error(&format!("{} in {name}", count(merged.conflicts.len() as u64, "conflict")));
    }
    Err(Quit::Shown)
}

/// The reason why a version can be no graph: it is not UTF-8 text, or too large.
fn no_graph((name, bytes): (&str, &Vec<u8>)) -> Option<String> {
    let limit = Limits::default().max_file_bytes;
    if bytes.len() as u64 > limit {
        return Some(format!("{name} is larger than {limit} bytes"));
    }
    let is_text = std::str::from_utf8(bytes).is_ok();
    (!is_text).then(|| format!("{name} is not UTF-8 text; save it as UTF-8, and its fields are merged"))
}

/// Leaves the merge of files that are no graphs to git, which merges their lines.
fn by_git(args: &MergeArgs, path: &Path, reason: &str, terminal: &Terminal) -> Result<(), Quit> {
    let (merged, conflicts) = merge_lines([&args.ours, &args.base, &args.theirs], args.marker_size.max(7))?;
    let target = args.output.as_ref().unwrap_or(&args.ours);
    write::whole(target, &merged)
        .map_err(|error| Quit::Fatal(format!("cannot write `{}`: {error}", target.display())))?;
    let name = path.display();
    terminal.warning(&format!("git merged the lines of {name}, because {reason}"));
    if conflicts == 0 {
        return Ok(());
    }
    terminal.error(&format!("{} in {name}", count(conflicts, "conflict")));
    Err(Quit::Shown)
}
