//! `shibo git`: lets git diff and merge graphs by this program.
use super::revision::{Repository, git, line};
use crate::environment;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, Subcommand};
use shibo_bridge::write;
use std::fs;
use std::io;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  shibo git install                    in a repository: `git diff` and `git merge` understand graphs
  shibo git install --global           for all repositories of this user
  shibo git install --print            only show the settings
  shibo git install --remove           undo it

The attributes are written to `.gitattributes`, which belongs into the repository. The drivers are settings of this clone: each
person runs the command once.";

/// Let git diff and merge graphs by this program.
#[derive(Args, Debug)]
pub(crate) struct GitArgs {
    /// Sub-command.
    #[command(subcommand)]
    command: GitCommand,
}

/// Sub-commands of `shibo git`.
#[derive(Debug, Subcommand)]
enum GitCommand {
    /// Write the attributes and drivers to the settings of git.
    Install(InstallArgs),
}

#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
struct InstallArgs {
    /// Change nothing; print the settings.
    #[arg(long, conflicts_with = "remove")]
    print: bool,
    /// For all repositories of this user.
    #[arg(long)]
    global: bool,
    /// Take the settings out again.
    #[arg(long)]
    remove: bool,
}

/// Lines of the attributes.
const ATTRIBUTES: [&str; 2] = ["*.ron diff=shibo merge=shibo", "shibo.lock merge=shibo"];

/// Names and values of the settings; `program` is the command in a shell.
fn settings(program: &str) -> [(&'static str, String); 4] {
    [
        // The name of a file may begin with `-`.
        ("diff.shibo.command", format!("{program} diff --git --")),
        // The heading of a plain hunk names the node.
        ("diff.shibo.xfuncname", r#"^[[:space:]]*("[A-Za-z0-9_]+":.*)$"#.to_owned()),
        ("merge.shibo.name", "graphs of Shibo".to_owned()),
        ("merge.shibo.driver", format!("{program} merge --marker-size %L --path=%P -- %O %A %B")),
    ]
}

/// Runs the command.
pub(crate) fn run(args: &GitArgs, terminal: &Terminal) -> Result<(), Quit> {
    let GitCommand::Install(args) = &args.command;
    let settings = settings(&environment::program());
    if args.print {
        let mut text = ATTRIBUTES.map(|line| format!("{line}\n")).concat();
        for (name, value) in &settings {
            text += &format!("{name} = {value}\n");
        }
        return terminal.data(&text);
    }
    let path = attributes(args.global)?;
    let scope = if args.global { "--global" } else { "--local" };
    let shown = path.display();
    let before = match fs::read(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        read => read.map_err(|error| Quit::failed(format!("cannot read `{shown}`: {error}")))?,
    };
    let mut after = without_own(&before);
    for (name, value) in &settings {
        if args.remove {
            // A setting that is not there is removed already.
            let _ = git(["config", scope, "--unset-all", name]);
        } else {
            git(["config", scope, "--replace-all", name, value])?;
        }
    }
    if !args.remove {
        after.extend(ATTRIBUTES.map(|line| format!("{line}\n")).concat().into_bytes());
    }
    if after != before {
        let failed = |error: std::io::Error| Quit::failed(format!("cannot write `{shown}`: {error}"));
        if after.is_empty() {
            fs::remove_file(&path).map_err(failed)?;
        } else {
            write::whole_with_folders(&path, &after).map_err(failed)?;
        }
    }
    let whose = if args.global { "all repositories of this user" } else { "this clone" };
    terminal.say(&match args.remove {
        true => format!("git treats graphs as plain text again in {whose}; `{shown}` has no line of Shibo"),
        false => format!(
            "git diffs and merges graphs by `{}` in {whose}; `{shown}` says for which files",
            environment::program()
        ),
    });
    Ok(())
}

/// The lines of an attribute file that other programs and people wrote, byte by byte: the file need not be UTF-8.
fn without_own(attributes: &[u8]) -> Vec<u8> {
    let is_own = |line: &[u8]| ATTRIBUTES.iter().any(|own| own.as_bytes() == line.trim_ascii());
    let mut others: Vec<u8> =
        attributes.split_inclusive(|byte| *byte == b'\n').filter(|line| !is_own(line)).flatten().copied().collect();
    if others.last().is_some_and(|byte| *byte != b'\n') {
        others.push(b'\n');
    }
    others
}

/// The file for the attributes.
fn attributes(global: bool) -> Result<PathBuf, Quit> {
    if global {
        let set = git(["config", "--global", "--type=path", "core.attributesFile"]).map(|found| line(&found));
        return match set {
            Ok(path) => Ok(path.into()),
            Err(_) => {
                environment::git_attributes().ok_or_else(|| Quit::failed("there is no home folder for settings of git"))
            }
        };
    }
    let repository = Repository::here()?;
    Ok(match repository.is_bare() {
        true => line(&git(["rev-parse", "--git-path", "info/attributes"])?).into(),
        false => repository.path(".gitattributes"),
    })
}
