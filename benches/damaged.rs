//! Checks and repairs of damaged texts, most of 1 MB: `cargo bench -p shibo --bench damaged`. No command may take more than a second of
//! processor time, its start included; `ide/src/fixes/budget.rs` bounds the work. Texts that take longer are marked. The last line names
//! the slowest command. Where the system does not tell processor times, the times are those of a clock.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for developers")]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Bytes of a text.
const SIZE: usize = 1_000_000;
/// The longest time of a command in seconds.
const SLOW: f64 = 1.0;
/// The ticks of a second in `/proc`.
const TICKS: f64 = 100.0;

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
        let many = |count: usize| (0..count).map(|index| node.replace('#', &index.to_string())).collect::<String>();
        // A few nodes end at the number of trials, and 500 at the number of findings.
        for (count, name) in [(SIZE / (node.len() + 8), ""), (60, "60 "), (500, "500 ")] {
            texts.push((format!("{name}nodes {:?}", node.trim_end()), graph(&many(count))));
        }
    }
    // A sign is lost in a text without other faults: its place is searched by the syntax of many texts.
    let node = |index: usize| format!("\"n{index}\": Perlin(size: 3),\n");
    for count in [60, 500, SIZE / 28] {
        let sound = graph(&(0..count).map(node).collect::<String>());
        let middle = format!("\"n{}\": Perlin(size: 3),", count / 2);
        for (lost, without) in [(")", middle.replace("),", ",")), ("quote", middle.replace("\":", ":"))] {
            texts.push((format!("{count} nodes without a {lost}"), sound.replace(&middle, &without)));
        }
    }
    texts
}

/// The processor time of all commands that have ended, in seconds.
fn used() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in brackets, may have blanks. The times of children are the fields 16 and 17.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(13);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS)
}

fn seconds(folder: &Path, args: &[&str]) -> f64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_shibo"));
    command.current_dir(folder).args(args).arg("a.ron");
    let (before, start) = (used(), Instant::now());
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
    let taken = before.and_then(|before| Some(used()? - before));
    taken.unwrap_or_else(|| start.elapsed().as_secs_f64())
}

fn main() {
    let folder = tempfile::tempdir().unwrap();
    println!("{:44} {:>8} {:>8} {:>8}", "seconds", "check", "json", "fix");
    let mut slowest = (0.0, String::new());
    for (name, text) in texts() {
        std::fs::write(folder.path().join("a.ron"), text).unwrap();
        let commands: [&[&str]; 3] =
            [&["check"], &["check", "--format", "json"], &["check", "--fix=likely", "--dry-run"]];
        let taken = commands.map(|args| seconds(folder.path(), args));
        let mark = if taken.iter().any(|taken| *taken > SLOW) { "  slow" } else { "" };
        println!("{name:44} {:8.2} {:8.2} {:8.2}{mark}", taken[0], taken[1], taken[2]);
        for (taken, command) in taken.into_iter().zip(commands) {
            if taken > slowest.0 {
                slowest = (taken, format!("{} of {name}", command.join(" ")));
            }
        }
    }
    println!("slowest: {:.2} s, {}", slowest.0, slowest.1);
}
