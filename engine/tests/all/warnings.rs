//! Warnings about values come with their tiles: the same ones from any cache, in any order, on any number of threads.
use crate::evaluating::Centre;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::eval::{CancelToken, Event, MemoryStore, NodeState, Observer, Shelf, Store};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Context, Gray, In, Node, Output, Outputs};
use shibo_picture::PartOf;
use shibo_value::clock::Stopwatch;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Key, Points, Stop, Tile, Tiling, Type, Window};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Uses enough thread time that the result is certainly stored.
fn work() {
    let start = Stopwatch::thread();
    while start.elapsed() < Duration::from_millis(4) {
        std::hint::spin_loop();
    }
}

/// A field that warns of its first pixel from a line on.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct Bad {
    /// The place of the line, x in mm.
    from: f64,
}

impl Node for Bad {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "A value.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        let from = self.from;
        Ok(Outputs::one(Field::generate(Type::Gray, Tiling::NONE, move |out: &mut Tile, given| {
            work();
            let (grid, Window { x, y, width, .. }) = (out.grid, out.window);
            let first = (x..).take(width as usize).map(|x| grid.center(x, y)).find(|at| at.x >= from);
            if let Some(at) = first {
                let problem = Problem::new(Code::Advice, format!("bad at {:.3}, {:.3}", at.x, at.y));
                given.warn(problem.at_mm([at.x, at.y, 0.0]));
            }
            out.data_mut().fill(0.5);
            Ok(())
        })))
    }
}

/// The mean of a pixel and the one above it and the one below it.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct Soft {
    /// Input.
    input: In<Gray>,
}

impl Node for Soft {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "A value.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let fill = |out: &mut Tile, [input]: [&Tile; 1]| {
            work();
            for y in 0..out.height() {
                let rows = [0, 1, 2].map(|dy| &input.row(0, y + dy)[1..=out.width()]);
                let means = rows[0].iter().zip(rows[1]).zip(rows[2]).map(|((a, b), c)| (a + b + c) / 3.0);
                let means: Vec<f32> = means.collect();
                out.row_mut(0, y).copy_from_slice(&means);
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Gray, [cx.get(&self.input)?], Halo::px(1), fill)))
    }
}

/// Points made of a picture.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct Sown {
    /// Input.
    input: In<Gray>,
}

impl Node for Sown {
    const OUTPUTS: &'static [Output] = &[Output::new("points", Type::Points, "Points.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let size = glam::UVec2::splat(350);
        let picture = cx.evaluator.raster(&cx.get(&self.input)?, &cx.canvas.grid(size), Window::full(size))?;
        work();
        let positions = vec![glam::Vec2::splat(picture.data()[0])];
        Ok(Outputs::one(Points { positions, size_mm: cx.size_mm(), pitch: 1.0, ..Points::default() }))
    }
}

/// The canvas has pixels of 0.01 mm and 3 × 3 tiles.
const GRAPH: &str = r#"(
    canvas: (size_mm: 7, resolution: 700, tile: None),
    nodes: {
        "bad": Bad(from: 0.032), "soft": Soft(input: "bad"), "rest": Soft(input: "soft"),
        "middle": Centre(input: "rest"), "points": Sown(input: "rest"),
    },
    outputs: { "soft": "soft", "rest": "rest", "middle": "middle" },
)"#;

/// The first pixel on the canvas whose centre lies beyond 0.032 mm.
const FIRST: &str = "bad at 0.035, 0.005";

fn registry() -> Registry {
    let kinds = vec![Kind::of::<Bad>(), Kind::of::<Soft>(), Kind::of::<Centre>(), Kind::of::<Sown>()];
    Registry::new([Family { name: "Tests", doc: "Nodes for tests.", kinds }])
}

fn graph() -> Graph {
    let loaded = load_text(Path::new("warnings.ron"), GRAPH, &registry(), &LoadOptions::default());
    loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

/// The messages of all warnings.
#[derive(Default)]
struct Told(Mutex<Vec<String>>);

impl Observer for Told {
    fn event(&self, event: Event) {
        if let Event::Warning(warning) = event {
            self.0.lock().unwrap().push(warning.message);
        }
    }
}

impl Told {
    fn all(self) -> Vec<String> {
        self.0.into_inner().unwrap()
    }
}

/// A store that keeps no files, so that a second run reads tiles.
struct NoFiles(Arc<MemoryStore>);

impl Store for NoFiles {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        if shelf == Shelf::Files { None } else { self.0.get(shelf, key) }
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], spared: Duration, stopped: &dyn Fn() -> bool) {
        if shelf != Shelf::Files {
            self.0.put(shelf, key, content, spared, stopped);
        }
    }

    fn remove(&self, shelf: Shelf, key: Key) {
        self.0.remove(shelf, key);
    }

    fn room(&self) -> u64 {
        self.0.room()
    }
}

fn session(threads: usize, memory: u64, store: Option<Box<dyn Store>>) -> Session {
    let settings = Settings { threads, memory, ..Settings::default() };
    Session::with_store(registry(), &settings, store).unwrap()
}

/// A session whose store is shared.
fn on(store: &Arc<MemoryStore>) -> Session {
    session(2, 256 << 20, Some(Box::new(NoFiles(store.clone()))))
}

fn store() -> Arc<MemoryStore> {
    Arc::new(MemoryStore::new(1 << 30))
}

/// The warnings of a render of an output, and the states of the nodes by name.
fn render(session: &Session, output: &str, region: Option<[u32; 4]>) -> (Vec<String>, Vec<(String, NodeState)>) {
    let (out, told) = (tempfile::tempdir().unwrap(), Told::default());
    let outputs = vec![output.to_owned()];
    let request = RenderRequest { dir: out.path().to_path_buf(), outputs, region, ..RenderRequest::default() };
    let report = session.render(&graph(), &request, &CancelToken::default(), &told).unwrap();
    (told.all(), report.nodes.into_iter().map(|node| (node.name, node.state)).collect())
}

fn state(states: &[(String, NodeState)], name: &str) -> NodeState {
    states.iter().find(|(node, _)| node == name).unwrap().1
}

#[test]
fn come_with_tiles_from_the_memory() {
    let session = session(2, 256 << 20, None);
    assert_eq!(render(&session, "soft", None).0, [FIRST]);
    let (again, states) = render(&session, "soft", None);
    assert_eq!((again, state(&states, "soft")), (vec![FIRST.to_owned()], NodeState::Memory));
    assert_eq!(render(&session, "rest", None).0, [FIRST]);
}

#[test]
fn come_with_tiles_from_the_store() {
    let store = store();
    assert_eq!(render(&on(&store), "rest", None).0, [FIRST]);
    let (again, states) = render(&on(&store), "rest", None);
    assert_eq!(again, [FIRST]);
    assert!(states.iter().all(|(_, state)| *state != NodeState::Computed), "{states:?}");
}

#[test]
fn come_with_files_from_the_store() {
    let store = store();
    let session = || session(2, 256 << 20, Some(Box::new(store.clone())));
    assert_eq!(render(&session(), "rest", None).0, [FIRST]);
    let (again, states) = render(&session(), "rest", None);
    assert_eq!(again, [FIRST]);
    let used = |state: &NodeState| matches!(state, NodeState::Computed | NodeState::Disk);
    assert!(!states.iter().any(|(_, state)| used(state)), "the file is copied: {states:?}");
}

#[test]
fn come_with_data_prepared_from_whole_pictures() {
    let store = store();
    assert_eq!(render(&on(&store), "middle", None).0, [FIRST]);
    assert_eq!(render(&on(&store), "middle", None).0, [FIRST]);
}

#[test]
fn come_with_objects_that_read_a_picture() {
    let store = store();
    let graph = graph();
    let node = graph.nodes.node_indices().find(|index| graph.nodes[*index].name == "points").unwrap();
    for _ in 0..2 {
        let told = Told::default();
        on(&store).value(&graph, (node, 0), &CancelToken::default(), &told).unwrap();
        // The picture has pixels of 0.02 mm.
        assert_eq!(told.all(), ["bad at 0.050, 0.010"]);
    }
}

#[test]
fn are_the_same_on_any_number_of_threads_and_with_any_memory() {
    for (threads, memory) in [(1, 256 << 20), (4, 256 << 20), (2, 2 << 20), (3, 4 << 20)] {
        assert_eq!(render(&session(threads, memory, None), "rest", None).0, [FIRST], "{threads} {memory}");
    }
}

/// A region has the warnings about its own pixels, also if the caches hold whole tiles.
#[test]
fn of_a_region_do_not_depend_on_the_caches() {
    // The filters read two pixels around the region.
    let region = Some([100, 50, 20, 20]);
    let wanted = ["bad at 0.985, 0.485"];
    assert_eq!(render(&session(2, 256 << 20, None), "rest", region).0, wanted);
    let warm = session(2, 256 << 20, None);
    assert_eq!(render(&warm, "middle", None).0, [FIRST]);
    assert_eq!(render(&warm, "rest", region).0, wanted);
    let store = store();
    assert_eq!(render(&on(&store), "rest", None).0, [FIRST]);
    assert_eq!(render(&on(&store), "rest", region).0, wanted);
    // A whole tile: the one in the store was made of whole tiles around it.
    let tile = Some([0, 256, 256, 256]);
    assert_eq!(render(&session(2, 256 << 20, None), "rest", tile).0, ["bad at 0.035, 2.545"]);
    assert_eq!(render(&on(&store), "rest", tile).0, ["bad at 0.035, 2.545"]);
}

/// Parts have the warnings about their own pixels, whether or not other parts have been computed before.
#[test]
fn of_parts_do_not_depend_on_their_order() {
    let wanted = [FIRST, "bad at 0.035, 2.545", "bad at 0.035, 5.105"];
    let graph = graph();
    let render = |session: &Session, number: u32| {
        let (out, told) = (tempfile::tempdir().unwrap(), Told::default());
        let outputs = vec!["rest".to_owned()];
        let request = RenderRequest { dir: out.path().to_path_buf(), outputs, once: true, ..RenderRequest::default() };
        let part = (PartOf { number, count: 3 }, "warnings");
        session.render_part(&graph, &request, part, &CancelToken::default(), &told).unwrap();
        told.all()
    };
    for order in [[1, 2, 3], [3, 2, 1], [2, 3, 1]] {
        let store = store();
        for number in order {
            let wanted = [wanted[number as usize - 1]];
            assert_eq!(render(&session(2, 256 << 20, None), number), wanted, "part {number} alone");
            assert_eq!(render(&on(&store), number), wanted, "part {number} of {order:?}");
        }
    }
}

/// Points are computed in several runs; each field has one warning, the first one from the top.
#[test]
fn of_points_are_told_once() {
    let (session, graph, told) = (session(2, 256 << 20, None), graph(), Told::default());
    let cancel = CancelToken::default();
    let (_, field) = session.pictures(&graph, "soft", &cancel, &told).unwrap().remove(0);
    let points: Vec<glam::DVec2> = (0..600).map(|n| glam::DVec2::new(3.0, 5.0 - 0.005 * f64::from(n))).collect();
    session.at_points(&graph, &field, &points, &cancel, &told).unwrap();
    // The last point lies at (3, 2.005), and the filter reads a pixel around it.
    assert_eq!(told.all(), ["bad at 2.990, 1.995"]);
}
