//! Meshes: `cargo bench -p shibo --bench meshes`. A torus of 100,000 triangles with UVs and normals is written as OBJ; then whole
//! commands load it, lay it out, and bake from it. CPU time of nodes is what `--stats` says; that of pixels and rays is what a large
//! picture takes more than a small one. The least of several runs.
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// Quads around the torus, and around its tube.
const QUADS: (u32, u32) = (250, 200);
const RUNS: usize = 5;

/// The mesh: radii of 50 and 18 mm, y up.
fn torus() -> String {
    let (around, across) = QUADS;
    let turn = |i: u32, of: u32| std::f64::consts::TAU * f64::from(i) / f64::from(of);
    let corners = || (0..around).flat_map(move |i| (0..across).map(move |j| (turn(i, around), turn(j, across))));
    let mut text = String::new();
    for (a, b) in corners() {
        let r = 50.0 + 18.0 * b.cos();
        let _ = writeln!(text, "v {:.6} {:.6} {:.6}", r * a.cos(), 18.0 * b.sin(), r * a.sin());
    }
    for (a, b) in corners() {
        let _ = writeln!(text, "vn {:.6} {:.6} {:.6}", b.cos() * a.cos(), b.sin(), b.cos() * a.sin());
    }
    for (i, j) in (0..=around).flat_map(|i| (0..=across).map(move |j| (i, j))) {
        let _ = writeln!(text, "vt {:.6} {:.6}", f64::from(i) / f64::from(around), f64::from(j) / f64::from(across));
    }
    for (i, j) in (0..around).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let corner = |k: u32, l: u32| {
            let place = (i + k) % around * across + (j + l) % across + 1;
            format!("{place}/{}/{place}", (i + k) * (across + 1) + j + l + 1)
        };
        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        let _ = writeln!(text, "f {a} {c} {b}\nf {a} {d} {c}");
    }
    text
}

/// The CPU seconds of a command, and of each of its nodes.
fn render(dir: &Path, graph: &str, resolution: u32) -> (f64, impl Fn(&str) -> f64 + use<>) {
    std::fs::write(dir.join("a.ron"), graph).expect("the folder takes files");
    let output = Command::new(env!("CARGO_BIN_EXE_shibo"))
        .args(["render", "a.ron", "-o", "out", "--no-cache", "--threads", "1", "--stats", "json", "--resolution"])
        .arg(resolution.to_string())
        .current_dir(dir)
        .stderr(Stdio::null())
        .output()
        .expect("the command is built");
    assert!(output.status.success(), "{graph}");
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let nodes = stats["nodes"].clone();
    let node = move |name: &str| {
        let node = nodes.as_array().and_then(|nodes| nodes.iter().find(|node| node["name"] == name));
        node.and_then(|node| node["seconds"].as_f64()).unwrap_or(f64::NAN)
    };
    (stats["cpu_s"].as_f64().unwrap_or(f64::NAN), node)
}

/// The least of several runs.
fn least(measure: impl Fn() -> f64) -> f64 {
    (0..RUNS).map(|_| measure()).fold(f64::INFINITY, f64::min)
}

fn main() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    std::fs::write(dir.join("torus.obj"), torus()).expect("the folder takes files");
    let graph = |nodes: &str, output: &str| {
        format!(
            "(version: 1, canvas: (size_mm: 300, tile: None), nodes: {{ \"mesh\": LoadMesh(path: \"torus.obj\"),
              \"atlas\": MeshAtlas(mesh: \"mesh\"), {nodes} }}, outputs: {{ \"{output}\": \"{output}\" }})"
        )
    };
    let parts = graph("\"baked\": BakeParts(atlas: \"atlas\", by: Part)", "baked");
    let load = least(|| render(dir, &parts, 64).1("mesh"));
    let lay_out = least(|| render(dir, &parts, 64).1("atlas"));
    println!("load an OBJ of 100,000 triangles                     cpu {:>8.1} ms", 1e3 * load);
    println!("its atlas                                            cpu {:>8.1} ms", 1e3 * lay_out);
    println!("both; no more than 150 ms                            cpu {:>8.1} ms", 1e3 * (load + lay_out));
    // All of the canvas is covered: every pixel has an owner. What pixels of fields take is no node's own, so it is that of whole
    // commands, of which the picture is the same everywhere and takes next to nothing to write.
    let places = graph(
        "\"baked\": BakePosition(atlas: \"atlas\"),
         \"flat\": Expression(a: \"baked\", formula: \"step(-100000, a.r + a.g + a.b)\")",
        "flat",
    );
    let seconds = least(|| render(dir, &places, 4096).0) - least(|| render(dir, &places, 256).0);
    let pixels = f64::from(4096 * 4096 - 256 * 256) * 1e-6;
    println!("{:<52} {:>8.1} Mpx/s", "owners and positions of 4096²; at least 50 Mpx/s", pixels / seconds);
    let rays = f64::from(64 * (512 * 512 - 64 * 64));
    let occlusion = graph("\"baked\": BakeOcclusion(atlas: \"atlas\", rays: 64)", "baked");
    let seconds = least(|| render(dir, &occlusion, 512).1("baked")) - least(|| render(dir, &occlusion, 64).1("baked"));
    println!("{:<52} {:>8.2} M rays/s", "occlusion; at least 2 M rays/s", rays * 1e-6 / seconds);
}
