//! `shibo completions`: scripts for shells.
use crate::args::Cli;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, CommandFactory};
use clap_complete::Shell;

const EXAMPLES: &str = "\
Examples:
  shibo completions bash > ~/.local/share/bash-completion/completions/shibo
  shibo completions fish > ~/.config/fish/completions/shibo.fish";

/// Print a completion script for a shell.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

/// Runs the command.
pub(crate) fn run(args: &CompletionsArgs, terminal: &Terminal) -> Result<(), Quit> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "shibo", &mut script);
    terminal.data(&String::from_utf8_lossy(&script))
}
