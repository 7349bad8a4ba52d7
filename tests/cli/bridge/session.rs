//! A running `shibo bridge`.
use crate::support::Desk;
use serde_json::Value as Json;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A test that waits longer for a line fails.
const PATIENCE: Duration = Duration::from_secs(120);

pub(super) struct Session {
    pub(super) bridge: Child,
    pub(super) stdin: Option<ChildStdin>,
    pub(super) lines: Receiver<String>,
    id: u64,
}

impl Session {
    pub(super) fn start(desk: &Desk) -> Self {
        std::fs::create_dir_all(desk.path("tmp")).unwrap();
        let mut command = desk.command(["bridge", "--threads", "2"]);
        command.env("TMPDIR", desk.path("tmp"));
        let mut bridge = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (stdin, stdout) = (bridge.stdin.take(), BufReader::new(bridge.stdout.take().unwrap()));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        Self { bridge, stdin, lines, id: 0 }
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.stdin.as_mut().unwrap().write_all(bytes).unwrap();
    }

    /// Sends a request; returns its id.
    pub(super) fn send(&mut self, mut request: Json) -> u64 {
        self.id += 1;
        request["id"] = self.id.into();
        self.bytes(format!("{request}\n").as_bytes());
        self.id
    }

    pub(super) fn receive(&mut self) -> Json {
        let line = self.lines.recv_timeout(PATIENCE).expect("the bridge is silent");
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    }

    /// The messages up to the first one for which `is_wanted`, without progress.
    pub(super) fn until(&mut self, is_wanted: impl Fn(&Json) -> bool) -> Vec<Json> {
        let mut messages = Vec::new();
        loop {
            let message = self.receive();
            if message["event"] == "progress" {
                continue;
            }
            let done = is_wanted(&message);
            messages.push(message);
            if done {
                return messages;
            }
        }
    }

    /// All messages up to the last one of a request.
    pub(super) fn all(&mut self, id: u64) -> Vec<Json> {
        self.until(|message| message["id"] == id && (message.get("ok").is_some() || message.get("error").is_some()))
    }

    /// The messages of a request.
    pub(super) fn ask(&mut self, request: Json) -> Vec<Json> {
        let id = self.send(request);
        self.all(id)
    }

    #[track_caller]
    pub(super) fn ok(&mut self, request: Json) -> Json {
        let last = self.ask(request).pop().unwrap();
        assert!(last.get("ok").is_some(), "{last}");
        last["ok"].clone()
    }

    /// The code of the error.
    #[track_caller]
    pub(super) fn refused(&mut self, request: Json) -> String {
        let last = self.ask(request).pop().unwrap();
        last["error"]["code"].as_str().unwrap_or_else(|| panic!("{last}")).to_owned()
    }

    /// Closes stdin, and waits for the end.
    pub(super) fn end(mut self, desk: &Desk) {
        drop(self.stdin.take());
        let rest: String = self.lines.iter().collect();
        assert_eq!(self.bridge.wait().unwrap().code(), Some(0), "{rest}");
        assert!(desk.names("tmp").is_empty(), "{:?}", desk.names("tmp"));
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let _ = self.bridge.kill();
    }
}
