//! Latency of the language server: completion, hover and diagnostics of graphs of 60 and of 1,000 nodes, from the
//! request to the answer, including the pipes. Prints the median and the 95th percentile.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for developers")]
#[path = "../tests/live/language/mod.rs"]
mod language;

use language::{Client, uri};
use serde_json::json;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Number of measurements of each request.
const ROUNDS: usize = 200;

/// A graph with this number of nodes, in groups of three, as people write them.
fn graph(nodes: usize) -> String {
    let mut text = String::from(
        "(\n  version: 1,\n  canvas: (size_mm: 60, resolution: 1024),\n  params: {\n    \"pitch\": Number(default: 0.6, range: (0.1, 2), unit: \"mm\", doc: \"Size\"),\n  },\n  nodes: {\n    \"start\": Perlin(size: 4),\n",
    );
    let mut before = "start".to_owned();
    for i in 0..nodes / 3 {
        let _ =
            writeln!(text, "    \"noise_{i}\": Fractal(size: \"= $pitch * {}\", octaves: 3, seed: {i}),", i % 9 + 1);
        let _ = writeln!(text, "    \"soft_{i}\": Blur(input: \"noise_{i}\", radius: \"= $pitch * 0.2\"),");
        let _ = writeln!(text, "    \"height_{i}\": \"= {before} + 0.4 * soft_{i}\",");
        before = format!("height_{i}");
    }
    let _ = write!(text, "  }},\n  outputs: {{ \"height\": \"{before}\" }},\n)\n");
    text
}

fn shown(mut times: Vec<Duration>) -> String {
    times.sort();
    let at = |share: usize| times[(times.len() * share / 100).min(times.len() - 1)].as_secs_f64() * 1e3;
    format!("{:7.2} {:7.2}", at(50), at(95))
}

fn measure(nodes: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().canonicalize().unwrap().join("a.ron");
    let text = graph(nodes);
    let mut client = Client::with(path.parent().unwrap(), &[], &json!({ "pictures": "none" }));
    client.open(&path, &text);
    client.diagnostics(&path, 1);
    let line = text[..text.find(&format!("\"soft_{}\"", nodes / 6)).unwrap()].matches('\n').count();
    let (mut completion, mut hover, mut told) = (Vec::new(), Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        let version = 2 + i64::try_from(round).unwrap();
        let column = 29 + round % 3;
        let position = json!({ "line": line, "character": column });
        let edit = json!({ "range": { "start": position, "end": position }, "text": "x" });
        let doc = json!({ "uri": uri(&path), "version": version });
        let start = Instant::now();
        client.tell("textDocument/didChange", &json!({ "textDocument": doc, "contentChanges": [edit] }));
        client.diagnostics(&path, version);
        told.push(start.elapsed());
        let start = Instant::now();
        client.at("textDocument/completion", &path, (line, column));
        completion.push(start.elapsed());
        let start = Instant::now();
        client.at("textDocument/hover", &path, (line, 16));
        hover.push(start.elapsed());
    }
    for (what, times) in [("completion", completion), ("hover", hover), ("diagnostics", told)] {
        println!("{nodes:5} nodes  {what:12} {} ms", shown(times));
    }
    client.stop();
}

fn main() {
    println!("                          median     p95");
    measure(60);
    measure(1000);
}
