//! Runs one test program for cargo, and notes how long the program and each of its tests took.
use crate::report::{Entry, line};
use std::env;
use std::fs::OpenOptions;
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::time::Instant;

/// The argument that makes this program a runner.
pub(crate) const NAME: &str = "runner";
/// The variable with the path of the file that collects the times.
pub(crate) const TIMES: &str = "XTASK_TIMES";
/// The variable with the name of the variable that tells cargo its runner.
pub(crate) const VARIABLE: &str = "XTASK_RUNNER_VARIABLE";

/// The name of the variable in which cargo looks for a runner. It contains the name of this machine's target.
pub(crate) fn variable() -> Result<String, String> {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo).arg("-vV").output().map_err(|error| format!("cargo -vV: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let host = text.lines().find_map(|line| line.strip_prefix("host: ")).ok_or("cargo -vV names no host")?;
    Ok(format!("CARGO_TARGET_{}_RUNNER", host.to_uppercase().replace('-', "_")))
}

/// Runs a test program with the arguments that cargo gives.
pub(crate) fn run(program: &str, args: &[&str]) -> ExitCode {
    match watch(program, args) {
        Ok(status) => code(status),
        Err(error) => {
            eprintln!("{program}: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The exit code of a program; one that was ended by a signal has failed.
pub(crate) fn code(status: ExitStatus) -> ExitCode {
    status.code().map_or(ExitCode::FAILURE, |code| u8::try_from(code).map_or(ExitCode::FAILURE, ExitCode::from))
}

fn watch(program: &str, args: &[&str]) -> io::Result<ExitStatus> {
    let mut command = Command::new(program);
    command.args(args);
    // Tests start `shibo` through `assert_cmd`, which also uses the runner of cargo.
    if let Some(variable) = env::var_os(VARIABLE) {
        command.env_remove(variable);
    }
    // Programs of documentation tests lie elsewhere and do not take the options of libtest. rustdoc tells them their own path, from
    // which they start a process for each test, but not if there is a runner.
    let path = Path::new(program);
    if !path.parent().is_some_and(|folder| folder.ends_with("deps")) {
        return command.env("RUSTDOC_DOCTEST_BIN_PATH", program).status();
    }
    command.args(["-Zunstable-options", "--report-time"]).env("RUSTC_BOOTSTRAP", "1");
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = name.rsplit_once('-').map_or(&*name, |(name, _)| name);
    let begin = Instant::now();
    let mut child = command.stdout(Stdio::piped()).spawn()?;
    let mut entries = Vec::new();
    let mut out = io::stdout().lock();
    let mut lines = BufReader::new(child.stdout.take().expect("the output is piped"));
    let mut bytes = Vec::new();
    // Tests may print bytes that are no text.
    while lines.read_until(b'\n', &mut bytes)? > 0 {
        out.write_all(&bytes)?;
        out.flush()?;
        entries.extend(Entry::test(name, &String::from_utf8_lossy(&bytes)));
        bytes.clear();
    }
    let status = child.wait()?;
    entries.push(Entry::program(name, begin.elapsed().as_secs_f64()));
    if let Some(path) = env::var_os(TIMES) {
        let text: String = entries.iter().map(line).collect();
        OpenOptions::new().create(true).append(true).open(path)?.write_all(text.as_bytes())?;
    }
    Ok(status)
}
