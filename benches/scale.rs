//! Cost of pictures in parts, large pictures and sweeps: `cargo bench -p shibo --bench scale`. CPU time of whole
//! processes, user and system, as counted by the system for ended processes; so other load on the machine matters
//! little.
//!
//! `SHIBO_BENCH_LARGE=1` takes 8192² in 16 parts, 16384², and 100 variants (about ten CPU minutes, 2 GB of disk), and
//! `SHIBO_BENCH_HUGE=1` renders 65536² too (an hour, 40 GB).
use std::path::Path;
use std::process::{Command, Stdio};

/// Clock ticks per second, on every Linux.
const TICKS: f64 = 100.0;

/// CPU seconds of all processes that have ended.
fn ended() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("a system that counts");
    let numbers: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    // The 16th and the 17th field of the line; the first two fields end at the bracket.
    let ticks: f64 = numbers[13..15].iter().filter_map(|n| n.parse::<f64>().ok()).sum();
    ticks / TICKS
}

/// The CPU seconds of a command, and its peak memory in MiB, if reported.
fn run(dir: &Path, line: &str) -> (f64, f64) {
    let before = ended();
    let output = Command::new(env!("CARGO_BIN_EXE_shibo"))
        .args(line.split_whitespace())
        .current_dir(dir)
        .stderr(Stdio::null())
        .output()
        .expect("the command is built");
    assert!(output.status.success(), "{line}");
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (ended() - before, stats["peak_rss_mib"].as_f64().unwrap_or(f64::NAN))
}

/// A picture by one process, and by one process per part, with the parts not in the order of the rows.
fn parts(dir: &Path, graph: &str, (size, count): (u32, u32)) {
    let (whole, peak) = run(dir, &format!("render {graph} --resolution {size} --no-cache -o whole --stats json"));
    println!("{graph} {size}: {whole:.1} CPU s, {peak:.0} MiB");
    let (prepare, _) = run(dir, &format!("prepare {graph} --resolution {size} --cache-dir c"));
    let (mut all, mut most) = (0.0, 0.0_f64);
    for number in (0..count).map(|n| n * 7 % count + 1) {
        let part =
            format!("render {graph} --resolution {size} --cache-dir c --part {number}/{count} -o parts --stats json");
        let (cpu, peak) = run(dir, &part);
        (all, most) = (all + cpu, most.max(peak));
    }
    let (join, _) = run(dir, "join parts -o joined --remove");
    let ratio = (prepare + all + join) / whole;
    println!(
        "  in {count} parts: prepare {prepare:.1}, parts {all:.1} ({most:.0} MiB), join {join:.1} CPU s, {ratio:.2} times as much in all"
    );
    for entry in std::fs::read_dir(dir.join("whole")).expect("pictures").flatten() {
        let other = dir.join("joined").join(entry.file_name());
        assert!(std::fs::read(entry.path()).ok() == std::fs::read(other).ok(), "{:?}", entry.file_name());
    }
    ["c", "whole", "joined"].into_iter().for_each(|name| drop(std::fs::remove_dir_all(dir.join(name))));
}

/// The height of calf as tiled EXR with levels.
const HEIGHT: &str = r#"( version: 1, canvas: (size_mm: 60, resolution: 4096, tile: Both, seed: 7), imports: { "calf": "shibo:calf" },
  nodes: { "calf": Use(graph: "calf"), "height": "= calf.height" },
  outputs: { "height": File(from: "height", format: Exr, mip: true) } )"#;

fn height(dir: &Path, sizes: &[u32]) {
    std::fs::write(dir.join("height.ron"), HEIGHT).expect("the folder can be written");
    let mut first = f64::NAN;
    for size in sizes {
        let (cpu, peak) = run(dir, &format!("render height.ron --resolution {size} --no-cache -o h --stats json"));
        let pixel = cpu / f64::from(*size) / f64::from(*size) * 1e9;
        if first.is_nan() {
            first = pixel;
        }
        println!("height of calf {size}: {cpu:.1} CPU s, {peak:.0} MiB, {:.2} times as much a pixel", pixel / first);
    }
}

/// Variants of calf: by seed they share nothing, by colour and gloss everything else.
fn sweeps(dir: &Path, count: u32) {
    let (one, _) = run(dir, "render shibo:calf --resolution 512 --no-cache -o one --stats json");
    let half = count / 2;
    for (what, sweep) in [
        ("seeds", format!("--sweep seed=1..{count}")),
        ("roughnesses and presets", format!("--sweep roughness=0.1..0.9/{half} --sweep preset=black,oxblood")),
    ] {
        let (cpu, _) = run(dir, &format!("render shibo:calf --resolution 512 --cache-dir c -o many {sweep}"));
        let (minute, shared) = (f64::from(count) / cpu * 60.0, 100.0 * (1.0 - cpu / (one * f64::from(count))));
        println!(
            "{count} {what} of calf 512²: {minute:.0} variants a CPU minute, {shared:.0} % of one by one is spared"
        );
        let (again, _) = run(dir, &format!("render shibo:calf --resolution 512 --cache-dir c -o many {sweep}"));
        println!("  the same again, of which nothing is missing: {again:.1} CPU s");
        ["c", "many"].into_iter().for_each(|name| drop(std::fs::remove_dir_all(dir.join(name))));
    }
}

fn main() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let dir = dir.path();
    let is_set = |name: &str| std::env::var_os(name).is_some();
    let large = is_set("SHIBO_BENCH_LARGE");
    for graph in ["shibo:calf", "shibo:oak_cuts"] {
        parts(dir, graph, if large { (8192, 16) } else { (4096, 8) });
    }
    let mut sizes = vec![4096];
    sizes.extend(large.then_some(16_384));
    sizes.extend(is_set("SHIBO_BENCH_HUGE").then_some(65_536));
    height(dir, &sizes);
    sweeps(dir, if large { 100 } else { 20 });
}
