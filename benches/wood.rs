//! Cost of wood in graphs: `cargo bench --bench wood`. A session of one thread renders every graph
//! several times; the minimum counts. `cargo bench -p shibo-kernel --bench wood` measures single kernels.
#![allow(clippy::disallowed_methods, reason = "figures that are told")]
use cpu_time::ProcessTime;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_graph::LoadOptions;
use shibo_picture::{Depth, Format};
use shibo_value::{Channel, Resolution, Value, Window};
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

/// Pixels of a side.
const SIDE: u32 = 2048;
/// Runs of each graph.
const RUNS: usize = 5;

/// A board through a tree, by the origin and the sides of its plane.
#[derive(Clone, Copy)]
enum Cut {
    /// Level rows: z is constant along them.
    Level,
    /// Rows along the trunk.
    Along,
    /// Rising rows.
    Oblique,
}

impl Cut {
    fn plane(self) -> &'static str {
        match self {
            Self::Level => "origin: (-150, 25, 150), u: (300, 0, 0), v: (0, 0, -300)",
            Self::Along => "origin: (-150, 25, -150), u: (0, 0, 300), v: (300, 0, 0)",
            Self::Oblique => "origin: (-150, 25, 150), u: (250, 0, 120), v: (120, 0, -250)",
        }
    }
}

/// A graph of one picture: the growth time of a trunk of `nodes` nodes, with branches, in a cut.
fn graph(nodes: usize, branches: usize, straight: bool, cut: Cut) -> String {
    let mut list = String::new();
    for i in 0..branches {
        let (height, turn) = (260.0 * (i as f64 + 0.5) / branches as f64 - 160.0, i as f64 * 2.4);
        let (x, y) = (turn.cos(), turn.sin());
        let _ = write!(list, "(height: {height}, direction: ({x}, {y}, 0.7), thickening_speed: 0.4), ");
    }
    let time = match (straight, branches) {
        (true, 0) => r#"StraightTime(curve: "nodes")"#,
        (true, _) => r#"StraightTime(curve: "nodes", branches: "tree")"#,
        (false, 0) => r#"TrunkTime(tree: "trunk")"#,
        (false, _) => r#"BlendTimes(times: ["t1", "t2"])"#,
    };
    let branches = match branches {
        0 => String::new(),
        _ => format!(
            r#""tree": Branches(skeleton: "trunk", branches: [{list}]),
            "t1": TrunkTime(tree: "tree"),
            "t2": BranchTime(tree: "tree"),"#
        ),
    };
    format!(
        r#"(
        version: 1,
        canvas: (size_mm: (300, 300), resolution: {SIDE}, tile: None, seed: 1),
        nodes: {{
            "nodes": TrunkNodes(height: (-600, 600), count: {nodes}, wander: 6),
            "trunk": FitSkeleton(curve: "nodes"),
            {branches}
            "time": {time},
            "cut": CutPlane(solid: "time", {}),
        }},
        outputs: {{ "cut": "cut" }},
        )"#,
        cut.plane()
    )
}

/// Costs of rendering a graph.
#[derive(Clone, Copy)]
struct Costs {
    /// CPU seconds of the nodes.
    nodes: f64,
    /// CPU seconds of the process, with the picture written as an EXR file of half floats.
    all: f64,
    /// Page faults during the run.
    faults: f64,
}

fn session() -> Session {
    let settings = Settings { threads: 1, ..Settings::default() };
    Session::new(shibo_nodes::registry(), &settings).expect("a session")
}

/// Renders a graph several times, each time in a new session; returns the minimum of each cost.
fn costs(graph: &str) -> Costs {
    let dir = tempfile::tempdir().expect("room for a folder");
    let path = dir.path().join("graph.ron");
    std::fs::write(&path, graph).expect("room for a file");
    let mut best = Costs { nodes: f64::INFINITY, all: f64::INFINITY, faults: f64::INFINITY };
    for _ in 0..RUNS {
        let (before, faults) = (ProcessTime::now(), faults());
        let session = session();
        let graph = session.load(&path, &LoadOptions::default()).graph.expect("a graph without errors");
        let request = RenderRequest {
            dir: dir.path().into(),
            format: Some(Format::Exr),
            depth: Some(Depth::F16),
            once: true,
            ..RenderRequest::default()
        };
        let report = session.render(&graph, &request, &CancelToken::default(), &Silent).expect("a picture");
        best.nodes = best.nodes.min(report.nodes.iter().map(|node| node.seconds).sum());
        best.all = best.all.min(before.elapsed().as_secs_f64());
        best.faults = best.faults.min(self::faults() - faults);
    }
    best
}

/// Page faults of the process so far that needed no disk; 0 where the system does not report them.
fn faults() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let field = stat.rsplit(')').next().unwrap_or("").split_whitespace().nth(7);
    field.and_then(|field| field.parse().ok()).unwrap_or(0.0)
}

/// Megapixels per CPU second.
fn rate(seconds: f64) -> f64 {
    f64::from(SIDE * SIDE) / seconds * 1e-6
}

fn main() {
    println!("growth time of {SIDE} x {SIDE} points in a graph, three branches (fig 14):");
    println!("Mpx per CPU second of the nodes; CPU ms of the nodes, and with the file; page faults");
    for nodes in [9, 33, 129] {
        for (name, straight, cut) in [
            ("level rows", false, Cut::Level),
            ("along the trunk", false, Cut::Along),
            ("oblique", false, Cut::Oblique),
            ("straight", true, Cut::Along),
        ] {
            let Costs { nodes: own, all, faults } = costs(&graph(nodes, 3, straight, cut));
            let (own_ms, all_ms) = (1e3 * own, 1e3 * all);
            println!(
                "  {nodes:4} nodes, {name:16} {:6.0} Mpx/s; {own_ms:6.1} ms, {all_ms:6.1} ms; {faults:.0}",
                rate(own)
            );
        }
    }
    println!("cost against branches, 9 nodes, rows along the trunk:");
    for branches in [0, 1, 3, 10, 30] {
        let own = costs(&graph(9, branches, false, Cut::Along)).nodes;
        println!("  {branches:3} branches: {:6.2} ns a point, {:6.0} Mpx/s", 1e3 / rate(own), rate(own));
    }
    boards();
    pieces();
}

/// Whole boards: every channel of a shipped graph.
fn boards() {
    for name in ["walnut", "pine_knots", "oak_cuts"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../graphs/{name}.ron"));
        let mut best = f64::INFINITY;
        for _ in 0..2 {
            let session = session();
            let size = glam::UVec2::splat(SIDE);
            let options = LoadOptions { resolution: Some(Resolution::Exact(size)), ..LoadOptions::default() };
            let graph = session.load(&path, &options).graph.expect("a shipped graph");
            let (cancel, output) = (CancelToken::default(), &graph.outputs[0]);
            let before = ProcessTime::now();
            let value = session.value(&graph, (output.node, output.output), &cancel, &Silent).expect("a material");
            let Value::Material(material) = value else { continue };
            for channel in [Channel::BaseColor, Channel::Normal] {
                let field = material.get(channel).expect("the channel").clone();
                let whole = [(graph.canvas.grid(size), Window::full(size))];
                black_box(session.rasters(&graph, &field, &whole, &cancel, &Silent).expect("a picture"));
            }
            best = best.min(before.elapsed().as_secs_f64());
        }
        println!("{name} {SIDE} x {SIDE}, base colour and normal: {best:.2} CPU s");
    }
}

/// Boards of a parquet, each from another part of a walnut tree, against one board of the same area: the colour and all
/// other channels that a material needs.
fn pieces() {
    let wood = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/walnut.ron");
    let channels = ["", "_height", "_roughness", "_anisotropy", "_angle"];
    let rate_of = |how: &str| {
        let list = |item: &dyn Fn(&str) -> String| channels.iter().map(|channel| item(channel)).collect::<String>();
        let cuts = list(&|c| format!("\"cut{c}\": CutPlane(solid: \"tree.solid{c}\", preset: FlatSawn, {how}),"));
        let outputs = list(&|c| format!("\"cut{c}\": \"cut{c}\","));
        costs(&format!(
            r#"(
            version: 1,
            imports: {{ "wood": {wood:?} }},
            canvas: (size_mm: 200, resolution: {SIDE}, tile: None, seed: 1),
            nodes: {{
                "floor": Brick(layout: Herringbone, size: (62.8, 15.4), gap: 0.4),
                "tree": Use(graph: "wood"),
                {cuts}
            }},
            outputs: {{ {outputs} }},
            )"#
        ))
        .nodes
    };
    let one = rate_of("distance: 54, height: 1200");
    let pieces = r#"local: "floor.local", ids: "floor.ids", angle: "floor.angle", spread: (20, 30, 1000), turn: (20, 2), flip: true"#;
    let many = rate_of(&format!("distance: 54, height: 2000, {pieces}"));
    println!("parquet of 40 boards {SIDE} x {SIDE}: {many:.2} CPU s, one board {one:.2}, {:.2} times", many / one);
}
