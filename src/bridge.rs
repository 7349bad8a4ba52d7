//! `shibo bridge`: answers programs in other languages over stdin and stdout, one JSON object per line.
use crate::args::EngineArgs;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::Args;
use serde_json::Value as Json;
use shibo_bridge::host::{Host, MOST_BYTES, Message};
use std::io::{self, BufRead, ErrorKind, Read, Write};
use std::path::PathBuf;
use tempfile::TempDir;

const EXAMPLES: &str = "\
Examples:
  echo '{\"id\":1,\"op\":\"hello\"}' | shibo bridge

docs/protocol.md describes the messages. Pictures are files in a temporary folder, which is removed at the end of the input.";

/// Answer programs in other languages.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct BridgeArgs {
    #[command(flatten)]
    engine: EngineArgs,
}

/// The files of the last two renders.
struct Files {
    folder: TempDir,
    count: u64,
    before: Vec<PathBuf>,
    now: Vec<PathBuf>,
}

impl Files {
    /// Completes a message: samples become a file, and `hello` tells the folder.
    fn complete(&mut self, message: Message) -> io::Result<Json> {
        let mut json = message.json;
        if let Some(bytes) = message.bytes {
            self.count += 1;
            let path = self.folder.path().join(format!("{}.f32", self.count));
            std::fs::write(&path, bytes)?;
            json.insert("file".into(), path.display().to_string().into());
            self.now.push(path);
        }
        if let Some(hello) = json.get_mut("ok").filter(|ok| ok.get("protocol").is_some()) {
            hello["folder"] = self.folder.path().display().to_string().into();
        }
        Ok(json.into())
    }

    /// Ends a request: a render replaces the files of the render before.
    fn end(&mut self) {
        if !self.now.is_empty() {
            let before = std::mem::replace(&mut self.before, std::mem::take(&mut self.now));
            before.iter().for_each(|path| drop(std::fs::remove_file(path)));
        }
    }
}

/// Runs the command.
pub(crate) fn run(args: &BridgeArgs, terminal: &Terminal) -> Result<(), Quit> {
    let failed = |error: io::Error| Quit::failed(format!("the connection failed: {error}"));
    let folder = tempfile::Builder::new().prefix("shibo-").tempdir().map_err(failed)?;
    let mut files = Files { folder, count: 0, before: Vec::new(), now: Vec::new() };
    let mut host = Host::new(open::session(library::registry(), &args.engine, terminal)?, library::tools());
    match answer(&mut host, &mut files, &mut io::stdin().lock(), &mut io::stdout().lock()) {
        // The program that asked is gone.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done.map_err(failed),
    }
}

/// Answers all lines of the input.
fn answer(host: &mut Host, files: &mut Files, input: &mut dyn BufRead, output: &mut dyn Write) -> io::Result<()> {
    let mut line = Vec::new();
    loop {
        line.clear();
        if input.take(MOST_BYTES as u64 + 2).read_until(b'\n', &mut line)? == 0 {
            return Ok(());
        }
        if !line.ends_with(b"\n") && line.len() > MOST_BYTES {
            // The host refuses the line for its length. Its rest is skipped.
            input.skip_until(b'\n')?;
        }
        if line.trim_ascii().is_empty() {
            continue;
        }
        host.ask(&line);
        while let Some(message) = host.step() {
            serde_json::to_writer(&mut *output, &files.complete(message)?)?;
            output.write_all(b"\n")?;
            output.flush()?;
        }
        files.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_engine::session::{Session, Settings};

    #[test]
    fn answers_lines_and_keeps_the_files_of_the_last_render() {
        let session = Session::new(library::registry(), &Settings { threads: 1, ..Settings::default() }).unwrap();
        let mut host = Host::new(session, library::tools());
        let folder = tempfile::tempdir().unwrap();
        let mut files = Files { folder, count: 0, before: Vec::new(), now: Vec::new() };
        let render = "{\"id\":3,\"op\":\"render\",\"graph\":\"g1\",\"sizes\":[16]}\n";
        let text = r#"(version: 1, canvas: (size_mm: (8, 8), resolution: (8, 8)), nodes: { "a": Perlin() }, outputs: { "a": "a" })"#;
        let open = format!("{}\n", serde_json::json!({ "id": 2, "op": "open", "text": text }));
        let long = format!("{}\n", "x".repeat(MOST_BYTES + 99));
        let input = ["{\"id\":1,\"op\":\"hello\"}\n\n", &open, render, &long, render, render].concat();
        let mut output = Vec::new();
        answer(&mut host, &mut files, &mut input.as_bytes(), &mut output).unwrap();
        let lines: Vec<Json> = output
            .split(|byte| *byte == b'\n')
            .filter(|line| !line.is_empty())
            .map(|line| serde_json::from_slice(line).unwrap())
            .collect();
        assert_eq!(lines[0]["ok"]["folder"], files.folder.path().display().to_string());
        assert_eq!(lines[2]["event"], "picture", "{}", lines[1]);
        assert_eq!((&lines[3]["id"], &lines[3]["ok"]["computed"]), (&3.into(), &1.into()));
        assert_eq!((&lines[4]["id"], &lines[4]["error"]["code"]), (&Json::Null, &"too-large".into()));
        let file = |line: usize| std::fs::read(lines[line]["file"].as_str().unwrap());
        assert!(file(2).is_err());
        assert_eq!((file(5).unwrap(), file(7).unwrap().len()), (file(7).unwrap(), 16 * 16 * 4));
    }
}
