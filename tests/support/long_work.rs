//! Work that takes long, for those who stop it: the test that counts how often it asks, and the bench that times it.
#![allow(dead_code, clippy::unwrap_used, reason = "each program uses a part of it, and fails by panicking")]
use glam::UVec2;
use petgraph::graph::NodeIndex;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::graph::{Graph, Input, Limits, LoadOptions, load_text};
use shibo_engine::session::{Failure, Session, Settings};
use shibo_engine::value::{Field, Value, Window};
use std::path::Path;

/// A case: what it is called, the side of its canvas in mm and in pixels, and its nodes; `it` is looked at.
pub(crate) type Case = (&'static str, u32, u32, &'static str);

const POINTS: &str = "\"p\": RandomPoints(count: 300000),";
const NET: &str = "\"f\": Fractal(size: 9), \"p\": PoissonPoints(pitch: 0.8), \"l\": ConnectNeighbors(points: \"p\"),";
const TREE: &str = "\"pith\": TrunkNodes(height: (0, 4000), count: 21, wander: 7), \"trunk\": FitSkeleton(curve: \"pith\"), \
    \"tree\": Branches(skeleton: \"trunk\", whorl_spacing: 300), \"even\": TrunkTime(skeleton: \"tree\"), \
    \"shape\": VaryGrowth(time: \"even\", skeleton: \"tree\"), \"grown\": BlendTimes(times: [\"shape\"], skeleton: \"tree\", origin: Branch), \
    \"time\": VaryGrowth(time: \"grown\", series: Generated), \"fiber\": FiberSpace(time: \"grown\", skeleton: \"tree\"), \
    \"year\": ColorPattern(), \"color\": RingColor(time: \"time\", pattern: \"year\", fiber: \"fiber\"),";
const SAMPLE: &str = "\"cells\": Worley(size: 4), \"c\": GradientMap(input: \"cells\", stops: [(0, \"#140d08\"), (1, \"#c4a884\")]), \
    \"x\": Exemplar(input: \"c\", size: (256, 256), size_mm: 30),";

pub(crate) const CASES: &[Case] = &[
    ("points that keep their distance", 200, 64, "\"it\": PoissonPoints(pitch: 0.25)"),
    (
        "points that keep a changing distance",
        200,
        64,
        "\"f\": Fractal(size: 20), \"it\": PoissonPoints(pitch: 0.25, density: \"f\")",
    ),
    ("random points", 100, 64, "\"it\": RandomPoints(count: 4000000)"),
    ("points of a grid", 100, 64, "\"it\": GridPoints(pitch: 0.06, jitter: 0.3)"),
    ("points of hexagons", 100, 64, "\"it\": HexPoints(edge: 0.08, jitter: 0.3)"),
    ("points in an area", 100, 512, "POINTS \"f\": Fractal(size: 9), \"it\": WorkArea(points: \"p\", area: \"f\")"),
    ("triangulation", 100, 64, "POINTS \"it\": ConnectNeighbors(points: \"p\")"),
    ("links within a radius", 100, 64, "POINTS \"it\": ConnectNeighbors(points: \"p\", neighbors: Radius(0.4))"),
    (
        "links of a grid",
        100,
        64,
        "\"p\": GridPoints(pitch: 0.06), \"it\": ConnectNeighbors(points: \"p\", neighbors: Eight)",
    ),
    ("bands", 300, 1024, "\"it\": BandPattern(pitch: 1)"),
    ("springs", 200, 64, "NET \"it\": DefineSprings(lattice: \"l\", field: \"f\")"),
    ("springs by samples", 200, 64, "NET \"it\": DefineSprings(lattice: \"l\", field: \"f\", sample: Line)"),
    ("masses", 200, 64, "NET \"s\": DefineSprings(lattice: \"l\"), \"it\": DefineMass(springs: \"s\", field: \"f\")"),
    (
        "motion",
        200,
        64,
        "NET \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \"it\": SimulateSprings(springs: \"s\", steps: 1200, drag: 4)",
    ),
    (
        "motion on a grid",
        200,
        64,
        "\"f\": Fractal(size: 9), \"p\": GridPoints(pitch: 0.4), \"l\": ConnectNeighbors(points: \"p\", neighbors: Eight), \
        \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \"it\": SimulateSprings(springs: \"s\", steps: 600, drag: 4)",
    ),
    (
        "breakage",
        200,
        64,
        "NET \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \
        \"it\": SimulateSprings(springs: \"s\", steps: 300, drag: 4, break_share: 0.1)",
    ),
    (
        "strain",
        200,
        1024,
        "NET \"s\": DefineSprings(lattice: \"l\", field: \"f\"), \"m\": SimulateSprings(springs: \"s\", steps: 2, drag: 4), \
        \"it\": Blur(input: \"m.stretch\", radius: 0.1)",
    ),
    ("wrinkles", 200, 64, "NET \"it\": PlaceWrinkles(lattice: \"l\")"),
    (
        "strokes",
        200,
        2048,
        "NET \"w\": PlaceWrinkles(lattice: \"l\"), \"it\": DrawWrinkles(segments: \"w\", width: (0.1, 0.2))",
    ),
    (
        "strokes coarse",
        200,
        64,
        "NET \"w\": PlaceWrinkles(lattice: \"l\"), \"it\": DrawWrinkles(segments: \"w\", width: (0.1, 0.2))",
    ),
    ("dots", 200, 2048, "POINTS \"it\": Dots(points: \"p\", diameter: (0.3, 0.6))"),
    ("wide blur", 100, 4096, "\"f\": Fractal(size: 3), \"it\": Blur(input: \"f\", radius: 8)"),
    ("distance", 100, 4096, "\"f\": Perlin(size: 9), \"it\": DistanceField(input: \"f\", radius: 20)"),
    ("occlusion", 100, 4096, "\"f\": Perlin(size: 9), \"it\": AmbientOcclusion(input: \"f\", radius: 5)"),
    ("pillow", 100, 4096, "\"f\": Perlin(size: 9), \"it\": Pillow(input: \"f\")"),
    ("warp", 100, 4096, "\"f\": Fractal(size: 3), \"it\": Warp(input: \"f\", amount: 5, size: 20)"),
    ("turn", 100, 4096, "\"f\": Fractal(size: 3), \"it\": Transform(input: \"f\", angle: 30, scale: 0.2)"),
    ("clouds", 100, 4096, "\"it\": Fractal(size: 30, octaves: 12)"),
    ("cells", 100, 4096, "\"it\": Worley(size: 0.2)"),
    ("light", 100, 4096, "\"f\": Fractal(size: 3), \"it\": Relief(height: \"f\")"),
    ("exemplar", 100, 64, "\"c\": Fractal(size: 3), \"it\": Exemplar(input: \"c\", size: (1024, 1024))"),
    ("appearance", 100, 64, "SAMPLE \"it\": AppearanceSpace(exemplar: \"x\")"),
    ("candidates", 100, 64, "SAMPLE \"it\": CandidateSets(exemplar: \"x\")"),
    ("lattice of an exemplar", 100, 64, "SAMPLE \"it\": DetectLattice(exemplar: \"x\")"),
    ("synthesis", 100, 512, "SAMPLE \"it\": Synthesize(exemplar: \"x\")"),
    (
        "regular synthesis",
        100,
        512,
        "SAMPLE \"d\": DetectLattice(exemplar: \"x\"), \"it\": Synthesize(exemplar: \"d\", preset: Regular)",
    ),
    (
        "guided synthesis",
        100,
        512,
        "SAMPLE \"t\": Perlin(size: 30), \"j\": JacobianFromAngleScale(angle: \"t\"), \
        \"it\": Synthesize(exemplar: \"x\", jacobian: \"j\")",
    ),
    (
        "samples",
        100,
        2048,
        "SAMPLE \"s\": Synthesize(exemplar: \"x\", size: (128, 128)), \"it\": SampleExemplar(coords: \"s\", input: \"c\")",
    ),
    (
        "magnified samples",
        100,
        2048,
        "SAMPLE \"s\": Synthesize(exemplar: \"x\", size: (128, 128)), \"it\": MagnifyCoords(coords: \"s\", input: \"c\")",
    ),
    (
        "branches",
        100,
        64,
        "\"pith\": TrunkNodes(height: (0, 100000), count: 10000, wander: 7), \"trunk\": FitSkeleton(curve: \"pith\"), \
        \"it\": Branches(skeleton: \"trunk\", whorl_spacing: 20)",
    ),
    ("growth", 200, 512, "TREE \"it\": CutPlane(solid: \"time\", preset: FlatSawn, distance: 20, height: 1200)"),
    ("rings", 200, 512, "TREE \"it\": CutPlane(solid: \"color\", preset: FlatSawn, distance: 20, height: 1200)"),
    (
        "fibres",
        200,
        512,
        "TREE \"s\": FiberStreaks(color: \"color\", fiber: \"fiber\"), \
        \"it\": CutPlane(solid: \"s\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
    (
        "pores",
        200,
        512,
        "TREE \"s\": WoodPores(color: \"color\", time: \"time\", fiber: \"fiber\"), \
        \"it\": CutPlane(solid: \"s\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
    (
        "rays",
        200,
        512,
        "TREE \"s\": WoodRays(color: \"color\", fiber: \"fiber\"), \
        \"it\": CutPlane(solid: \"s\", preset: FlatSawn, distance: 20, height: 1200)",
    ),
];

pub(crate) fn load(case: &Case) -> Graph {
    let (name, size, resolution, nodes) = case;
    let nodes = [("POINTS", POINTS), ("NET", NET), ("TREE", TREE), ("SAMPLE", SAMPLE)]
        .iter()
        .fold((*nodes).to_owned(), |text, (word, nodes)| text.replace(&format!("{word} "), nodes));
    let text =
        format!("(version: 1, canvas: (size_mm: {size}, resolution: {resolution}, tile: Both), nodes: {{ {nodes} }})");
    let options = LoadOptions {
        preset: None,
        set: Vec::new(),
        resolution: None,
        working_dir: env!("CARGO_MANIFEST_DIR").into(),
        limits: Limits::default(),
    };
    let loaded = load_text(Path::new("case.ron"), &text, &shibo_nodes::registry(), &options);
    loaded.graph.unwrap_or_else(|| panic!("{name}: {:#?}", loaded.diagnostics))
}

fn it(graph: &Graph) -> NodeIndex {
    graph.nodes.node_indices().find(|i| graph.nodes[*i].name == "it").unwrap()
}

/// Makes what the node `it` reads.
pub(crate) fn prepare(session: &Session, graph: &Graph) {
    for input in &graph.nodes[it(graph)].inputs {
        if let Input::Wire { node, output } = input {
            session.value(graph, (*node, *output), &CancelToken::default(), &Silent).unwrap();
        }
    }
}

/// Makes the node `it`, and its picture if it is a field.
pub(crate) fn work(session: &Session, graph: &Graph, token: &CancelToken) -> Result<(), Failure> {
    let field: Field = match session.value(graph, (it(graph), 0), token, &Silent)? {
        Value::Field(field) => field,
        Value::Picture(picture) => picture.rgb.clone(),
        _ => return Ok(()),
    };
    let size: UVec2 = graph.canvas.resolution;
    session.rasters(graph, &field, &[(graph.canvas.grid(size), Window::full(size))], token, &Silent).map(drop)
}

/// A session with the given threads.
pub(crate) fn session(threads: usize) -> Session {
    Session::new(shibo_nodes::registry(), &Settings { threads, ..Settings::default() }).unwrap()
}
