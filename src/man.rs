//! `shibo man`: manual pages.
use crate::args::Cli;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, CommandFactory};
use shibo_picture::AtomicFile;
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo man ~/.local/share/man/man1
  man shibo-render";

/// Write manual pages of all commands into a folder.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ManArgs {
    /// The folder; it is made if it does not exist.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Runs the command.
pub(crate) fn run(args: &ManArgs, terminal: &Terminal) -> Result<(), Quit> {
    let folder = &args.folder;
    std::fs::create_dir_all(folder).map_err(|error| unwritten(folder, &error))?;
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    let mut commands = vec![command];
    while let Some(command) = commands.pop() {
        let page = clap_mangen::Man::new(command.clone());
        let path = folder.join(page.get_filename());
        let mut text = Vec::new();
        let written = page.render(&mut text).and_then(|()| {
            let mut file = AtomicFile::create(&path)?;
            file.write_all(&text)?;
            file.commit()
        });
        written.map_err(|error| unwritten(&path, &error))?;
        terminal.say(&format!("wrote {}", path.display()));
        commands.extend(command.get_subcommands().filter(|command| !command.is_hide_set()).cloned());
    }
    Ok(())
}

fn unwritten(path: &Path, error: &std::io::Error) -> Quit {
    Quit::failed(format!("cannot write `{}`: {error}", path.display()))
}
