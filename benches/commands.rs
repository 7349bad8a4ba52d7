//! Whole commands: `cargo bench -p shibo --bench commands`. Medians of several processes; compared commands run
//! alternately. Set `SHIBO_BENCH_LARGE=1` to render 16384² too (about a minute, 1 GB of disk).
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Resources used by one process.
#[derive(Clone, Copy)]
struct Taken {
    wall: f64,
    cpu: f64,
    mib: f64,
}

fn run(args: &[&str]) -> Taken {
    let start = Instant::now();
    let output = Command::new(env!("CARGO_BIN_EXE_shibo"))
        .args(args)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stderr(Stdio::null())
        .output()
        .expect("the command is built");
    let wall = start.elapsed().as_secs_f64();
    assert!(output.status.success(), "{args:?}");
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let number = |key: &str| stats[key].as_f64().unwrap_or(f64::NAN);
    Taken { wall, cpu: number("cpu_s"), mib: number("peak_rss_mib") }
}

fn median(mut runs: Vec<Taken>) -> Taken {
    let mid = runs.len() / 2;
    runs.sort_by(|a, b| a.wall.total_cmp(&b.wall));
    runs[mid]
}

fn report(what: &str, taken: Taken) {
    println!("{what:<52} wall {:>8.3} s   cpu {:>8.3} s   peak {:>7.1} MiB", taken.wall, taken.cpu, taken.mib);
}

/// A graph of 60 nodes in a chain.
fn chain() -> String {
    let mut nodes = String::from("\"n0\": Perlin(size: 5),\n");
    for i in 1..60 {
        let _ = writeln!(nodes, "\"n{i}\": \"= 0.9 * n{} + 0.05\",", i - 1);
    }
    format!("(nodes: {{\n{nodes}}}, outputs: {{ \"n\": \"n59\" }})")
}

fn calf(out: &Path, resolution: &str, more: &[&str]) -> Taken {
    let out = out.to_string_lossy();
    let mut args = vec!["render", "graphs/calf.ron", "-o", &out, "--resolution", resolution, "--stats", "json"];
    args.extend(more);
    run(&args)
}

/// Cost of writing: six channels of 4096² that cost next to nothing to compute, as pictures and as files for other
/// programs.
const SIX: &str = r##"(
  canvas: (size_mm: 60, resolution: 4096),
  nodes: {
    "a": Perlin(size: 5), "b": Perlin(size: 1, seed: 2),
    "color": GradientMap(input: "a", stops: [(0, "#402010"), (1, "#c09060")]),
    "normal": HeightToNormal(input: "b"),
    "skin": Material(base_color: "color", roughness: "a", metallic: "b", normal: "normal", ao: "b", coat: "a"),
  },
  outputs: {
    "png": "skin",
    "flat": File(from: "color", format: Exr, depth: F16),
    "mip": File(from: "color", format: Exr, depth: F16, mip: true),
  },
)"##;

fn written(dir: &Path) {
    let file = dir.join("six.ron");
    std::fs::write(&file, SIX).expect("the folder can be written");
    let (file, out) = (file.to_string_lossy(), dir.join("six"));
    let out = out.to_string_lossy();
    let render = |more: &[&str]| {
        let mut args = vec!["render", &file, "-o", &out, "--no-cache", "--stats", "json"];
        args.extend(more);
        run(&args)
    };
    let ways: [(&str, &[&str]); 4] = [
        ("six channels 4096² as PNG", &["--output", "png"]),
        ("six channels 4096² as glTF", &["--as", "gltf", "--output", "png"]),
        ("a colour 4096² as EXR", &["--output", "flat"]),
        ("a colour 4096² as EXR in tiles with mip levels", &["--output", "mip"]),
    ];
    let mut runs: [Vec<Taken>; 4] = Default::default();
    for _ in 0..5 {
        ways.iter().zip(&mut runs).for_each(|((_, args), runs)| runs.push(render(args)));
    }
    let taken = runs.map(median);
    ways.iter().zip(taken).for_each(|((name, _), taken)| report(name, taken));
    println!("glTF costs {:.2} times the CPU time of PNG", taken[1].cpu / taken[0].cpu);
    println!("mip levels cost {:.2} times the CPU time of none", taken[3].cpu / taken[2].cpu);
}

fn main() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let file = dir.path().join("chain.ron");
    std::fs::write(&file, chain()).expect("the folder can be written");
    let file = file.to_string_lossy();

    report("check, 60 nodes", median((0..21).map(|_| run(&["check", &file])).collect()));
    report("check graphs/calf.ron", median((0..21).map(|_| run(&["check", "graphs/calf.ron"])).collect()));

    let (out, cache) = (dir.path().join("out"), dir.path().join("cache"));
    let cache = cache.to_string_lossy();
    let mut quarter = Vec::new();
    let mut whole = Vec::new();
    for _ in 0..5 {
        quarter.push(calf(&out, "512", &["--no-cache"]));
        whole.push(calf(&out, "2048", &["--no-cache"]));
    }
    let (quarter, whole) = (median(quarter), median(whole));
    report("calf 512², nothing cached", quarter);
    report("calf 2048², nothing cached", whole);
    println!("a quarter of the size costs 1/{:.1} of the CPU time", whole.cpu / quarter.cpu);
    report("calf 2048², filling the cache", calf(&out, "2048", &["--cache-dir", &cache]));
    let cached = (0..5).map(|_| calf(&out, "2048", &["--cache-dir", &cache])).collect();
    report("calf 2048², all cached", median(cached));
    written(dir.path());
    if std::env::var_os("SHIBO_BENCH_LARGE").is_some() {
        let args = ["--no-cache", "--output", "material.height"];
        let (small, large) = (calf(&out, "4096", &args), calf(&out, "16384", &args));
        report("calf height 4096²", small);
        report("calf height 16384²", large);
        println!("16 times the pixels cost {:.1} times the CPU time", large.cpu / small.cpu);
    }
}
