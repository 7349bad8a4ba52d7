//! Evaluation of deep and wide graphs: computes each value once, and no node waits for values that it does not read.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]
#![allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "small numbers")]

use crate::evaluating::{SOLIDS, registry};
use glam::UVec2;
use shibo_engine::eval::{CancelToken, NodeStats, Silent};
use shibo_engine::session::{Failure, RenderRequest, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_value::{Tile, Value, Window};
use std::fmt::Write;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

/// Held by tests that run solids, whose runs are counted.
static COUNTED: Mutex<()> = Mutex::new(());

fn graph(nodes: &str, output: &str, resolution: u32) -> Graph {
    let text = format!(
        "(canvas: (size_mm: 16, resolution: {resolution}, tile: Both), nodes: {{ {nodes} }}, \
         outputs: {{ \"out\": \"{output}\" }})"
    );
    let loaded = load_text(Path::new("evaluation.ron"), &text, &registry(), &LoadOptions::default());
    loaded.graph.unwrap_or_else(|| panic!("{:?}", &loaded.diagnostics[..1]))
}

fn session(memory: u64) -> Session {
    Session::new(registry(), &Settings { threads: 2, memory, ..Settings::default() }).unwrap()
}

/// The picture of the output.
fn picture(session: &Session, graph: &Graph) -> Tile {
    let (cancel, output) = (CancelToken::default(), &graph.outputs[0]);
    let Value::Field(field) = session.value(graph, (output.node, output.output), &cancel, &Silent).unwrap() else {
        panic!("no field")
    };
    let size = graph.canvas.resolution;
    let wanted = [(graph.canvas.grid(size), Window::full(size))];
    session.rasters(graph, &field, &wanted, &cancel, &Silent).unwrap().0.pop().unwrap()
}

fn render(session: &Session, graph: &Graph) -> Vec<NodeStats> {
    let dir = tempfile::tempdir().unwrap();
    let request = RenderRequest { dir: dir.path().to_path_buf(), ..RenderRequest::default() };
    session.render(graph, &request, &CancelToken::default(), &Silent).unwrap().nodes
}

fn chain(count: usize, first: &str, link: impl Fn(usize) -> String) -> String {
    let mut text = format!("\"n0\": {first}, ");
    for i in 1..=count {
        write!(text, "\"n{i}\": {}, ", link(i - 1)).unwrap();
    }
    text
}

#[test]
fn chains_of_any_length_are_computed() {
    const COUNT: usize = 20_000;
    let session = session(256 << 20);
    let last = format!("n{COUNT}");
    let plus = chain(COUNT, "Ramp()", |i| format!("Plus(a: \"n{i}\")"));
    assert_eq!(picture(&session, &graph(&plus, &last, 4)).data()[0], COUNT as f32);
    let smooth = chain(COUNT, "Ramp(factor: 1)", |i| format!("Smooth(input: \"n{i}\")"));
    let middle = picture(&session, &graph(&smooth, &last, 4)).data()[5];
    assert!((middle - 2.5).abs() < 0.01, "{middle}");
    let shift = chain(COUNT, "Ramp(factor: 1)", |i| format!("Shift(input: \"n{i}\", by: 0, most: 1)"));
    assert_eq!(picture(&session, &graph(&shift, &last, 4)).data()[5], 2.0);
    let centre = chain(2_000, "Ramp(factor: 1)", |i| format!("Centre(input: \"n{i}\")"));
    assert_eq!(picture(&session, &graph(&centre, "n2000", 2)).data(), [-1.0, 0.0, 0.0, 1.0]);
    let objects = chain(COUNT, "Seed()", |i| format!("Seed(after: \"n{i}\")"));
    let both = format!("{objects} \"both\": Both(a: \"{last}\", b: \"n0\")");
    assert_eq!(picture(&session, &graph(&both, "both", 1)).data(), [0.0]);
    let _alone = COUNTED.lock();
    let solids = chain(COUNT, "Block()", |i| format!("Block(a: \"n{i}\")"));
    let slice = format!("{solids} \"slice\": Slice(solid: \"{last}\")");
    assert_eq!(picture(&session, &graph(&slice, "slice", 1)).data(), [8.0 + COUNT as f32]);
}

#[test]
fn wide_graphs_are_computed() {
    const COUNT: usize = 20_000;
    let mut text = String::new();
    let mut last = Vec::new();
    for i in 0..COUNT {
        write!(text, "\"p{i}\": Seed(tells: false), \"b{i}\": Both(a: \"p{i}\", b: \"p0\"), ").unwrap();
        last.push(format!("\"b{i}\""));
    }
    let mut sums = 0;
    while last.len() > 1 {
        let pairs: Vec<Vec<String>> = last.chunks(2).map(<[String]>::to_vec).collect();
        last = pairs
            .into_iter()
            .map(|pair| {
                sums += 1;
                write!(text, "\"s{sums}\": Plus(a: {}, b: {}), ", pair[0], pair.last().unwrap()).unwrap();
                format!("\"s{sums}\"")
            })
            .collect();
    }
    let graph = graph(&text, last[0].trim_matches('"'), 8);
    assert_eq!(picture(&session(256 << 20), &graph).data()[0], 15.0);
}

#[test]
fn computes_shared_fields_once() {
    // Without sharing, twenty levels would take a million tiles.
    let text = chain(20, "Ramp()", |i| format!("Plus(a: \"n{i}\", b: \"n{i}\")"));
    let stats = render(&session(64 << 20), &graph(&text, "n20", 256));
    let tiles: Vec<u64> = stats.iter().map(|node| node.tiles).collect();
    assert_eq!(tiles, [1; 21]);
}

#[test]
fn computes_shared_solids_once() {
    let text = chain(20, "Block()", |i| format!("Block(a: \"n{i}\", b: \"n{i}\")"));
    let graph = graph(&format!("{text} \"slice\": Slice(solid: \"n20\")"), "slice", 256);
    let session = session(64 << 20);
    let _alone = COUNTED.lock();
    let before = SOLIDS.load(Ordering::Relaxed);
    assert_eq!(picture(&session, &graph).data()[0], 20.0 + 16.0 / 512.0);
    let solid = |name: &str| {
        let node = graph.nodes.node_indices().find(|i| graph.nodes[*i].name == name).unwrap();
        session.value(&graph, (node, 0), &CancelToken::default(), &Silent).unwrap()
    };
    let Value::Solid(last) = solid("n20") else { panic!("no solid") };
    assert_eq!(last.at(&[glam::DVec3::new(3.0, 0.0, 0.0)]), [23.0]);
    let ran = SOLIDS.load(Ordering::Relaxed) - before;
    assert_eq!(ran, 42, "once in the cut and once at the point");
}

#[test]
fn splits_tiles_that_would_read_too_much() {
    let by = "\"ramp\": Ramp(factor: 1), \"by\": Ramp(factor: 80000)";
    let text = format!("{by}, \"out\": Shift(input: \"ramp\", by: \"by\", most: 20000000)");
    let picture = picture(&session(256 << 20), &graph(&text, "out", 16));
    for y in 0..16_u32 {
        for (x, v) in (0..16_u32).zip(picture.row(0, y as usize)) {
            assert_eq!(*v, ((x + 80_000 * (x + y)) % 16 + y) as f32);
        }
    }
}

#[test]
fn long_nodes_delay_only_their_readers() {
    let text = "\"long\": Wait(), \"a\": Seed(), \"b\": Seed(after: \"a\"), \"c\": Seed(after: \"b\", tells: true), \
                \"both\": Both(a: \"long\", b: \"c\")";
    assert_eq!(picture(&session(64 << 20), &graph(text, "both", 1)).data(), [0.0]);
}

#[test]
fn pictures_are_the_same_whatever_the_budget() {
    let text = "\"ramp\": Ramp(factor: 1), \"soft\": Smooth(input: \"ramp\"), \"by\": Ramp(factor: 0.5), \
                \"bent\": Shift(input: \"soft\", by: \"by\", most: 900), \"mid\": Centre(input: \"bent\"), \
                \"out\": Plus(a: \"mid\", b: \"soft\")";
    let graph = graph(text, "out", 700);
    let roomy = picture(&session(256 << 20), &graph);
    assert_eq!(roomy, picture(&session(2 << 20), &graph));
    assert_eq!(graph.canvas.resolution, UVec2::splat(700));
}

#[test]
fn cancelled_runs_report_nothing() {
    let text = chain(50, "Ramp()", |i| format!("Smooth(input: \"n{i}\")"));
    let cancel = CancelToken::default();
    cancel.cancel();
    let graph = graph(&text, "n50", 64);
    let output = &graph.outputs[0];
    let value = session(64 << 20).value(&graph, (output.node, output.output), &cancel, &Silent);
    assert_eq!(value.map(drop), Err(Failure::Cancelled));
}

#[test]
fn a_window_is_written_into_memory_of_the_caller() {
    let session = session(64 << 20);
    let graph = graph("\"a\": Ramp(factor: 1)", "a", 300);
    let cancel = CancelToken::default();
    let (name, field) = session.pictures(&graph, "out", &cancel, &Silent).unwrap().remove(0);
    assert_eq!(name, "out");
    let grid = graph.canvas.grid(graph.canvas.resolution);
    // Across the border between blocks, and beyond the edge of the picture, where the picture repeats.
    for window in [Window { x: 250, y: 3, width: 40, height: 290 }, Window { x: -7, y: 290, width: 20, height: 30 }] {
        let mut mine = vec![f32::NAN; window.len()];
        session.raster_into(&graph, &field, (&grid, window), &mut mine, &cancel, &Silent).unwrap();
        for (i, value) in mine.iter().enumerate() {
            let (x, y) = (window.x + (i % window.width as usize) as i32, window.y + (i / window.width as usize) as i32);
            assert_eq!(*value, (x.rem_euclid(300) + y.rem_euclid(300)) as f32, "{x}, {y}");
        }
    }
    let mut wrong = vec![0.0; 10];
    let window = Window { x: 0, y: 0, width: 3, height: 3 };
    let failed = session.raster_into(&graph, &field, (&grid, window), &mut wrong, &cancel, &Silent);
    assert_eq!(failed.unwrap_err(), Failure::Usage("the window has 9 values, the memory for them 10".to_owned()));
    let unknown = session.pictures(&graph, "height", &cancel, &Silent).unwrap_err();
    assert!(unknown.to_string().contains("no output `height`"), "{unknown}");
}
