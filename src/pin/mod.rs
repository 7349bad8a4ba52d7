//! `shibo pin`: writes into graphs which versions of nodes they mean, and keeps their pictures beside them.
mod lock;
pub(crate) mod verify;

use crate::args::EngineArgs;
use crate::graph_files::{Rewritten, files, read, text};
use crate::interrupt;
use crate::quit::Quit;
use crate::report::{self, count};
use crate::terminal::Terminal;
use crate::{environment, library, open};
use clap::Args;
use lock::LockFile;
use shibo_bridge::lock::{LOCK, RESOLUTION, entry};
use shibo_bridge::write::{self, Refused};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::Session;
use shibo_graph::{LoadOptions, load_text};
use shibo_ide::actions::pinned;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo pin calf.ron                   keep the versions of nodes that the program has now
  shibo pin --to 38 calf.ron           those after change 38
  shibo pin --remove calf.ron          always the newest
  shibo pin --lock-only graphs         leave the graphs alone, and keep their pictures

`shibo changes` lists the changes. Comments and layout stay. The pictures of all outputs, at 64 pixels, are kept in `shibo.lock`
beside the graph; `shibo verify` compares with them. A graph with an error is not pinned.";

/// Pin graphs at a change, so that later versions of nodes leave their pictures alone.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct PinArgs {
    /// Graph files, or folders of them.
    #[arg(value_name = "GRAPH", required = true)]
    graphs: Vec<PathBuf>,
    /// Pin at this change, instead of the newest.
    #[arg(long, value_name = "CHANGE", conflicts_with_all = ["remove", "lock_only"])]
    to: Option<u32>,
    /// Remove the pins, and the pictures from `shibo.lock`.
    #[arg(long, conflicts_with = "lock_only")]
    remove: bool,
    /// Keep pictures, and leave the graphs as they are.
    #[arg(long, conflicts_with = "no_lock")]
    lock_only: bool,
    /// Keep no pictures.
    #[arg(long)]
    no_lock: bool,
    #[command(flatten)]
    engine: EngineArgs,
}

/// The state of a run.
struct Run<'r> {
    args: &'r PinArgs,
    session: Session,
    cancel: CancelToken,
    terminal: &'r Terminal,
}

/// Runs the command.
pub(crate) fn run(args: &PinArgs, terminal: &Terminal) -> Result<(), Quit> {
    let files = files(&args.graphs)?;
    let session = open::session(library::registry(), &args.engine, terminal)?;
    let newest = session.registry().changes().newest();
    if args.to.is_some_and(|change| !(1..=newest).contains(&change)) {
        let change = args.to.unwrap_or_default();
        return Err(Quit::Usage(format!("change {change} is unknown: changes have the numbers 1 to {newest}")));
    }
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let run = Run { args, session, cancel, terminal };
    let mut good = true;
    for path in files {
        // The remaining files are pinned nevertheless.
        if let Err(quit) = run.pin(&path, args.to.unwrap_or(newest)) {
            quit.code(terminal);
            good = false;
        }
        if run.cancel.is_cancelled() {
            return Err(Quit::failed("interrupted; the remaining graphs are as they were before"));
        }
    }
    if good { Ok(()) } else { Err(Quit::Shown) }
}

impl Run<'_> {
    /// Pins the text of a file that has no errors, and keeps its pictures.
    fn pin(&self, path: &Path, change: u32) -> Result<(), Quit> {
        let (args, shown) = (self.args, path.display());
        let text = self.rewritten(path, change)?;
        let mut lock = if args.no_lock { None } else { Some(LockFile::beside(path)?) };
        let mut says = match (args.remove, args.lock_only) {
            (true, _) => format!("{shown}: unpinned"),
            (false, true) => format!("{shown}:"),
            (false, false) => format!("{shown}: pinned at change {change}"),
        };
        if args.remove {
            lock.iter_mut().for_each(|lock| lock.set(path, None));
        } else {
            // The graph as it will be, which must have no errors.
            let options = LoadOptions {
                resolution: Some(RESOLUTION),
                import_paths: environment::import_paths().to_vec(),
                ..LoadOptions::default()
            };
            let loaded = load_text(path, &text.after, self.session.registry(), &options);
            report::show(self.terminal, &loaded.diagnostics, &loaded.sources);
            let graph = loaded.graph.ok_or(Quit::Shown)?;
            if let Some(lock) = &mut lock {
                let entry = entry(&self.session, &graph, &self.cancel);
                let entry = entry.map_err(|failure| open::failed(failure, &graph.sources, self.terminal))?;
                let separator = if args.lock_only { " " } else { ", " };
                says += &format!("{separator}{} in {LOCK}", count(entry.pictures.len() as u64, "picture"));
                lock.set(path, Some(entry));
            }
        }
        if text.before != text.after {
            write::change(path, &text.before, &text.after).map_err(|refused| match refused {
                Refused::Changed => {
                    Quit::failed(format!("`{shown}` was saved meanwhile, and left alone; pin it again"))
                }
                Refused::Failed(error) => Quit::failed(format!("cannot write `{shown}`: {error}")),
            })?;
        }
        lock.map_or(Ok(()), |lock| lock.save())?;
        self.terminal.say(&says);
        Ok(())
    }

    /// The text of a file with its pin.
    fn rewritten(&self, path: &Path, change: u32) -> Result<Rewritten, Quit> {
        let before = text(path, read(path).map_err(Quit::failed)?)?;
        let after = match (self.args.lock_only, self.args.remove) {
            (true, _) => Some(before.clone()),
            (_, true) => pinned(&before, None),
            _ => pinned(&before, Some(change)),
        };
        let after = after.ok_or_else(|| Quit::failed(format!("`{}` is no graph", path.display())))?;
        Ok(Rewritten { before, after })
    }
}
