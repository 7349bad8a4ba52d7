//! Checks and repairs of damaged texts of 1 MB: `cargo bench -p shibo --bench damaged`. No text may take more than about a second of
//! processor time. Texts over two seconds are marked.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for developers")]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Bytes of a text.
const SIZE: usize = 1_000_000;
/// A slow answer in seconds.
const SLOW: f64 = 2.0;

/// Parts that are repeated for a whole text.
const WHOLE: [&str; 20] = [
    "/*",
    "/* */",
    "\"",
    "\"\n",
    "\"a\" ",
    "\"a\": ",
    "'",
    "'a' ",
    "(",
    "(\"",
    "r#\"a, ",
    "{\"type\": \"Perlin\", ",
    "```\n",
    "a = 1; ",
    "<<<<<<< a\n",
    "<<<<<<< a\n=======\n>>>>>>> b\n",
    "5mm ",
    "$a ",
    "a::b ",
    "é\"",
];

/// Parts that are repeated in a formula.
const FORMULA: [&str; 8] = ["(", "a + ", "a ", "(a, ", "f(", "/*", "-", "let a = 1; "];

/// Nodes with faults; `#` stands for a number.
const NODES: [&str; 8] = [
    "\"n#\": Perlim(sise: #, sead: \"x\"),\n",
    "\"n#\": Blur(input: \"m#\", radus: #),\n",
    "\"n#\": Use(graph: \"g#\"),\n",
    "\"n#\": \"= (1 + (a\",\n",
    "\"n\": Perlin(size: 3),\n",
    "\"n#\": Blur(input: 5, radius: \"#mm\"),\n",
    "\"n#\": Perlin(size: (#,\n",
    "\"n#\": Perlin(),\n",
];

fn texts() -> Vec<(String, String)> {
    let graph = |nodes: &str| format!("(\n  nodes: {{\n{nodes}  }},\n  outputs: {{ \"a\": \"n0\" }},\n)\n");
    let mut texts: Vec<(String, String)> =
        WHOLE.map(|part| (format!("{part:?}"), part.repeat(SIZE / part.len()))).into_iter().collect();
    texts.push(("quotes in one line".to_owned(), format!("{}\"", "\"a\" ".repeat(SIZE / 4))));
    for part in FORMULA {
        let node = format!("    \"a\": \"= {}\",\n", part.repeat(SIZE / part.len()));
        texts.push((format!("formula of {part:?}"), graph(&node)));
    }
    for node in NODES {
        let count = SIZE / (node.len() + 8);
        let nodes: String = (0..count).map(|index| node.replace('#', &index.to_string())).collect();
        texts.push((format!("nodes {:?}", node.trim_end()), graph(&nodes)));
        let few: String = (0..60).map(|index| node.replace('#', &index.to_string())).collect();
        texts.push((format!("60 nodes {:?}", node.trim_end()), graph(&few)));
    }
    texts
}

fn seconds(folder: &Path, args: &[&str]) -> f64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shibo"));
    command.current_dir(folder).args(args).arg("a.ron");
    let start = Instant::now();
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
    start.elapsed().as_secs_f64()
}

fn main() {
    let folder = tempfile::tempdir().unwrap();
    println!("{:44} {:>8} {:>8} {:>8}", "seconds", "check", "json", "fix");
    for (name, text) in texts() {
        std::fs::write(folder.path().join("a.ron"), text).unwrap();
        let commands: [&[&str]; 3] =
            [&["check"], &["check", "--format", "json"], &["check", "--fix=likely", "--dry-run"]];
        let taken = commands.map(|args| seconds(folder.path(), args));
        let mark = if taken.iter().any(|taken| *taken > SLOW) { "  slow" } else { "" };
        println!("{name:44} {:8.2} {:8.2} {:8.2}{mark}", taken[0], taken[1], taken[2]);
    }
}
