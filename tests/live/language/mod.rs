//! A client of the language server, which talks to the real process.
#![allow(dead_code, clippy::unwrap_used, reason = "each test program uses a part of it; tests fail by panicking")]
use serde_json::{Value as Json, json};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// The longest time for an answer on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A server process, and its messages that no test has read yet.
pub(crate) struct Client {
    child: Child,
    stdin: Option<ChildStdin>,
    told: Receiver<Json>,
    waiting: VecDeque<Json>,
    next: i64,
    pub(crate) capabilities: Json,
}

/// The URI of a file.
pub(crate) fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

impl Client {
    /// Starts a server for a folder and offers `encodings`, if any.
    pub(crate) fn start(root: &Path, encodings: &[&str]) -> Self {
        Self::with(root, encodings, &json!({}))
    }

    /// The same with options.
    pub(crate) fn with(root: &Path, encodings: &[&str], options: &Json) -> Self {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin!("shibo"))
            .arg("lsp")
            .env("XDG_CACHE_HOME", root.join(".cache"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = child.stdin.take();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, told) = channel();
        std::thread::spawn(move || {
            while let Some(message) = read(&mut stdout) {
                if sender.send(message).is_err() {
                    return;
                }
            }
        });
        let mut client = Self { child, stdin, told, waiting: VecDeque::new(), next: 0, capabilities: Json::Null };
        let general = if encodings.is_empty() { json!({}) } else { json!({ "positionEncodings": encodings }) };
        let answer = client.ask(
            "initialize",
            &json!({
                "processId": null,
                "rootUri": uri(root),
                "initializationOptions": options,
                "capabilities": {
                    "general": general,
                    "textDocument": { "completion": { "completionItem": { "snippetSupport": true } } },
                    "workspace": { "workspaceEdit": { "resourceOperations": ["create"], "documentChanges": true }, "applyEdit": true },
                    "window": { "showDocument": { "support": true } },
                },
            }),
        );
        client.capabilities = answer["result"]["capabilities"].clone();
        client.tell("initialized", &json!({}));
        client
    }

    /// The server's process.
    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    fn write(&mut self, message: &Json) {
        let text = message.to_string();
        let stdin = self.stdin.as_mut().unwrap();
        write!(stdin, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        stdin.flush().unwrap();
    }

    /// Sends bytes without a header.
    pub(crate) fn raw(&mut self, bytes: &[u8]) {
        let stdin = self.stdin.as_mut().unwrap();
        stdin.write_all(bytes).unwrap();
        stdin.flush().unwrap();
    }

    /// Sends a notification.
    pub(crate) fn tell(&mut self, method: &str, params: &Json) {
        self.write(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// Sends a request without waiting for the answer, and gives its id.
    pub(crate) fn send(&mut self, method: &str, params: &Json) -> i64 {
        self.next += 1;
        let id = self.next;
        self.write(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        id
    }

    /// Answers a request of the server.
    pub(crate) fn respond(&mut self, id: &Json, result: &Json) {
        self.write(&json!({ "jsonrpc": "2.0", "id": id, "result": result }));
    }

    /// The answer to a request.
    pub(crate) fn answer(&mut self, id: i64) -> Json {
        self.wait(|message| message["id"] == id && message.get("method").is_none())
    }

    /// Sends a request and waits for the answer.
    pub(crate) fn ask(&mut self, method: &str, params: &Json) -> Json {
        let id = self.send(method, params);
        self.answer(id)
    }

    /// The result of a request.
    pub(crate) fn result(&mut self, method: &str, params: &Json) -> Json {
        let answer = self.ask(method, params);
        assert!(answer.get("error").is_none(), "{method}: {answer}");
        answer["result"].clone()
    }

    /// The first message that satisfies `wanted`; others are kept.
    pub(crate) fn wait(&mut self, wanted: impl Fn(&Json) -> bool) -> Json {
        if let Some(at) = self.waiting.iter().position(&wanted) {
            return self.waiting.remove(at).unwrap();
        }
        loop {
            let message = self.told.recv_timeout(PATIENCE).expect("the server answers");
            if wanted(&message) {
                return message;
            }
            self.waiting.push_back(message);
        }
    }

    /// The next message with this method, if it arrives in time.
    pub(crate) fn heard(&mut self, method: &str, within: Duration) -> Option<Json> {
        let end = std::time::Instant::now() + within;
        while let Ok(message) = self.told.recv_timeout(end.saturating_duration_since(std::time::Instant::now())) {
            self.waiting.push_back(message);
        }
        let at = self.waiting.iter().position(|message| message["method"] == method)?;
        self.waiting.remove(at)
    }

    /// Opens a text.
    pub(crate) fn open(&mut self, path: &Path, text: &str) {
        let doc = json!({ "uri": uri(path), "languageId": "ron", "version": 1, "text": text });
        self.tell("textDocument/didOpen", &json!({ "textDocument": doc }));
    }

    /// Replaces a text.
    pub(crate) fn change(&mut self, path: &Path, version: i64, text: &str) {
        let params = json!({
            "textDocument": { "uri": uri(path), "version": version },
            "contentChanges": [{ "text": text }],
        });
        self.tell("textDocument/didChange", &params);
    }

    /// Diagnostics of a version of a text.
    pub(crate) fn diagnostics(&mut self, path: &Path, version: i64) -> Vec<Json> {
        let uri = uri(path);
        let message = self.wait(|message| {
            message["method"] == "textDocument/publishDiagnostics"
                && message["params"]["uri"] == uri
                && message["params"]["version"] == version
        });
        message["params"]["diagnostics"].as_array().unwrap().clone()
    }

    /// A request at a position.
    pub(crate) fn at(&mut self, method: &str, path: &Path, (line, character): (usize, usize)) -> Json {
        let position = json!({ "line": line, "character": character });
        let mut params = json!({ "textDocument": { "uri": uri(path) }, "position": position });
        if method == "textDocument/references" {
            params["context"] = json!({ "includeDeclaration": true });
        }
        self.result(method, &params)
    }

    /// Shuts the server down properly.
    pub(crate) fn stop(mut self) {
        assert_eq!(self.result("shutdown", &Json::Null), Json::Null);
        self.tell("exit", &Json::Null);
        self.stdin = None;
        assert!(self.child.wait().unwrap().success());
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn read(stdout: &mut impl BufRead) -> Option<Json> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        if stdout.read_line(&mut line).ok()? == 0 {
            return None;
        }
        if let Some(count) = line.strip_prefix("Content-Length: ") {
            length = count.trim().parse().ok()?;
        }
        if line.trim().is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    stdout.read_exact(&mut body).ok()?;
    serde_json::from_slice(&body).ok()
}

/// Line and character (in UTF-16) of the `|` in a text, and the text without it.
pub(crate) fn cursor(text: &str) -> ((usize, usize), String) {
    let at = text.find('|').expect("a cursor");
    let before = &text[..at];
    let line = before.matches('\n').count();
    let start = before.rfind('\n').map_or(0, |i| i + 1);
    ((line, before[start..].encode_utf16().count()), text.replacen('|', "", 1))
}
