//! The times of operations on graphs against their bounds: `cargo bench -p shibo --bench lasting`, with `--features mcp` also those
//! of the server for agents. Each is the median of several runs. Prints `over` behind a time or a size over its bound.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for developers")]

use serde_json::{Value as Json, json};
use shibo_bridge::{CheckRequest, DiffRequest, GraphText, MergeRequest, Tools, check, diff, merge};
use shibo_engine::eval::CancelToken;
use shibo_graph::{Gate, syntax};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

/// Runs of each operation.
const ROUNDS: usize = 21;

/// A graph with this number of nodes, in groups of three, as people write them.
fn graph(nodes: usize) -> GraphText {
    let mut text = String::from(
        "(\n  version: 1,\n  canvas: (size_mm: 60, resolution: 1024),\n  params: {\n    \"pitch\": Number(default: 0.6, range: (0.1, 2), \
         unit: \"mm\", doc: \"Size\"),\n  },\n  nodes: {\n    \"start\": Perlin(size: 4),\n",
    );
    let mut before = "start".to_owned();
    for i in 0..nodes / 3 {
        text += &format!("    \"noise_{i}\": Fractal(size: \"= $pitch * {}\", octaves: 3, seed: {i}),\n", i % 9 + 1);
        text += &format!("    \"soft_{i}\": Blur(input: \"noise_{i}\", radius: \"= $pitch * 0.2\"),\n");
        text += &format!("    \"height_{i}\": \"= {before} + 0.4 * soft_{i}\",\n");
        before = format!("height_{i}");
    }
    text += &format!("  }},\n  outputs: {{ \"height\": \"{before}\" }},\n)\n");
    GraphText { path: "a.ron".into(), text }
}

fn changed(graph: &GraphText, from: &str, to: &str) -> GraphText {
    assert!(graph.text.contains(from), "{from}");
    GraphText { text: graph.text.replace(from, to), ..graph.clone() }
}

fn line(what: &str, value: f64, unit: &str, bound: Option<f64>) {
    let over = if bound.is_some_and(|bound| value > bound) { "  over" } else { "" };
    let bound = bound.map_or(String::new(), |bound| format!("  of {bound:4.0}"));
    println!("{what:44} {value:8.1} {unit:3}{bound}{over}");
}

/// The median of the times of an operation in ms.
fn median(rounds: usize, mut run: impl FnMut()) -> f64 {
    let one = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64() * 1e3
    };
    let mut times: Vec<f64> = (0..rounds).map(one).collect();
    times.sort_by(f64::total_cmp);
    times[rounds / 2]
}

fn operations() {
    let tools = Tools {
        registry: Arc::new(shibo_library::registry()),
        import_paths: Vec::new(),
        gate: Gate::default(),
        cancel: CancelToken::default(),
    };
    for (nodes, bound) in [(60, 20.0), (2000, 300.0)] {
        let before = graph(nodes);
        let renamed = changed(&changed(&before, "\"soft_7\"", "\"smooth\""), "* soft_7\"", "* smooth\"");
        let after = changed(&renamed, "octaves: 3, seed: 9)", "octaves: 4, seed: 9)");
        let request = DiffRequest { before: Some(before), after: Some(after), comments: false };
        assert_eq!(diff(&tools, &request).changes.len(), 2);
        line(&format!("diff of {nodes} nodes"), median(ROUNDS, || drop(diff(&tools, &request))), "ms", Some(bound));
    }
    for (nodes, bound) in [(60, Some(50.0)), (2000, None)] {
        let base = graph(nodes);
        let request = MergeRequest {
            ours: changed(&base, "octaves: 3, seed: 9)", "octaves: 4, seed: 9)").text,
            theirs: changed(&base, "octaves: 3, seed: 10)", "octaves: 5, seed: 10)").text,
            base: base.text,
            path: base.path,
            marker_size: 7,
        };
        assert!(merge(&tools, &request).is_clean());
        line(&format!("merge of {nodes} nodes"), median(ROUNDS, || drop(merge(&tools, &request))), "ms", bound);
    }
    let request = CheckRequest { graph: graph(60) };
    assert!(check(&tools, &request).diagnostics.iter().all(|one| one.warning));
    line("check of 60 nodes", median(ROUNDS, || drop(check(&tools, &request))), "ms", Some(15.0));
    // About the largest text that an agent may give.
    let request = CheckRequest { graph: graph(16_500) };
    let text = &request.graph.text;
    let size = text.len() / 1000;
    line(&format!("layout of {size} kB"), median(5, || drop(syntax::format(text))), "ms", None);
    line(&format!("check of {size} kB"), median(5, || drop(check(&tools, &request))), "ms", None);
}

/// A server and a client of it.
struct Client {
    server: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
    id: u64,
}

impl Client {
    /// `None` if the program was built without the server.
    fn start(cache: &Path) -> Option<Self> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_shibo"));
        command.arg("mcp").env("XDG_CACHE_HOME", cache).current_dir(cache).stderr(Stdio::null());
        let mut server = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (stdin, stdout) = (server.stdin.take().unwrap(), BufReader::new(server.stdout.take().unwrap()));
        let mut client = Self { server, stdin, stdout, id: 0 };
        let hello = json!({ "protocolVersion": "2025-11-25", "capabilities": {}, "clientInfo": { "name": "b", "version": "1" } });
        client.ask("initialize", &hello)?;
        writeln!(client.stdin, "{}", json!({ "jsonrpc": "2.0", "method": "notifications/initialized" })).unwrap();
        Some(client)
    }

    fn ask(&mut self, method: &str, params: &Json) -> Option<Json> {
        self.id += 1;
        let request = json!({ "jsonrpc": "2.0", "id": self.id, "method": method, "params": params });
        writeln!(self.stdin, "{request}").ok()?;
        let mut line = String::new();
        self.stdout.read_line(&mut line).ok()?;
        serde_json::from_str(&line).ok()
    }

    fn call(&mut self, tool: &str, arguments: &Json) {
        let answer = self.ask("tools/call", &json!({ "name": tool, "arguments": arguments })).unwrap();
        assert!(answer["result"]["isError"] != true && answer["error"].is_null(), "{answer}");
    }

    /// The resident memory of the server in MiB; not a number where the system does not tell.
    fn mib(&self) -> f64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.server.id())).unwrap_or_default();
        let rss = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        rss.and_then(|rss| rss.trim().strip_suffix(" kB")?.parse::<f64>().ok()).map_or(f64::NAN, |kib| kib / 1024.0)
    }
}

fn server() {
    let cache = tempfile::tempdir().unwrap();
    let start = Instant::now();
    let Some(mut client) = Client::start(cache.path()) else {
        println!("skipped: shibo mcp, this program was built without the feature `mcp`");
        return;
    };
    client.ask("tools/list", &json!({})).unwrap();
    line("list of tools after the start", start.elapsed().as_secs_f64() * 1e3, "ms", Some(50.0));
    let text = graph(60).text;
    let call = median(ROUNDS, || client.call("check", &json!({ "text": text })));
    line("call of check, 60 nodes", call, "ms", Some(15.0));
    for name in ["calf", "oak", "denim", "granite", "herringbone"] {
        let thumbnail = json!({ "path": format!("shibo:{name}"), "size": 256 });
        client.call("render", &thumbnail);
        let warm = median(5, || client.call("render", &thumbnail));
        line(&format!("warm thumbnail of {name}, 256 pixels"), warm, "ms", Some(300.0));
    }
    let before = client.mib();
    for round in 0..100 {
        let set = json!({ "path": "shibo:calf", "size": 128 + round % 3 });
        client.call("render", &set);
        client.call("check", &json!({ "text": text }));
    }
    line("growth of memory in 200 calls", client.mib() - before, "MiB", Some(100.0));
    drop(client.stdin);
    client.server.wait().unwrap();
}

fn main() {
    operations();
    server();
}
