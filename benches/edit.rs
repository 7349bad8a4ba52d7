//! Latency from an edit to the picture: `cargo bench -p shibo --bench edit`. A parameter of a shipped graph changes,
//! and the lit picture is computed again from the caches in memory, as in `shibo watch`. Medians of wall time.
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::LoadOptions;
use shibo_value::{Resolution, Value, Window};
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

/// Side of the picture in pixels.
const SIDE: u32 = 512;

/// Loads the graph with one parameter changed, and computes the picture of its output `lit`.
fn picture(session: &Session, path: &Path, set: &[(&str, f64)]) -> Duration {
    let start = Instant::now();
    let options = LoadOptions {
        set: set.iter().map(|(name, value)| ((*name).to_owned(), value.to_string())).collect(),
        resolution: Some(Resolution::Exact(glam::UVec2::splat(SIDE))),
        ..LoadOptions::default()
    };
    let graph = session.load(path, &options).graph.expect("a shipped graph");
    let output = graph.outputs.iter().find(|output| output.name == "lit").expect("a lit picture");
    let cancel = CancelToken::default();
    let value = session.value(&graph, (output.node, output.output), &cancel, &Silent);
    let Ok(Value::Field(field)) = value else { panic!("no picture") };
    let size = graph.canvas.resolution;
    let whole = [(graph.canvas.grid(size), Window::full(size))];
    black_box(session.rasters(&graph, &field, &whole, &cancel, &Silent).expect("a picture"));
    start.elapsed()
}

fn main() {
    for (graph, late, good) in [("inlay", "lacquer", 100), ("inlay", "sunk", 0), ("monogram", "gold", 0)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("graphs/{graph}.ron"));
        let session = Session::new(shibo_nodes::registry(), &Settings::default()).expect("a session");
        let first = picture(&session, &path, &[]);
        let mut times: Vec<Duration> =
            (1..=15).map(|k| picture(&session, &path, &[(late, 0.01 * f64::from(k))])).collect();
        times.sort_unstable();
        let bound = if good > 0 { format!(" (at most {good} ms)") } else { String::new() };
        println!(
            "{graph:10} {SIDE}²: first picture {:4} ms, after an edit of `{late}` {:3} ms{bound}",
            first.as_millis(),
            times[times.len() / 2].as_millis()
        );
    }
}
