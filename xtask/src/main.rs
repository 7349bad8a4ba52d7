//! `cargo xtask fast|full|ci`: runs a lane of tests, then prints how long each test program and the ten slowest tests took.
//!
//! The times come from the test programs themselves. libtest prints the time of each test with `--report-time`, an option that the
//! stable toolchain accepts only with `RUSTC_BOOTSTRAP=1` in the environment of the *test program*. This program therefore runs
//! each of them as the *runner* of cargo, and sets the variable there. The compiler never sees it, so nothing is compiled a second time,
//! and the command of cargo stays as it was written.
mod lines;
mod report;
mod runner;
mod table;

use report::Report;
use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

/// Unit tests of all crates, then the rules about the code. All commands build the whole workspace with the same features, so
/// no lane makes another one compile again.
const FAST: [&str; 2] = [
    "cargo test --release --locked --workspace --lib",
    "cargo test --release --locked --workspace --test cli structure::",
];
/// The test command that README.md gives.
const FULL: [&str; 1] = ["cargo test --release --locked --workspace"];

const USAGE: &str = "usage: cargo xtask LANE
  fast             unit tests and the rules about the code: at most 2 minutes after a build
  full             all tests of the workspace, by the command that README.md gives
  ci               everything that must hold: .ci/run, with a small case of each outside program
  ci --full        .ci/full, with all cases
  lines            lines of code by crate, without blank lines, comments and tests
  table [REV]      the table of changes and the digests of pictures have lost no entry since a revision
  time COMMAND…    a command of `cargo test`; prints how long its programs and tests took";

fn main() -> ExitCode {
    let args: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    let done = match words[..] {
        [runner::NAME, program, ref rest @ ..] => return runner::run(program, rest),
        ["fast"] => timed(&FAST.map(split)),
        ["full"] => timed(&FULL.map(split)),
        ["ci"] => run(&mut Command::new(root().join(".ci/run"))),
        ["ci", "--full"] => run(&mut Command::new(root().join(".ci/full"))),
        ["lines"] => lines::print().map(|()| ExitCode::SUCCESS).map_err(|error| format!("cannot count lines: {error}")),
        ["table", ref revision @ ..] if revision.len() < 2 => {
            table::check(revision.first().copied()).map(|()| ExitCode::SUCCESS)
        }
        ["time", ref command @ ..] if !command.is_empty() => timed(&[command.to_vec()]),
        _ => Err(USAGE.to_owned()),
    };
    match done {
        Ok(code) => code,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

fn split(command: &str) -> Vec<&str> {
    command.split(' ').collect()
}

/// The folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Runs commands of cargo until one fails, and prints the times of the tests in any case.
fn timed(commands: &[Vec<&str>]) -> Result<ExitCode, String> {
    let times = env::temp_dir().join(format!("shibo-test-times-{}", std::process::id()));
    let own = env::current_exe().map_err(|error| format!("this program does not know its own path: {error}"))?;
    let variable = runner::variable()?;
    let begin = Instant::now();
    let mut code = ExitCode::SUCCESS;
    for command in commands {
        let mut cargo = Command::new(command[0]);
        cargo.args(&command[1..]).env(&variable, format!("{} {}", own.display(), runner::NAME));
        cargo.env(runner::TIMES, &times).env(runner::VARIABLE, &variable);
        code = run(&mut cargo)?;
        if code != ExitCode::SUCCESS {
            break;
        }
    }
    let report = Report::read(&std::fs::read_to_string(&times).unwrap_or_default());
    drop(std::fs::remove_file(&times));
    print!("{report}");
    println!("{:9.1} s  in all, building included", begin.elapsed().as_secs_f64());
    Ok(code)
}

/// Runs a command to its end, without the variables that cargo sets for this program. Build scripts depend on some of them
/// (`ring` on `CARGO_MANIFEST_DIR`), so cargo would compile with and without them in turn.
fn run(command: &mut Command) -> Result<ExitCode, String> {
    for (variable, _) in env::vars_os() {
        let name = variable.to_string_lossy();
        if name.starts_with("CARGO_PKG_") || ["CARGO_MANIFEST_DIR", "CARGO_MANIFEST_PATH"].contains(&&*name) {
            command.env_remove(&variable);
        }
    }
    let name = command.get_program().to_string_lossy().into_owned();
    let status = command.status().map_err(|error| format!("{name}: {error}"))?;
    Ok(runner::code(status))
}
