//! `shibo mcp`: a server for agents, over stdin and stdout. The operations are those of `shibo_bridge::agents`; this folder has the
//! protocol.
#[cfg(feature = "mcp")]
mod limits;
#[cfg(feature = "mcp")]
mod lines;
#[cfg(feature = "mcp")]
mod pages;
#[cfg(feature = "mcp")]
mod server;
#[cfg(feature = "mcp")]
mod tools;

use crate::quit::Quit;
use clap::Args;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  shibo mcp                            shipped graphs, and texts that the agent gives
  shibo mcp --read graphs              and the graphs and pictures of a folder
  shibo mcp --read . --write drafts    and it may save graphs in another one

Stdin and stdout carry the Model Context Protocol; the end of stdin ends the server. docs/mcp.md lists the tools and the limits.";

/// Serve agents: nodes, checks, thumbnails and comparisons, over stdin and stdout.
#[derive(Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct McpArgs {
    /// Let the agent read graphs and pictures in this folder; may be repeated. Paths are relative to the first one.
    #[arg(long, value_name = "DIR")]
    pub(crate) read: Vec<PathBuf>,
    /// Let the agent save graphs in this folder; may be repeated.
    #[arg(long, value_name = "DIR")]
    pub(crate) write: Vec<PathBuf>,
    /// Threads to compute with; one per core if not given.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub(crate) threads: u16,
    /// Memory for results, in MiB.
    #[arg(long, value_name = "MIB", default_value_t = 1536, value_parser = clap::value_parser!(u32).range(16..))]
    pub(crate) memory: u32,
    /// The longest time of one call, in seconds.
    #[arg(long, value_name = "S", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub(crate) seconds: u32,
}

/// Runs the command.
#[cfg(feature = "mcp")]
pub(crate) fn run(args: &McpArgs) -> Result<(), Quit> {
    server::run(args)
}

/// Tells that this program was built without the server.
#[cfg(not(feature = "mcp"))]
pub(crate) fn run(_args: &McpArgs) -> Result<(), Quit> {
    let message =
        "this `shibo` was built without the server for agents; build it with `cargo build --release --features mcp`";
    Err(Quit::Usage(message.to_owned()))
}
