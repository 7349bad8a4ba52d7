//! `shibo watch` as a process under test: its log and its server.
#![allow(dead_code, reason = "each test file uses a part of it")]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
pub(crate) mod browser;

use serde_json::Value as Json;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// The longest time a test waits before it fails: the machine may be busy.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// A graph with one grey output of 64², whose brightness is `value`.
pub(crate) fn plain(value: f64) -> String {
    format!(
        "(\n  version: 1,\n  canvas: (size_mm: 8, resolution: 64),\n  params: {{ \"low\": Number(default: 0.0, range: (0, 1), doc: \"The darkest\") }},\n  \
         nodes: {{\n    \"noise\": Perlin(size: 4),\n    \"grey\": Remap(input: \"noise\", from: (0, 1), to: (\"$low\", {value})),\n  }},\n  \
         outputs: {{ \"grey\": \"grey\" }},\n)\n"
    )
}

/// The SHA-256 of a content.
pub(crate) fn sha256(text: &[u8]) -> String {
    use sha2::{Digest, Sha256};
    Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// An event and when it was read.
pub(crate) struct Logged {
    pub(crate) at: Instant,
    pub(crate) json: Json,
}

/// A running watch.
pub(crate) struct Watch {
    child: Child,
    events: Receiver<Logged>,
    pub(crate) url: String,
    pub(crate) pid: u32,
}

impl Watch {
    /// Watches `graph`, with its cache beside it.
    pub(crate) fn start(graph: &Path, args: &[&str]) -> Self {
        Self::run(Command::new(env!("CARGO_BIN_EXE_shibo")), graph, args)
    }

    /// Starts it as a user without permission to read everything, if that is possible here.
    pub(crate) fn start_as_nobody(graph: &Path, args: &[&str]) -> Option<Self> {
        let nobody = || {
            let mut command = Command::new("setpriv");
            command.args(["--reuid=65534", "--regid=65534", "--clear-groups", env!("CARGO_BIN_EXE_shibo")]);
            command
        };
        let can = nobody().arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        can.is_ok_and(|status| status.success()).then(|| Self::run(nobody(), graph, args))
    }

    fn run(mut command: Command, graph: &Path, args: &[&str]) -> Self {
        let cache = graph.parent().unwrap().join(".cache");
        let mut child = command
            .arg("watch")
            .arg(graph)
            .args(["--no-open", "--log", "json", "--threads", "2", "--cache-dir"])
            .arg(&cache)
            .args(args)
            .env("XDG_CACHE_HOME", &cache)
            .env("XDG_RUNTIME_DIR", &cache)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let stdout = child.stdout.take().unwrap();
        let (sender, events) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                let json = serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: {line}"));
                if sender.send(Logged { at: Instant::now(), json }).is_err() {
                    break;
                }
            }
        });
        let pid = child.id();
        let mut watch = Self { child, events, url: String::new(), pid };
        let listening = watch.wait_for(|e| e["event"] == "listening");
        watch.url = listening.json["url"].as_str().unwrap().to_owned();
        watch
    }

    /// The next event that satisfies `wanted`; earlier ones are dropped.
    pub(crate) fn wait_for(&self, wanted: impl Fn(&Json) -> bool) -> Logged {
        let end = Instant::now() + PATIENCE;
        let mut passed = Vec::new();
        loop {
            match self.events.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(logged) if wanted(&logged.json) => return logged,
                Ok(logged) => passed.push(logged.json.to_string()),
                Err(e) => panic!("{e}; seen: {passed:#?}"),
            }
        }
    }

    /// Waits until the final picture of this content is shown.
    pub(crate) fn wait_shown(&self, text: &[u8]) -> Logged {
        let sha = sha256(text);
        self.wait_for(|e| e["event"] == "shown" && e["sha256"] == *sha && e["final"] == true)
    }

    /// Waits until the errors of this content are reported.
    pub(crate) fn wait_error(&self, text: &[u8]) -> Logged {
        let sha = sha256(text);
        self.wait_for(|e| e["event"] == "error" && e["sha256"] == *sha)
    }

    /// All events within the next `time`.
    pub(crate) fn during(&self, time: Duration) -> Vec<Json> {
        let end = Instant::now() + time;
        let mut events = Vec::new();
        loop {
            match self.events.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(logged) => events.push(logged.json),
                Err(RecvTimeoutError::Timeout) => return events,
                Err(e) => panic!("{e}"),
            }
        }
    }

    /// Port and token.
    pub(crate) fn address(&self) -> (u16, &str) {
        let rest = self.url.strip_prefix("http://127.0.0.1:").unwrap();
        let (port, token) = rest.split_once('/').unwrap();
        (port.parse().unwrap(), token.trim_end_matches('/'))
    }

    /// Sends bytes and reads the whole answer.
    pub(crate) fn raw(&self, request: &[u8]) -> Vec<u8> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.address().0)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // The server may have answered before all was sent.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        answer
    }

    /// GET of a path relative to the page: status and body.
    pub(crate) fn get(&self, path: &str) -> (u16, Vec<u8>) {
        let (port, token) = self.address();
        let request = format!("GET /{token}/{path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n");
        split(&self.raw(request.as_bytes()))
    }

    /// The initial state of the page.
    pub(crate) fn state(&self) -> Json {
        serde_json::from_slice(&self.get("state").1).unwrap()
    }

    /// Sets parameters as the page does.
    pub(crate) fn set(&self, body: &str) -> u16 {
        self.post("values", body).0
    }

    /// POST of a JSON text: status and body.
    pub(crate) fn post(&self, path: &str, body: &str) -> (u16, Vec<u8>) {
        let (port, token) = self.address();
        let request = format!(
            "POST /{token}/{path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        );
        split(&self.raw(request.as_bytes()))
    }

    /// A number of `/proc/PID/status`.
    pub(crate) fn status(&self, name: &str) -> u64 {
        let text = std::fs::read_to_string(format!("/proc/{}/status", self.pid)).unwrap();
        let line = text.lines().find_map(|l| l.strip_prefix(name)).unwrap();
        line.trim_start_matches(':').trim().trim_end_matches("kB").trim().parse().unwrap()
    }

    /// Open file handles.
    pub(crate) fn handles(&self) -> usize {
        std::fs::read_dir(format!("/proc/{}/fd", self.pid)).unwrap().count()
    }

    /// True while the process runs.
    pub(crate) fn is_alive(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Status and body of an answer; a chunked body is joined.
pub(crate) fn split(answer: &[u8]) -> (u16, Vec<u8>) {
    let end = answer.windows(4).position(|w| w == b"\r\n\r\n").map_or(answer.len(), |at| at + 4);
    let head = String::from_utf8_lossy(&answer[..end]).to_lowercase();
    let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or(0);
    let mut body = answer[end..].to_vec();
    if head.contains("transfer-encoding: chunked") {
        let mut rest = &body[..];
        let mut whole = Vec::new();
        while let Some(at) = rest.windows(2).position(|w| w == b"\r\n") {
            let length = usize::from_str_radix(&String::from_utf8_lossy(&rest[..at]), 16).unwrap_or(0);
            if length == 0 {
                break;
            }
            whole.extend_from_slice(&rest[at + 2..at + 2 + length]);
            rest = &rest[at + 4 + length..];
        }
        body = whole;
    }
    (status, body)
}

/// Path of a file that a browser downloads into `folder`, once it is complete.
pub(crate) fn downloaded(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    let end = Instant::now() + PATIENCE;
    // An empty file reserves the name until the download is complete.
    while !path.metadata().is_ok_and(|file| file.is_file() && file.len() > 0) {
        assert!(Instant::now() < end, "{name} is not downloaded");
        std::thread::sleep(Duration::from_millis(30));
    }
    path
}

/// A temporary folder with a graph file.
pub(crate) struct Place {
    pub(crate) dir: tempfile::TempDir,
    pub(crate) graph: PathBuf,
}

impl Place {
    pub(crate) fn new(text: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let graph = dir.path().join("graph.ron");
        std::fs::write(&graph, text).unwrap();
        Self { dir, graph }
    }

    /// A copy of the shipped graphs.
    pub(crate) fn shipped(name: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs");
        copy(&from, &dir.path().join("graphs"));
        let graph = dir.path().join("graphs").join(name);
        Self { dir, graph }
    }

    pub(crate) fn text(&self) -> String {
        std::fs::read_to_string(&self.graph).unwrap()
    }

    pub(crate) fn write(&self, text: &str) {
        std::fs::write(&self.graph, text).unwrap();
    }
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, &target).unwrap();
        }
    }
}
