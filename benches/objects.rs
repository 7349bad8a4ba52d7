//! Bodies, films and reliefs: `cargo bench -p shibo --bench objects`. Whole commands make them of the heights of `calf`. Plates,
//! rolls and films read the heights from an EXR file that a run before wrote, because their targets are for heights that exist.
//! The CPU time includes the start and the reading. The minimum of several runs on one thread. Each line has the ratio to its
//! target; 1 or less meets it.
#![allow(clippy::disallowed_methods, reason = "figures that are told")]
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

const RUNS: usize = 5;

/// Nodes and outputs beside those of `calf`.
const NODES: &str = r#"
    "drafted": Draft(input: "height", steepest: 20),
    "ball": MeshShape(shape: Sphere, size: (60, 60, 60)),
    "atlas": MeshAtlas(mesh: "ball"),
    "place": BakePosition(atlas: "atlas"),
    "carved": DisplaceMesh(atlas: "atlas", height: "= 0.6 * noise(place.r, place.g, place.b)", error: 0.01),
    "lit": Relief("#;
const OUTPUTS: &str = r#"outputs: {
    "exact": File(from: "height", format: Exr),
    "steep": File(from: "drafted", format: Exr),
    "carved": Model(mesh: "carved", report: true),
    "#;

/// Bodies of the heights in a file.
const BODIES: &str = r#"(
  canvas: (size_mm: 60, resolution: 2048, tile: Both),
  nodes: { "file": Image(path: "out/exact.exr", size_mm: (60, 60), filter: Nearest), "height": "= 1 * file" },
  outputs: {
    "fewest": Plate(height: "height", report: true),
    "even": Plate(height: "height", pattern: Even, report: true),
    "roll": Roll(height: "height", around: 1, report: true),
    "films": Films(height: "height", films: 8),
  },
)"#;

/// Figures of a command.
struct Ran {
    wall: f64,
    cpu: f64,
    stats: serde_json::Value,
}

fn render(dir: &Path, (file, output): (&str, &str), more: &[&str]) -> Ran {
    let start = Instant::now();
    let ran = Command::new(env!("CARGO_BIN_EXE_shibo"))
        .args(["render", file, "-o", "out", "--stats", "json", "--output", output])
        .args(more)
        .current_dir(dir)
        .stderr(Stdio::null())
        .output()
        .expect("the command is built");
    assert!(ran.status.success(), "{output}");
    let stats: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap_or_default();
    Ran { wall: start.elapsed().as_secs_f64(), cpu: stats["cpu_s"].as_f64().unwrap_or(f64::NAN), stats }
}

/// The minimum of several runs.
fn least(measure: impl Fn() -> f64) -> f64 {
    (0..RUNS).map(|_| measure()).fold(f64::INFINITY, f64::min)
}

fn told(what: &str, value: f64, unit: &str, most: f64) {
    println!("{what:<52} {value:>10.2} {unit:<13} {:>6.2} of the target", value / most);
}

/// The triangles in the report of an output.
fn triangles(dir: &Path, output: &str) -> f64 {
    let text = std::fs::read_to_string(dir.join(format!("out/{output}_report.json"))).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    report["triangles"].as_f64().unwrap_or(f64::NAN)
}

fn main() {
    let dir = tempfile::tempdir().expect("a folder");
    let (dir, graphs) = (dir.path(), Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs"));
    std::fs::create_dir(dir.join("lib")).expect("the folder takes folders");
    for file in std::fs::read_dir(graphs.join("lib")).expect("the shipped graphs").flatten() {
        if file.path().is_file() {
            std::fs::copy(file.path(), dir.join("lib").join(file.file_name())).expect("the folder takes files");
        }
    }
    let calf = std::fs::read_to_string(graphs.join("calf.ron")).expect("a shipped graph");
    let graph = calf.replace("\"lit\": Relief(", NODES.trim_start()).replace("outputs: {", OUTPUTS);
    std::fs::write(dir.join("a.ron"), graph).expect("the folder takes files");

    let (one, cached) = (["--threads", "1"], ["--threads", "1", "--cache-dir", "cache"]);
    render(dir, ("a.ron", "exact"), &cached);
    std::fs::write(dir.join("bodies.ron"), BODIES).expect("the folder takes files");
    let body = |output: &str, threads: &str| render(dir, ("bodies.ron", output), &["--threads", threads, "--no-cache"]);
    let cpu = |output: &str| least(|| body(output, "1").cpu);
    let plate = cpu("fewest");
    told("plate of 2048², 0.01 mm, Fewest", plate, "CPU s", 1.5);
    told("its triangles", triangles(dir, "fewest"), "", 300_000.0);
    told("plate of 2048², 0.01 mm, Even", cpu("even"), "CPU s", 1.5);
    told("its triangles", triangles(dir, "even"), "", 560_000.0);
    told("roll of the same samples", cpu("roll"), "CPU s", 1.4 * plate);
    let wall = |threads: &str| least(|| body("fewest", threads).wall);
    told("the plate with two threads", wall("2"), "s", 0.65 * wall("1"));

    let uncached = |output: &str| least(|| render(dir, ("a.ron", output), &[&one[..], &["--no-cache"]].concat()).cpu);
    told("Draft of 2048², 20°", uncached("steep") - uncached("exact"), "CPU s", 4.0);
    let seconds = least(|| {
        let ran = render(dir, ("a.ron", "carved"), &[&one[..], &["--no-cache"]].concat());
        let nodes = ran.stats["nodes"].as_array().cloned().unwrap_or_default();
        let node = nodes.iter().find(|node| node["name"] == "carved");
        node.and_then(|node| node["seconds"].as_f64()).unwrap_or(f64::NAN)
    });
    // The target is 100,000 triangles a second.
    let needed = 1e6 * seconds / triangles(dir, "carved");
    told("DisplaceMesh, a triangle with its height", needed, "µs", 10.0);

    let large = [&cached[..], &["--resolution", "4096"]].concat();
    render(dir, ("a.ron", "exact"), &large);
    let films = ["--threads", "1", "--no-cache", "--resolution", "4096"];
    told("8 films of 4096²", least(|| render(dir, ("bodies.ron", "films"), &films).cpu), "CPU s", 1.0);
}
