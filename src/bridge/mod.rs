//! `shibo bridge`: answers programs in other languages over stdin and stdout, one JSON object per line.
//!
//! One thread reads requests and answers those that need no work. Each slot with work has a thread; one more thread watches files.
mod files;
mod lanes;
mod language;
mod output;
#[cfg(test)]
mod tests;
mod watch;

use crate::args::EngineArgs;
use crate::interrupt;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::Args;
use files::Files;
use lanes::Lanes;
use language::{Language, Pending};
use output::Output;
use serde_json::{Value as Json, json};
use shibo_bridge::host::{Asked, Host, MOST_BYTES};
use shibo_bridge::scene::lock;
use shibo_picture::contained;
use std::io::{self, BufRead, ErrorKind, Read, Write};
use std::sync::Mutex;
use std::thread::Scope;
use std::time::Duration;
use watch::Watch;

const EXAMPLES: &str = "\
Examples:
  echo '{\"id\":1,\"op\":\"hello\"}' | shibo bridge

docs/protocol.md describes the messages. Pictures are files in a temporary folder, which is removed at the end.";

/// Interval of the event that tests whether the other program still reads, after the end of the input.
const ENDING: Duration = Duration::from_secs(1);

/// Answer programs in other languages.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct BridgeArgs {
    #[command(flatten)]
    engine: EngineArgs,
}

/// The parts that all threads use.
struct Bridge<'o> {
    host: Mutex<Host>,
    output: Output<'o>,
    files: Files,
    lanes: Lanes,
    watch: Watch,
    pending: Pending,
}

/// Runs the command.
pub(crate) fn run(args: &BridgeArgs, terminal: &Terminal) -> Result<(), Quit> {
    let failed = |error: io::Error| Quit::failed(format!("the connection failed: {error}"));
    let files = Files::new().map_err(failed)?;
    let folder = files.folder().to_owned();
    interrupt::on_signals(move || {
        // The folder is all that would stay behind.
        // Other threads may still write into it.
        for _ in 0..20 {
            let _ = std::fs::remove_dir_all(&folder);
            if !folder.exists() {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        std::process::exit(1);
    });
    let host = Host::new(open::session(library::registry(), &args.engine, terminal)?, library::tools());
    serve(host, files, &mut io::stdin().lock(), &mut io::stdout()).map_err(failed)
}

/// Answers all lines of the input. Unfinished work goes on after its end, until the other program reads no more.
fn serve(host: Host, files: Files, input: &mut dyn BufRead, output: &mut (dyn Write + Send)) -> io::Result<()> {
    let output = Output::new(output);
    let bridge = Bridge {
        host: Mutex::new(host),
        output,
        files,
        lanes: Lanes::default(),
        watch: Watch::default(),
        pending: Pending::default(),
    };
    let read = std::thread::scope(|scope| {
        scope.spawn(|| watch::run(&bridge));
        let mut language = Language::default();
        let read = bridge.read(scope, input, &mut language);
        while !bridge.lanes.wait(ENDING) {
            bridge.send_event("ending");
        }
        // Without a connection the server ends, after the messages that it has.
        drop(language);
        bridge.watch.stop();
        read
    });
    match bridge.output.error() {
        // The program that asked is gone.
        Some(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Some(error) => Err(error),
        None => read,
    }
}

impl Bridge<'_> {
    /// Reads requests until the input ends, or the other program reads no more.
    fn read<'s>(
        &'s self,
        scope: &'s Scope<'s, '_>,
        input: &mut dyn BufRead,
        language: &mut Language,
    ) -> io::Result<()> {
        let mut line = Vec::new();
        while !self.output.is_closed() {
            line.clear();
            if input.take(MOST_BYTES as u64 + 2).read_until(b'\n', &mut line)? == 0 {
                return Ok(());
            }
            if line.ends_with(b"\n") {
                line.pop();
            } else if line.len() > MOST_BYTES {
                // The host refuses the line for its length. Its rest is skipped.
                input.skip_until(b'\n')?;
            }
            if !line.trim_ascii().is_empty() {
                self.answer(scope, &line, language);
            }
        }
        Ok(())
    }

    fn answer<'s>(&'s self, scope: &'s Scope<'s, '_>, line: &[u8], language: &mut Language) {
        let asked = contained(|| lock(&self.host).ask(line)).unwrap_or_else(|said| {
            let id = serde_json::from_slice::<Json>(line).ok().and_then(|request| request["id"].as_u64());
            Asked::Answer(Host::refused(id, "defect", &format!("there is a defect: {said}")))
        });
        match asked {
            Asked::Answer(mut answer) => {
                if let Some(hello) = answer.json.get_mut("ok").filter(|ok| ok.get("protocol").is_some()) {
                    hello["folder"] = self.files.folder().display().to_string().into();
                }
                let opened = answer.json.get("ok").and_then(|ok| ok.get("graph")?.as_str().map(str::to_owned));
                match opened.filter(|_| is_watched(line)) {
                    Some(graph) => {
                        // The thread that watches locks both, so only one lock is held here.
                        let files = lock(&self.host).files(&graph);
                        // A save after the answer must be seen, so the files are recorded before it.
                        self.watch.add(&graph, &files, || self.send(answer.json.into()));
                    }
                    None => self.send(answer.json.into()),
                }
            }
            Asked::Job(job) => {
                let id = job.id();
                if !self.lanes.put(scope, self, job) {
                    let message = "too many requests wait; wait for answers before asking more";
                    self.send(Host::refused(id, "busy", message).json.into());
                }
            }
            Asked::Cancel { of, answer } => {
                self.lanes.cancel(of);
                self.send(answer.json.into());
            }
            Asked::Free { files, answer } => {
                for (slot, place) in self.files.free(&files) {
                    lock(&self.host).forget(&slot, &place);
                }
                self.send(answer.json.into());
            }
            Asked::Lsp { id, message, .. } => language.send(scope, self, id, message),
        }
    }

    /// Sends a message. If the other program reads no more, all work is stopped.
    fn send(&self, message: Json) {
        if !self.output.send(&message) {
            self.lanes.cancel_all();
        }
    }

    fn send_event(&self, event: &str) {
        self.send(json!({ "event": event }));
    }
}

/// True for a request whose graph is to be watched.
fn is_watched(line: &[u8]) -> bool {
    serde_json::from_slice::<Json>(line).is_ok_and(|request| request["watch"] == true && request["op"] == "open")
}
