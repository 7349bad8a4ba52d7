//! Cache entries are never trusted: for any content of the cache folder or another kind of store, a render writes the
//! same files without a warning.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use proptest::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::eval::{CancelToken, Event, MemoryStore, NodeState, Observer, Shelf, Store, encode};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Context, Gray, In, Node, Output, Outputs};
use shibo_value::clock::Stopwatch;
use shibo_value::{Channel, Curve, Field, Halo, Key, Material, Points, Stop, Tile, Tiling, Type, Value};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Uses enough thread time that the result is certainly stored.
fn work() {
    let start = Stopwatch::thread();
    while start.elapsed() < Duration::from_millis(4) {
        std::hint::spin_loop();
    }
}

macro_rules! node {
    ($(#[$doc:meta])* $name:ident { $($field:ident: $ty:ty),* } $output:expr, |$node:ident, $cx:ident| $body:expr) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(default)]
        struct $name { $($field: $ty),* }

        impl Node for $name {
            const OUTPUTS: &'static [Output] = &[$output];

            fn evaluate(&self, $cx: &Context<'_>) -> Result<Outputs, Stop> {
                let $node = self;
                $body
            }
        }
    };
}

node! { /// Some points.
    Some { count: f64 } Output::new("points", Type::Points, "Points."), |node, cx| {
        work();
        let size_mm = cx.size_mm();
        let at = |k: u16| (glam::Vec2::new(f32::from(k * 7 % 13), f32::from(k * 5 % 11)) + 0.5) * 0.7;
        let count = (0..100_u16).take_while(|k| f64::from(*k) < node.count);
        let positions = count.map(at).collect();
        Ok(Outputs::one(Points { positions, size_mm, periodic: Tiling::NONE, pitch: 1.0, ..Points::default() }))
    }
}

node! { /// The distance of the nearest point.
    Near { points: In<Points> } Output::new("value", Type::Gray, "A distance."), |node, cx| {
        let points = cx.get(&node.points)?;
        Ok(Outputs::one(Field::generate(Type::Gray, Tiling::NONE, move |out: &mut Tile, _| {
            work();
            let (grid, window) = (out.grid, out.window);
            for (i, v) in (0..).zip(out.data_mut()) {
                let width = window.width.cast_signed();
                let here = grid.center(window.x + i % width, window.y + i / width).as_vec2();
                *v = points.positions.iter().map(|p| p.distance(here)).fold(9.0, f32::min) / 9.0;
            }
            Ok(())
        })))
    }
}

node! { /// The difference from the pixel above.
    Steep { input: In<Gray> } Output::new("value", Type::Gray, "A slope."), |node, cx| {
        let input = cx.get(&node.input)?;
        Ok(Outputs::one(Field::map(Type::Gray, [input], Halo::px(1), |out: &mut Tile, [input]: [&Tile; 1]| {
            work();
            for y in 0..out.height() {
                let width = out.width();
                let (above, here) = (&input.row(0, y)[1..=width], &input.row(0, y + 1)[1..=width]);
                let slopes = above.iter().zip(here).map(|(a, b)| 10.0 * (b - a).abs());
                out.row_mut(0, y).iter_mut().zip(slopes).for_each(|(o, slope)| *o = slope);
            }
            Ok(())
        })))
    }
}

node! { /// A material of two channels.
    Both { height: In<Gray>, ao: In<Gray> } Output::new("material", Type::Material, "A material."), |node, cx| {
        let channels = [(Channel::Height, cx.get(&node.height)?), (Channel::Ao, cx.get(&node.ao)?)];
        Ok(Outputs::one(Material::new(channels)))
    }
}

const GRAPH: &str = r#"(
    canvas: (size_mm: 8, resolution: 300, tile: None),
    nodes: {
        "few": Some(count: 20), "many": Some(count: 60),
        "far": Near(points: "few"), "near": Near(points: "many"),
        "steep": Steep(input: "far"), "edges": Steep(input: "near"),
        "made": Both(height: "steep", ao: "near"),
    },
    outputs: { "made": "made", "edges": "edges", "far": "far" },
)"#;

fn registry() -> Registry {
    let kinds = vec![Kind::of::<Some>(), Kind::of::<Near>(), Kind::of::<Steep>(), Kind::of::<Both>()];
    Registry::new([Family { name: "Tests", doc: "Nodes for tests.", kinds }])
}

fn graph() -> Graph {
    let loaded = load_text(Path::new("store.ron"), GRAPH, &registry(), &LoadOptions::default());
    loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

/// Fails on any event except progress.
struct Quiet;

impl Observer for Quiet {
    fn event(&self, event: Event) {
        assert!(!matches!(event, Event::Warning(_)), "{event:?}");
    }
}

/// The shelves that the graph fills. None of its fields prepares whole pictures.
const SHELVES: [Shelf; 4] = [Shelf::Objects, Shelf::Tiles, Shelf::Files, Shelf::Channels];

type Files = BTreeMap<String, Vec<u8>>;

/// The files that a render writes, and the nodes that it computes.
fn render(session: &Session) -> (Files, Vec<String>) {
    let out = tempfile::tempdir().unwrap();
    let request = RenderRequest { dir: out.path().to_path_buf(), once: true, ..RenderRequest::default() };
    let report = session.render(&graph(), &request, &CancelToken::default(), &Quiet).unwrap();
    let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
    let files = report.files.iter().map(|path| (name(path), fs::read(path).unwrap())).collect();
    let computed = report.nodes.into_iter().filter(|node| node.state == NodeState::Computed);
    (files, computed.map(|node| node.name).collect())
}

fn in_folder(dir: &Path, registry: Registry) -> Session {
    let settings = Settings { threads: 2, cache_dir: Some(dir.to_path_buf()), ..Settings::default() };
    Session::new(registry, &settings).unwrap()
}

/// The entries of a cache folder.
fn entries(dir: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut stack = vec![dir.to_path_buf()];
    while let Some(dir) = stack.pop() {
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { stack.push(path) } else { files.push(path) }
        }
    }
    files.sort();
    files
}

fn copy_all(from: &Path, to: &Path) {
    for path in entries(from) {
        let target = to.join(path.strip_prefix(from).unwrap());
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(path, target).unwrap();
    }
}

/// A cache folder after a render, the rendered files, and a cache folder of another build.
struct Shop {
    cache: tempfile::TempDir,
    other: tempfile::TempDir,
    files: Files,
}

impl Shop {
    fn new() -> Self {
        let [cache, other] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let (files, computed) = render(&in_folder(cache.path(), registry()));
        assert_eq!((files.len(), computed.len()), (4, 6));
        assert_eq!(render(&in_folder(other.path(), registry().with_code("other"))).0, files);
        let shelves: Vec<usize> = SHELVES.iter().map(|shelf| entries(&cache.path().join(shelf.name())).len()).collect();
        // Two lists of points; four tiles each of four fields, some of them skipped for two fields; four files; one
        // material.
        assert!(shelves[0] == 2 && shelves[1] >= 12 && shelves[2..] == [4, 1], "{shelves:?}");
        Self { cache, other, files }
    }
}

/// The ways in which an entry is damaged.
#[derive(Clone, Debug)]
enum Damage {
    Exchange(usize, usize),
    /// Replaces another entry, on any shelf.
    Copy(usize, usize),
    Flip(usize, usize),
    Cut(usize, usize),
    Grow(usize, Vec<u8>),
    Replace(usize, Vec<u8>),
    Remove(usize),
    Folder(usize),
    /// Comes from another build.
    Foreign(usize, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let at = || any::<usize>();
    let bytes = || proptest::collection::vec(any::<u8>(), 0..200);
    prop_oneof![
        (at(), at()).prop_map(|(a, b)| Damage::Exchange(a, b)),
        (at(), at()).prop_map(|(a, b)| Damage::Copy(a, b)),
        (at(), at()).prop_map(|(a, b)| Damage::Flip(a, b)),
        (at(), at()).prop_map(|(a, b)| Damage::Cut(a, b)),
        (at(), bytes()).prop_map(|(a, bytes)| Damage::Grow(a, bytes)),
        (at(), bytes()).prop_map(|(a, bytes)| Damage::Replace(a, bytes)),
        at().prop_map(Damage::Remove),
        at().prop_map(Damage::Folder),
        (at(), at()).prop_map(|(a, b)| Damage::Foreign(a, b)),
    ]
}

fn apply(damage: &Damage, all: &[PathBuf], foreign: &[PathBuf]) {
    let path = |at: &usize| &all[at % all.len()];
    let read = |at: &usize| fs::read(path(at)).unwrap_or_default();
    let write = |at: &usize, bytes: &[u8]| drop(fs::write(path(at), bytes));
    match damage {
        Damage::Exchange(a, b) => {
            let (x, y) = (read(a), read(b));
            write(a, &y);
            write(b, &x);
        }
        Damage::Copy(a, b) => write(b, &read(a)),
        Damage::Flip(a, at) => {
            let mut bytes = read(a);
            let length = bytes.len().max(1);
            bytes.iter_mut().skip(at % length).take(1).for_each(|byte| *byte ^= 1 << (at % 8));
            write(a, &bytes);
        }
        Damage::Cut(a, to) => {
            let bytes = read(a);
            write(a, &bytes[..to % (bytes.len() + 1)]);
        }
        Damage::Grow(a, more) => write(a, &[read(a), more.clone()].concat()),
        Damage::Replace(a, bytes) => write(a, bytes),
        Damage::Remove(a) => drop(fs::remove_file(path(a))),
        Damage::Folder(a) => {
            let _ = fs::remove_file(path(a));
            let _ = fs::create_dir(path(a));
        }
        Damage::Foreign(a, b) => write(a, &fs::read(&foreign[b % foreign.len()]).unwrap()),
    }
}

#[test]
fn writes_the_same_files_for_any_content_of_the_folder() {
    let shop = Shop::new();
    let foreign = entries(shop.other.path());
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig { cases: 40, ..ProptestConfig::default() });
    let few = proptest::collection::vec(damage(), 1..12);
    let outcome = runner.run(&few, |all| {
        let dir = tempfile::tempdir().unwrap();
        copy_all(shop.cache.path(), dir.path());
        // A folder without a valid marker is not a cache, so the marker is not damaged.
        let mut paths = entries(dir.path());
        paths.retain(|path| !path.ends_with("CACHEDIR.TAG"));
        all.iter().for_each(|damage| apply(damage, &paths, &foreign));
        prop_assert!(render(&in_folder(dir.path(), registry())).0 == shop.files);
        // A second render finds the repaired entries, except where a folder blocks the path.
        let (files, computed) = render(&in_folder(dir.path(), registry()));
        prop_assert!(files == shop.files);
        let blocked = all.iter().any(|damage| matches!(damage, Damage::Folder(_)));
        prop_assert!(blocked || computed.is_empty(), "{computed:?}");
        Ok(())
    });
    outcome.unwrap();
}

#[test]
fn recomputes_exchanged_entries() {
    let shop = Shop::new();
    for shelf in SHELVES {
        let dir = tempfile::tempdir().unwrap();
        copy_all(shop.cache.path(), dir.path());
        // Without the files and channel lists, the entries of the other shelves are read.
        for gone in [Shelf::Files, Shelf::Channels].into_iter().filter(|gone| *gone != shelf) {
            fs::remove_dir_all(dir.path().join(gone.name())).unwrap();
        }
        let all = entries(&dir.path().join(shelf.name()));
        let contents: Vec<Vec<u8>> = all.iter().map(|path| fs::read(path).unwrap()).collect();
        for (path, content) in all.iter().zip(contents.iter().cycle().skip(1)) {
            fs::write(path, content).unwrap();
        }
        assert!(render(&in_folder(dir.path(), registry())).0 == shop.files, "{shelf:?}");
    }
}

#[test]
fn other_builds_compute_everything_and_keep_old_entries() {
    let shop = Shop::new();
    let before = entries(shop.cache.path());
    let other = || registry().with_code("another build of the nodes");
    let (files, computed) = render(&in_folder(shop.cache.path(), other()));
    assert!(files == shop.files);
    assert_eq!(computed.len(), 6);
    assert!(render(&in_folder(shop.cache.path(), other())).1.is_empty());
    assert!(render(&in_folder(shop.cache.path(), registry())).1.is_empty());
    assert!(before.iter().all(|path| path.exists()));
}

/// A store in memory that tests can inspect.
#[derive(Default)]
struct Open(Mutex<BTreeMap<(&'static str, Key), Vec<u8>>>);

impl Store for Open {
    fn get(&self, shelf: Shelf, key: Key) -> Option<Vec<u8>> {
        self.0.lock().unwrap().get(&(shelf.name(), key)).cloned()
    }

    fn put(&self, shelf: Shelf, key: Key, content: &[u8], _spared: Duration, _stopped: &dyn Fn() -> bool) {
        self.0.lock().unwrap().insert((shelf.name(), key), content.to_vec());
    }

    fn remove(&self, shelf: Shelf, key: Key) {
        self.0.lock().unwrap().remove(&(shelf.name(), key));
    }

    fn room(&self) -> u64 {
        1 << 40
    }
}

fn on(store: Arc<dyn Store>) -> Session {
    let settings = Settings { threads: 2, ..Settings::default() };
    Session::with_store(registry(), &settings, Some(Box::new(store))).unwrap()
}

#[test]
fn a_store_need_not_be_a_folder() {
    let store = Arc::new(MemoryStore::new(1 << 30));
    let (files, computed) = render(&on(store.clone()));
    assert_eq!(computed.len(), 6);
    let (again, computed) = render(&on(store));
    assert!(again == files && computed.is_empty());
    // A store without room behaves like no store.
    let (none, computed) = render(&on(Arc::new(MemoryStore::new(0))));
    assert!(none == files && computed.len() == 6);
}

#[test]
fn rejects_impossible_contents() {
    let store = Arc::new(Open::default());
    let (files, _) = render(&on(store.clone()));
    let good = store.0.lock().unwrap().clone();
    let curve = encode(&Value::Curve(Arc::new(Curve { points: Vec::new() }))).unwrap();
    let wrong = |shelf: &str| match shelf {
        // An object of the wrong type, a tile of the wrong size, an unknown channel.
        "objects" => vec![curve.clone(), Vec::new(), vec![2, b'P', 255, 255, 255, 255]],
        "tiles" => vec![Vec::new(), vec![0; 4 * 300]],
        _ => vec![vec![99; 17], vec![0; 5]],
    };
    for shelf in [Shelf::Objects, Shelf::Tiles, Shelf::Channels] {
        for content in wrong(shelf.name()) {
            let mut entries = good.clone();
            entries.retain(|at, _| at.0 != "files");
            let mut changed = 0;
            for (_, entry) in entries.iter_mut().filter(|((on, _), _)| *on == shelf.name()) {
                entry.clone_from(&content);
                changed += 1;
            }
            assert!(changed > 0, "{shelf:?}");
            *store.0.lock().unwrap() = entries;
            assert!(render(&on(store.clone())).0 == files, "{shelf:?} {} bytes", content.len());
            let left = store.0.lock().unwrap();
            assert!(left.iter().all(|((on, _), entry)| *on != shelf.name() || *entry != content), "{shelf:?}");
        }
    }
}
