//! A long session of `shibo watch`: `cargo bench -p shibo --bench watch`. 2,100 saves of `calf.ron` at 512², each with
//! another value of a late parameter, with `--memory 256`: the time from a save to its final picture, and the memory
//! after every 100 saves. It may grow by 64 MiB after the first 100. `SHIBO_BENCH_SAVES=300` saves less often. Linux
//! only: memory is read from `/proc`.
use serde_json::Value as Json;
use sha2::{Digest, Sha256};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Allowed growth of memory after the first 100 saves, in MiB.
const GROWTH: u64 = 64;

/// A process that is killed at the end of the benchmark.
struct Watch(Child);

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Watch {
    /// Memory in use, in MiB.
    fn memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.0.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok()).map_or(0, |kib| kib >> 10)
    }
}

/// Waits for the final lit picture of a content.
fn shown(events: &mut impl Iterator<Item = String>, text: &str) {
    let sha: String = Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect();
    for line in events {
        let event: Json = serde_json::from_str(&line).expect("a line of JSON");
        assert_ne!(event["event"], "error", "{line}");
        if event["event"] == "shown" && event["sha256"] == *sha && event["output"] == "lit" && event["final"] == true {
            return;
        }
    }
    panic!("shibo ended");
}

fn main() {
    let saves = std::env::var("SHIBO_BENCH_SAVES").ok().and_then(|n| n.parse().ok()).unwrap_or(2_100_u32);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("lib")).expect("a folder");
    for entry in std::fs::read_dir(root.join("lib")).expect("the libraries").map_while(Result::ok) {
        std::fs::copy(entry.path(), folder.path().join("lib").join(entry.file_name())).expect("a library");
    }
    let text = std::fs::read_to_string(root.join("calf.ron"))
        .expect("the graph")
        .replace("resolution: 2048", "resolution: 512");
    let late = "\"roughness\": Number(default: 0.42";
    assert!(text.contains(late) && text.contains("resolution: 512"), "another graph");
    let path = folder.path().join("calf.ron");
    std::fs::write(&path, &text).expect("a file");
    let child = Command::new(env!("CARGO_BIN_EXE_shibo"))
        .arg("watch")
        .arg(&path)
        .args(["--no-open", "--log", "json", "--threads", "2", "--memory", "256", "--cache-dir"])
        .arg(folder.path().join("cache"))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the command is built");
    let mut watch = Watch(child);
    let mut events = BufReader::new(watch.0.stdout.take().expect("a pipe")).lines().map_while(Result::ok);
    shown(&mut events, &text);
    let (mut times, mut first, mut most) = (Vec::<Duration>::new(), 0, 0);
    for k in 1..=saves {
        let edited = text.replace(late, &format!("\"roughness\": Number(default: {:.5}", 0.3 + 1e-4 * f64::from(k)));
        let start = Instant::now();
        std::fs::write(&path, &edited).expect("a file");
        shown(&mut events, &edited);
        times.push(start.elapsed());
        if k == 100 {
            first = watch.memory();
        }
        if k % 100 == 0 {
            most = most.max(watch.memory());
        }
    }
    times.sort_unstable();
    let at = |percent: usize| times[(times.len() * percent / 100).min(times.len() - 1)].as_millis();
    println!(
        "{saves} saves, each to its final picture: median {} ms, 95 % {} ms, worst {} ms",
        at(50),
        at(95),
        at(100)
    );
    let grown = most.saturating_sub(first);
    println!("memory: {first} MiB after 100 saves, at most {most} MiB later: {grown} MiB more (at most {GROWTH})");
    assert!(grown <= GROWTH, "it keeps too much");
}
