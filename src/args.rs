//! The command line.
use crate::{
    bridge, cache, changes, check, compare, completions, diff, dump, fit, fmt, git, graph, job, lsp, man, mcp, merge,
    migrate, new, nodes, pack, parts, pin, render, schema, watch,
};
use clap::{Args, Parser, Subcommand};
use shibo_picture::PartOf;
use shibo_value::Resolution;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  shibo new calf --from leather        make a commented graph file, calf.ron
  shibo check calf.ron                 all errors, with line, column and advice
  shibo watch calf.ron                 show it in a browser; every save is there at once
  shibo render calf.ron -o maps        write the pictures
  shibo nodes Perlin                   the manual of a node

Exit code: 0 when everything asked for was done, 1 for errors in your files, 2 for wrong usage.";

/// Node-graph procedural textures from text files.
#[derive(Debug, Parser)]
#[command(name = "shibo", version, about, max_term_width = 120, after_help = EXAMPLES)]
pub(crate) struct Cli {
    /// Sub-command.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Look for imports of graphs in this folder too, after that of the graph; may be repeated.
    /// $SHIBO_IMPORT_PATH names more.
    #[arg(long, value_name = "DIR", global = true)]
    pub(crate) import_path: Vec<PathBuf>,
}

/// Sub-commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render the outputs of a graph to picture files.
    Render(render::RenderArgs),
    /// Compute and keep what all parts of a graph's pictures need.
    Prepare(parts::PrepareArgs),
    /// Join the parts of pictures that `render --part` made.
    Join(parts::JoinArgs),
    /// Write a job that renders a graph on many machines.
    Job(job::JobArgs),
    /// Show a graph in a browser, and follow every save of it.
    Watch(watch::WatchArgs),
    /// Report all errors of graph files.
    Check(check::CheckArgs),
    /// Lay out graph files.
    Fmt(fmt::FmtArgs),
    /// Rewrite graph files that use kinds of nodes that formulas replace.
    Migrate(migrate::MigrateArgs),
    /// List the changes of nodes and shipped graphs that alter pictures or names.
    Changes(changes::ChangesArgs),
    /// Pin graphs at a change, so that later versions of nodes leave their pictures alone.
    Pin(pin::PinArgs),
    /// Prove that pinned graphs still give their pictures.
    Verify(pin::verify::VerifyArgs),
    /// List the changes from one version of a graph to another.
    Diff(diff::DiffArgs),
    /// Tell the differences between two pictures of a material.
    Compare(compare::CompareArgs),
    /// Find the values with which a graph looks like a photograph.
    Fit(fit::FitArgs),
    /// Merge two changed versions of a graph.
    Merge(merge::MergeArgs),
    /// Let git diff and merge graphs by this program.
    Git(git::GitArgs),
    /// List the kinds of nodes, show the manual of one, or search them.
    Nodes(nodes::NodesArgs),
    /// Print the JSON Schema of graphs in the JSON form.
    Schema(schema::SchemaArgs),
    /// Print what a node makes, as JSON.
    Dump(dump::DumpArgs),
    /// Make a commented graph file to start from.
    New(new::NewArgs),
    /// Draw a graph.
    Graph(graph::GraphArgs),
    /// Put a graph and all that it reads into one file.
    Pack(pack::PackArgs),
    /// Help editors with graph files: completion, errors while typing, and more.
    Lsp(lsp::LspArgs),
    /// Answer programs in other languages: one JSON object per line, over stdin and stdout.
    Bridge(bridge::BridgeArgs),
    /// Serve agents: nodes, checks, thumbnails and comparisons, over stdin and stdout.
    Mcp(mcp::McpArgs),
    /// Look at, or empty, the cache of results.
    Cache(cache::CacheArgs),
    /// Print a completion script for a shell.
    Completions(completions::CompletionsArgs),
    /// Write manual pages of all commands into a folder.
    Man(man::ManArgs),
}

/// Values of a graph's parameters.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ValueArgs {
    /// Give a parameter of the graph, or of a sub-graph (USE.PARAM), a value; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(crate) set: Vec<(String, String)>,
    /// Use the values of a preset of the graph, or of several: `a+b`.
    #[arg(long, value_name = "NAME")]
    pub(crate) preset: Option<String>,
    /// Take the newest versions of all nodes, whatever the pins of the graph say.
    #[arg(long)]
    pub(crate) newest: bool,
}

/// Resources of a computation.
#[derive(Args, Clone, Debug)]
pub(crate) struct EngineArgs {
    /// Threads to compute with; one per core if not given.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub(crate) threads: u16,
    /// Memory for results, in MiB.
    #[arg(long, value_name = "MIB", default_value_t = 1536, value_parser = clap::value_parser!(u32).range(16..))]
    pub(crate) memory: u32,
    /// Neither read nor keep results on disk.
    #[arg(long)]
    pub(crate) no_cache: bool,
    /// The folder for results; $XDG_CACHE_HOME/shibo or ~/.cache/shibo if not given.
    #[arg(long, value_name = "DIR")]
    pub(crate) cache_dir: Option<PathBuf>,
    /// Results that machines share: s3://BUCKET/PREFIX, gs://, az://, https:// or file:///FOLDER; $SHIBO_SHARED_CACHE
    /// if not given.
    #[arg(long, value_name = "URL")]
    pub(crate) shared_cache: Option<String>,
    /// Maximum size of this folder, in MiB.
    #[arg(long, value_name = "MIB", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) cache_size: u32,
}

pub(crate) fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => Ok((name.trim().to_owned(), value.to_owned())),
        _ => Err("write NAME=VALUE".to_owned()),
    }
}

/// Parses `WxH`, or `N` for the longer side.
pub(crate) fn resolution(text: &str) -> Result<Resolution, String> {
    let side = |text: &str| text.trim().parse::<u32>().ok().filter(|&n| n > 0);
    let read = match text.split_once(['x', 'X', '×']) {
        Some((w, h)) => side(w).zip(side(h)).map(|size| Resolution::Exact(size.into())),
        None => side(text).map(Resolution::Longer),
    };
    read.ok_or_else(|| "write WIDTHxHEIGHT, or one number for the longer side, in pixels".to_owned())
}

/// Parses `I/N`, or `I-J/N` for several parts.
pub(crate) fn parts(text: &str) -> Result<PartRange, String> {
    let read = |text: &str| text.trim().parse::<u32>().ok();
    let numbers = text.split_once('/').and_then(|(which, count)| {
        let (first, last) = which.split_once('-').unwrap_or((which, which));
        Some(PartRange { first: read(first)?, last: read(last)?, count: read(count)? })
    });
    let known = numbers.filter(|parts| parts.first >= 1 && parts.first <= parts.last && parts.last <= parts.count);
    known.ok_or_else(|| "write NUMBER/COUNT: 1/16 is the first of 16 parts, 16/16 the last".to_owned())
}

/// A range of parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PartRange {
    first: u32,
    last: u32,
    count: u32,
}

impl PartRange {
    /// The parts one by one.
    pub(crate) fn each(self) -> impl Iterator<Item = PartOf> {
        (self.first..=self.last).map(move |number| PartOf { number, count: self.count })
    }
}

/// Parses `X,Y,W,H`.
pub(crate) fn region(text: &str) -> Result<[u32; 4], String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    numbers
        .and_then(|numbers| <[u32; 4]>::try_from(numbers).ok())
        .ok_or_else(|| "write X,Y,WIDTH,HEIGHT in pixels from the top left".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    #[test]
    fn defines_valid_command_line() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn parses_argument_values() {
        assert_eq!(resolution("640x480"), Ok(Resolution::Exact(UVec2::new(640, 480))));
        assert_eq!(resolution("512"), Ok(Resolution::Longer(512)));
        assert!(["", "0", "1x", "-1x3", "1x2x3", "1e3"].iter().all(|text| resolution(text).is_err()));
        assert_eq!(region("0, 1,2,3"), Ok([0, 1, 2, 3]));
        assert!(["", "1,2,3", "1,2,3,4,5", "1,2,3,-4"].iter().all(|text| region(text).is_err()));
        assert_eq!(parts("3/16"), Ok(PartRange { first: 3, last: 3, count: 16 }));
        assert_eq!(parts("3-4/16").unwrap().each().map(|part| part.number).collect::<Vec<_>>(), [3, 4]);
        let wrong = ["", "3", "0/3", "4/3", "-1/3", "1/0", "a/b", "3-2/4", "1-5/4", "1-/4"];
        assert!(wrong.iter().all(|text| parts(text).is_err()));
        assert_eq!(assignment("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert!(assignment("=1").is_err() && assignment("a").is_err());
    }
}
