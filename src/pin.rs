//! `shibo pin`: writes into graphs which versions of nodes they mean.
use crate::args::ValueArgs;
use crate::graph_files::{Rewritten, files, read, text, written};
use crate::quit::Quit;
use crate::terminal::Terminal;
use crate::{library, open};
use clap::Args;
use shibo_ide::actions::pinned;
use shibo_node::registry::Registry;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo pin calf.ron                   keep the versions of nodes that the program has now
  shibo pin --to 38 calf.ron           those after change 38
  shibo pin --remove calf.ron          always the newest
  shibo pin graphs                     all graphs of a folder

`shibo changes` lists the changes. Comments and layout stay. A graph with an error is not pinned.";

/// Pin graphs at a change, so that later versions of nodes leave their pictures alone.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct PinArgs {
    /// Graph files, or folders of them.
    #[arg(value_name = "GRAPH", required = true)]
    graphs: Vec<PathBuf>,
    /// Pin at this change, instead of the newest.
    #[arg(long, value_name = "CHANGE", conflicts_with = "remove")]
    to: Option<u32>,
    /// Remove the pins.
    #[arg(long)]
    remove: bool,
}

/// Runs the command.
pub(crate) fn run(args: &PinArgs, terminal: &Terminal) -> Result<(), Quit> {
    let registry = library::registry();
    let newest = registry.changes().newest();
    let change = args.to.unwrap_or(newest);
    if !(1..=newest).contains(&change) {
        return Err(Quit::Usage(format!("change {change} is unknown: changes have the numbers 1 to {newest}")));
    }
    let (to, done) = match args.remove {
        true => (None, "unpinned".to_owned()),
        false => (Some(change), format!("pinned at change {change}:")),
    };
    let mut good = true;
    for path in files(&args.graphs)? {
        match rewrite(&path, to, &registry, terminal) {
            Ok(text) if text.before == text.after => {}
            Ok(text) => good &= written(&path, &text, (&done, "pin it"), terminal),
            // The remaining files are pinned nevertheless.
            Err(quit) => {
                quit.code(terminal);
                good = false;
            }
        }
    }
    if good { Ok(()) } else { Err(Quit::Shown) }
}

/// Pins the text of a file that has no errors.
fn rewrite(path: &Path, change: Option<u32>, registry: &Registry, terminal: &Terminal) -> Result<Rewritten, Quit> {
    let before = text(path, read(path).map_err(Quit::failed)?)?;
    if change.is_some() {
        // A pin that the graph has may be the error.
        open::graph(open::load(path, registry, &ValueArgs { newest: true, ..ValueArgs::default() }, None), terminal)?;
    }
    let after = pinned(&before, change);
    let after = after.ok_or_else(|| Quit::failed(format!("`{}` is no graph", path.display())))?;
    Ok(Rewritten { before, after })
}
