//! Command line of `shibo watch`.
use crate::args::{EngineArgs, ValueArgs};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  shibo watch calf.ron                   open a page that follows every save
  shibo watch calf.ron --no-open --port 7007
  shibo watch /net/share/calf.ron --poll
  shibo watch calf.ron --editor 'code -g {file}:{line}:{column}'   a click on a node shows its line

Over SSH, use the same port on both sides: ssh -L 7007:127.0.0.1:7007 host, then shibo watch calf.ron --port 7007.";

/// Show a graph in a browser, and follow every save of it.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct WatchArgs {
    /// The graph file.
    pub(super) graph: PathBuf,
    /// The port of the page; 0 is any that is free.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) port: u16,
    /// Do not open a browser.
    #[arg(long)]
    pub(super) no_open: bool,
    /// Look at the files regularly instead of asking the system for changes; for network folders.
    #[arg(long)]
    pub(super) poll: bool,
    /// Command that shows a line in your editor when a node is clicked: `code -g {file}:{line}:{column}`.
    #[arg(long, value_name = "COMMAND")]
    pub(super) editor: Option<String>,
    /// End when stdin is closed, for programs that start this one and may be killed.
    #[arg(long, hide = true)]
    pub(super) while_stdin: bool,
    /// Print events on stdout, for programs.
    #[arg(long, value_name = "FORMAT")]
    pub(super) log: Option<LogArg>,
    #[command(flatten)]
    pub(super) values: ValueArgs,
    #[command(flatten)]
    pub(super) engine: EngineArgs,
}

/// Format of the events.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum LogArg {
    Json,
}
