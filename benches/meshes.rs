//! Meshes: `cargo bench -p shibo --bench meshes`. Writes a torus of 100,000 triangles with UVs and normals as OBJ;
//! whole commands then load it, unwrap it, and bake from it. The CPU time of nodes is taken from `--stats`; that of
//! pixels and rays is the difference between a large and a small picture. The minimum of several runs.
#![allow(clippy::disallowed_methods, reason = "figures that are told")]
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

/// The minimum of several runs.
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
    // All of the canvas is covered: every pixel has an owner. The time of fields' pixels belongs to no node, so it is
    // measured by whole commands; their picture is constant and takes next to nothing to write.
    let places = graph(
        "\"baked\": BakePosition(atlas: \"atlas\"),
         \"flat\": \"= step(-100000, baked.r + baked.g + baked.b)\"",
        "flat",
    );
    let seconds = least(|| render(dir, &places, 4096).0) - least(|| render(dir, &places, 256).0);
    let pixels = f64::from(4096 * 4096 - 256 * 256) * 1e-6;
    println!("{:<52} {:>8.1} Mpx/s", "owners and positions of 4096²; at least 50 Mpx/s", pixels / seconds);
    let rays = f64::from(64 * (512 * 512 - 64 * 64));
    let occlusion = graph("\"baked\": BakeOcclusion(atlas: \"atlas\", rays: 64)", "baked");
    let seconds = least(|| render(dir, &occlusion, 512).1("baked")) - least(|| render(dir, &occlusion, 64).1("baked"));
    println!("{:<52} {:>8.2} M rays/s", "occlusion; at least 2 M rays/s", rays * 1e-6 / seconds);
    let charts =
        graph("\"made\": MeshAtlas(mesh: \"mesh\", charts: New), \"baked\": BakeParts(atlas: \"made\")", "baked");
    println!("{:<52} cpu {:>8.2} s", "new charts; no more than 6 s", render(dir, &charts, 64).1("made"));
    let field = graph(
        "\"flow\": TangentField(mesh: \"mesh\", strokes: [[(68, 0, 0), (66, 16, 0), (60, 30, 0)]]),
         \"baked\": JacobianFromMesh(atlas: \"atlas\", frames: \"flow\")",
        "baked.t",
    );
    println!(
        "{:<52} cpu {:>8.2} s",
        "directions along a stroke; no more than 1 s",
        least(|| render(dir, &field, 64).1("flow"))
    );
    let pointers = graph(
        "\"baked\": IndirectionMap(atlas: \"atlas\", size: 1024, levels: 6),
         \"first\": StartCoords(surface: \"baked\", exemplar: \"piece\", levels: 5), \"cells\": Worley(size: 8),
         \"piece\": Exemplar(input: \"cells\", size: (64, 64)), \"shown\": SampleExemplar(coords: \"first\", input: \"cells\")",
        "shown",
    );
    println!(
        "{:<52} cpu {:>8.2} s",
        "pointers of 1024²; no more than .25 s",
        least(|| render(dir, &pointers, 64).1("baked"))
    );
    growth(dir);
    wood(dir);
}

/// Compares synthesis on a surface with synthesis in the plane along directions that vary from pixel to pixel: both
/// with two passes per level, without mending, which surfaces do not support.
fn growth(dir: &Path) {
    let graph = |nodes: &str, output: &str| {
        format!(
            "(version: 1, canvas: (size_mm: 300, tile: None), nodes: {{ \"cells\": Worley(size: 8, jitter: 0.8),
              \"piece\": Exemplar(input: \"cells\", size: (128, 128), size_mm: (37.5, 37.5)), \"sets\": CandidateSets(exemplar: \"piece\"),
              \"mesh\": LoadMesh(path: \"torus.obj\"), \"atlas\": MeshAtlas(mesh: \"mesh\"), \"flow\": TangentField(mesh: \"mesh\", from: Around),
              {nodes} \"shown\": SampleExemplar(coords: \"{output}\", input: \"cells\") }}, outputs: {{ \"shown\": \"shown\" }})"
        )
    };
    let surface =
        graph("\"on\": SynthesizeSurface(exemplar: \"sets\", atlas: \"atlas\", frames: \"flow\", size: 1024),", "on");
    let plane = graph(
        "\"turn\": Perlin(size: 90), \"angle\": Remap(input: \"turn\", to: (0, 90)), \"along\": JacobianFromAngleScale(angle: \"angle\"),
         \"in\": Synthesize(exemplar: \"sets\", jacobian: \"along\", size: (1024, 1024), preset: Fast, mend: 0),",
        "in",
    );
    // All of the canvas is covered, so both have the same number of texels.
    let (mut on, mut within) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..RUNS {
        on = on.min(render(dir, &surface, 64).1("on"));
        within = within.min(render(dir, &plane, 64).1("in"));
    }
    println!(
        "{:<52} {:>12.2} ({on:.2} and {within:.2} CPU s)",
        "synthesis of 1024² over that in the plane; at most 1.6",
        on / within
    );
}

/// Compares walnut along a surface with the same texels on a plane.
fn wood(dir: &Path) {
    let graph = |nodes: &str| {
        format!(
            "(version: 1, canvas: (size_mm: 300, tile: None), imports: {{ \"walnut\": \"shibo:walnut\" }}, nodes: {{ \"tree\": Use(graph: \"walnut\"),
              \"mesh\": LoadMesh(path: \"torus.obj\"), \"atlas\": MeshAtlas(mesh: \"mesh\"), {nodes} }}, outputs: {{ \"cut\": \"cut\" }})"
        )
    };
    let body = graph(
        "\"placed\": PlaceInTree(solid: \"tree.solid\", position: (0, 80, 1200)), \"cut\": BakeSolid(atlas: \"atlas\", solid: \"placed\"),",
    );
    let plane =
        graph("\"cut\": CutPlane(solid: \"tree.solid\", preset: FlatSawn, distance: 54, height: 1200, pitch: 0.8),");
    let seconds = |graph: &str| render(dir, graph, 2048).0 - render(dir, graph, 64).0;
    let (mut on, mut within) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..2 {
        on = on.min(seconds(&body));
        within = within.min(seconds(&plane));
    }
    println!(
        "{:<52} {:>12.2} ({on:.2} and {within:.2} CPU s)",
        "walnut of 2048² on a plane over on a surface; at least .6",
        within / on
    );
}
