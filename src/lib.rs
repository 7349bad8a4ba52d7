//! The `shibo` command, as a library: [`main`] runs it with the kinds of nodes of a registry. One file per sub-command, and no
//! algorithm.
//!
//! A crate with nodes of its own has a program of a few lines with all sub-commands, its manual and its language server
//! (`examples/pack`).
//!
//! Data goes to stdout, messages go to stderr. The exit code is 0 only if the whole request succeeded, 1 for errors in
//! the user's files, 2 for wrong usage.
#![allow(clippy::disallowed_methods, reason = "no picture that is written is made here")]
mod args;
mod bridge;
mod cache;
mod changes;
mod check;
mod compare;
mod completions;
mod diff;
mod dump;
mod environment;
mod find;
mod fit;
mod fmt;
mod git;
mod graph;
mod graph_files;
mod interrupt;
mod job;
mod library;
mod lsp;
mod man;
mod mcp;
mod merge;
mod migrate;
mod new;
mod nodes;
mod open;
mod pack;
mod parts;
mod pin;
mod progress;
mod quit;
mod render;
mod report;
mod schema;
mod serve;
mod shared;
mod stats;
mod sweep;
mod target;
mod templates;
mod terminal;
mod view;
mod watch;
mod zip;

use args::{Cli, Command};
use clap::Parser;
use quit::Quit;
use shibo_node::registry::Registry;
use std::process::ExitCode;
use std::time::Instant;
use terminal::Terminal;

/// Runs the command with the arguments of the process, and returns its exit code. `registry` makes the kinds of nodes and the
/// graphs that can be imported by name.
/// `shibo_library::registry` is that of Shibo, `shibo_library::registry_with` adds families of other crates. It is called
/// several times and must return the same kinds each time.
pub fn main(registry: fn() -> Registry) -> ExitCode {
    let start = Instant::now();
    library::set(registry);
    let terminal = Terminal::new();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // A merge driver reports a failure by a code above 128.
        Err(error) if error.use_stderr() && std::env::args().nth(1).is_some_and(|command| command == "merge") => {
            terminal.usage(&error);
            return ExitCode::from(129);
        }
        Err(error) => return terminal.usage(&error),
    };
    environment::set_import_paths(cli.import_path);
    match run(cli.command, &terminal, start) {
        Ok(()) => ExitCode::SUCCESS,
        Err(quit) => quit.code(&terminal),
    }
}

fn run(command: Command, terminal: &Terminal, start: Instant) -> Result<(), Quit> {
    match command {
        Command::Render(args) => render::run(&args, terminal, start),
        Command::Watch(args) => watch::run(&args, terminal),
        Command::Prepare(args) => parts::prepare(&args, terminal),
        Command::Join(args) => parts::join(&args, terminal),
        Command::Job(args) => job::run(&args, terminal),
        Command::Check(args) => check::run(&args, terminal),
        Command::Fmt(args) => fmt::run(&args, terminal),
        Command::Migrate(args) => migrate::run(&args, terminal),
        Command::Changes(args) => changes::run(&args, terminal),
        Command::Pin(args) => pin::run(&args, terminal),
        Command::Verify(args) => pin::verify::run(&args, terminal),
        Command::Diff(args) => diff::run(&args, terminal),
        Command::Compare(args) => compare::run(&args, terminal),
        Command::Fit(args) => fit::run(&args, terminal),
        Command::Merge(args) => merge::run(&args, terminal),
        Command::Git(args) => git::run(&args, terminal),
        Command::Nodes(args) => nodes::run(&args, terminal),
        Command::Schema(args) => schema::run(&args, terminal),
        Command::Dump(args) => dump::run(&args, terminal),
        Command::New(args) => new::run(&args, terminal),
        Command::Graph(args) => graph::run(&args, terminal),
        Command::Pack(args) => pack::run(&args, terminal),
        Command::Bridge(args) => bridge::run(&args, terminal),
        Command::Mcp(args) => mcp::run(&args),
        Command::Lsp(args) => lsp::run(&args),
        Command::Cache(args) => cache::run(&args, terminal),
        Command::Completions(args) => completions::run(&args, terminal),
        Command::Man(args) => man::run(&args, terminal),
    }
}
