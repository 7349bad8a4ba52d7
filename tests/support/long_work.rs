//! Nodes that work for long: a test counts how often they check for cancellation, and a bench measures how long they
//! take to stop.
#![allow(dead_code, clippy::unwrap_used, reason = "each program uses a part of it, and fails by panicking")]
use glam::UVec2;
use petgraph::graph::NodeIndex;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, Session, Settings};
use shibo_graph::{Graph, Input, LoadOptions, load_text};
use shibo_value::{Field, Value, Window};
use std::path::Path;

/// A graph whose node `it` works for long.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    /// Side of the canvas in mm.
    size: u32,
    /// Side of the canvas in pixels.
    resolution: u32,
    /// The nodes; `it` is evaluated.
    nodes: &'static str,
    /// Minimum number of checks for cancellation: half the number when the case was written.
    pub(crate) questions: u64,
}

const fn case(name: &'static str, size: u32, resolution: u32, questions: u64, nodes: &'static str) -> Case {
    Case { name, size, resolution, nodes, questions }
}

const POINTS: &str = "\"p\": RandomPoints(count: 300000),";
const NET: &str = "\"f\": Fractal(size: 9), \"p\": PoissonPoints(pitch: 0.8), \"l\": ConnectNeighbors(points: \"p\"),";
const TREE: &str = "\"pith\": TrunkNodes(height: (0, 4000), count: 21, wander: 7), \"trunk\": FitSkeleton(curve: \"pith\"), \
    \"tree\": Branches(skeleton: \"trunk\", whorl_spacing: 300), \"even\": TrunkTime(tree: \"tree\"), \
    \"shape\": VaryGrowth(time: \"even\", tree: \"tree\"), \"grown\": BlendTimes(times: [\"shape\"], tree: \"tree\", origin: Branch), \
    \"time\": VaryGrowth(time: \"grown\", series: Generated), \"fiber\": FiberSpace(time: \"grown\", tree: \"tree\"), \
    \"year\": ColorPattern(), \"color\": RingColor(time: \"time\", pattern: \"year\", fiber: \"fiber\"),";
const SAMPLE: &str = "\"cells\": Worley(size: 4), \"c\": GradientMap(input: \"cells\", stops: [(0, \"#140d08\"), (1, \"#c4a884\")]), \
    \"x\": Exemplar(input: \"c\", size: (256, 256), size_mm: 30),";

pub(crate) const CASES: &[Case] = &[
    case("points that keep their distance", 100, 64, 4248, "\"it\": PoissonPoints(pitch: 0.25)"),
    case(
        "points that keep a changing distance",
        80,
        64,
        2745,
        "\"f\": Fractal(size: 20), \"it\": PoissonPoints(pitch: 0.25, density: \"f\")",
    ),
    case("random points", 100, 64, 2, "\"it\": RandomPoints(count: 4000000)"),
    case("points of a grid", 100, 64, 2, "\"it\": GridPoints(pitch: 0.06, jitter: 0.3)"),
    case("points of hexagons", 50, 64, 217, "\"it\": HexPoints(edge: 0.08, jitter: 0.3)"),
    case(
        "points in an area",
        100,
        512,
        632,
        "POINTS \"f\": Fractal(size: 9), \"it\": WorkArea(points: \"p\", area: \"f\")",
    ),
    case("triangulation", 100, 64, 6137, "POINTS \"it\": ConnectNeighbors(points: \"p\")"),
    case(
        "links within a radius",
        100,
        64,
        587,
        "POINTS \"it\": ConnectNeighbors(points: \"p\", neighbors: Radius(0.4))",
    ),
    case(
        "links of a grid",
        100,
        64,
        44,
        "\"p\": GridPoints(pitch: 0.06), \"it\": ConnectNeighbors(points: \"p\", neighbors: Eight)",
    ),
    case("bands", 300, 1024, 154, "\"it\": BandPattern(pitch: 1)"),
    case("springs", 200, 64, 20, "NET \"it\": DefineSprings(lattice: \"l\", field: \"f\")"),
    case("springs by samples", 200, 64, 20, "NET \"it\": DefineSprings(lattice: \"l\", field: \"f\", sample: Line)"),
    case(
        "masses",
        200,
        64,
        17,
        "NET \"s\": DefineSprings(lattice: \"l\"), \"it\": DefineMass(springs: \"s\", field: \"f\")",
    ),
    case(
        "motion",
        200,
        64,
        600,
        "NET \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \"it\": SimulateSprings(springs: \"s\", steps: 1200, drag: 4)",
    ),
    case(
        "motion on a grid",
        200,
        64,
        300,
        "\"f\": Fractal(size: 9), \"p\": GridPoints(pitch: 0.4), \"l\": ConnectNeighbors(points: \"p\", neighbors: Eight), \
        \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \"it\": SimulateSprings(springs: \"s\", steps: 600, drag: 4)",
    ),
    case(
        "breakage",
        200,
        64,
        150,
        "NET \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \
        \"it\": SimulateSprings(springs: \"s\", steps: 300, drag: 4, break_share: 0.1)",
    ),
    case(
        "strain",
        200,
        1024,
        96,
        "NET \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \"m\": SimulateSprings(springs: \"s\", steps: 2, drag: 4), \
        \"it\": Blur(input: \"m.stretch\", radius: 0.1)",
    ),
    case("wrinkles", 200, 64, 1, "NET \"it\": PlaceWrinkles(lattice: \"l\")"),
    case(
        "strokes",
        200,
        2048,
        320,
        "NET \"w\": PlaceWrinkles(lattice: \"l\"), \"it\": DrawWrinkles(segments: \"w\", width: (0.1, 0.2))",
    ),
    case(
        "strokes coarse",
        200,
        64,
        204,
        "NET \"w\": PlaceWrinkles(lattice: \"l\"), \"it\": DrawWrinkles(segments: \"w\", width: (0.1, 0.2))",
    ),
    case("dots", 200, 2048, 432, "POINTS \"it\": Dots(points: \"p\", diameter: (0.3, 0.6))"),
    case("wide blur", 100, 4096, 1557, "\"f\": Fractal(size: 3), \"it\": Blur(input: \"f\", radius: 8)"),
    case("distance", 50, 2048, 1312, "\"f\": Perlin(size: 9), \"it\": DistanceField(input: \"f\", radius: 20)"),
    case("occlusion", 100, 4096, 2733, "\"f\": Perlin(size: 9), \"it\": AmbientOcclusion(input: \"f\", radius: 5)"),
    case("pillow", 100, 4096, 1536, "\"f\": Perlin(size: 9), \"it\": Pillow(input: \"f\")"),
    case("warp", 50, 2048, 358, "\"f\": Fractal(size: 3), \"it\": Warp(input: \"f\", amount: 5, size: 20)"),
    case("turn", 50, 2048, 288, "\"f\": Fractal(size: 3), \"it\": Transform(input: \"f\", angle: 30, scale: 0.2)"),
    case("clouds", 50, 2048, 64, "\"it\": Fractal(size: 30, octaves: 12)"),
    case("cells", 100, 4096, 256, "\"it\": Worley(size: 0.2)"),
    case("light", 50, 2048, 480, "\"f\": Fractal(size: 3), \"it\": Relief(height: \"f\")"),
    case("exemplar", 100, 64, 17, "\"c\": Fractal(size: 3), \"it\": Exemplar(input: \"c\", size: (1024, 1024))"),
    case("appearance", 100, 64, 1796, "SAMPLE \"it\": AppearanceSpace(exemplar: \"x\")"),
    case("candidates", 100, 64, 2067, "SAMPLE \"it\": CandidateSets(exemplar: \"x\")"),
    case("lattice of an exemplar", 100, 64, 2, "SAMPLE \"it\": DetectLattice(exemplar: \"x\")"),
    case("synthesis", 100, 512, 2074, "SAMPLE \"it\": Synthesize(exemplar: \"x\")"),
    case(
        "regular synthesis",
        100,
        512,
        2074,
        "SAMPLE \"d\": DetectLattice(exemplar: \"x\"), \"it\": Synthesize(exemplar: \"d\", preset: Regular)",
    ),
    case(
        "guided synthesis",
        100,
        512,
        2138,
        "SAMPLE \"t\": Perlin(size: 30), \"j\": JacobianFromAngleScale(angle: \"t\"), \
        \"it\": Synthesize(exemplar: \"x\", jacobian: \"j\")",
    ),
    case(
        "samples",
        100,
        2048,
        65,
        "SAMPLE \"s\": Synthesize(exemplar: \"x\", size: (128, 128)), \"it\": SampleExemplar(coords: \"s\", input: \"c\")",
    ),
    case(
        "magnified samples",
        100,
        2048,
        65,
        "SAMPLE \"s\": Synthesize(exemplar: \"x\", size: (128, 128)), \"it\": MagnifyCoords(coords: \"s\", input: \"c\")",
    ),
    case(
        "branches",
        100,
        64,
        1,
        "\"pith\": TrunkNodes(height: (0, 100000), count: 10000, wander: 7), \"trunk\": FitSkeleton(curve: \"pith\"), \
        \"it\": Branches(skeleton: \"trunk\", whorl_spacing: 20)",
    ),
    case(
        "growth",
        200,
        512,
        24,
        "TREE \"it\": CutPlane(solid: \"time\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
    case(
        "rings",
        200,
        512,
        40,
        "TREE \"it\": CutPlane(solid: \"color\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
    case(
        "fibres",
        200,
        512,
        52,
        "TREE \"s\": FiberStreaks(color: \"color\", fiber: \"fiber\"), \
        \"it\": CutPlane(solid: \"s\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
    case(
        "pores",
        200,
        512,
        54,
        "TREE \"s\": WoodPores(color: \"color\", time: \"time\", fiber: \"fiber\"), \
        \"it\": CutPlane(solid: \"s\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
    case(
        "rays",
        200,
        512,
        54,
        "TREE \"s\": WoodRays(color: \"color\", fiber: \"fiber\"), \
        \"it\": CutPlane(solid: \"s\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
];

pub(crate) fn load(case: &Case) -> Graph {
    let Case { name, size, resolution, nodes, .. } = case;
    let nodes = [("POINTS", POINTS), ("NET", NET), ("TREE", TREE), ("SAMPLE", SAMPLE)]
        .iter()
        .fold((*nodes).to_owned(), |text, (word, nodes)| text.replace(&format!("{word} "), nodes));
    let text =
        format!("(version: 1, canvas: (size_mm: {size}, resolution: {resolution}, tile: Both), nodes: {{ {nodes} }})");
    let options = LoadOptions { working_dir: env!("CARGO_MANIFEST_DIR").into(), ..LoadOptions::default() };
    let loaded = load_text(Path::new("case.ron"), &text, &shibo_nodes::registry(), &options);
    loaded.graph.unwrap_or_else(|| panic!("{name}: {:#?}", loaded.diagnostics))
}

fn it(graph: &Graph) -> NodeIndex {
    graph.nodes.node_indices().find(|i| graph.nodes[*i].name == "it").unwrap()
}

/// Evaluates the inputs of the node `it`.
pub(crate) fn prepare(session: &Session, graph: &Graph) {
    for input in &graph.nodes[it(graph)].inputs {
        if let Input::Wire { node, output } = input {
            session.value(graph, (*node, *output), &CancelToken::default(), &Silent).unwrap();
        }
    }
}

/// Evaluates the node `it`, and its picture if it is a field.
pub(crate) fn work(session: &Session, graph: &Graph, token: &CancelToken) -> Result<(), Failure> {
    let field: Field = match session.value(graph, (it(graph), 0), token, &Silent)? {
        Value::Field(field) => field,
        Value::Picture(picture) => picture.rgb.clone(),
        _ => return Ok(()),
    };
    let size: UVec2 = graph.canvas.resolution;
    session.rasters(graph, &field, &[(graph.canvas.grid(size), Window::full(size))], token, &Silent).map(drop)
}

/// A session with this number of threads.
pub(crate) fn session(threads: usize) -> Session {
    Session::new(shibo_nodes::registry(), &Settings { threads, ..Settings::default() }).unwrap()
}
