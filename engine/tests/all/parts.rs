//! Pictures in parts: the joined files equal those of a single run, and the parts compute little more than it does.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]
#![allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "small numbers")]

use shibo_engine::eval::{CancelToken, Event, MemoryStore, Observer, Silent};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Context, Gray, In, Node, Output, Outputs};
use shibo_picture::{PartOf, join};
use shibo_value::{Field, Halo, Stop, Tile, Type};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Number of filtered pixels.
static PIXELS: AtomicU64 = AtomicU64::new(0);
/// Locked by tests that count.
static COUNTED: Mutex<()> = Mutex::new(());

/// Mean of the pixels `reach` above and below; counts the pixels it computes.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Across {
    /// Input.
    input: In<Gray>,
    /// Reach in pixels.
    reach: u32,
}

impl Node for Across {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "A value.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let reach = self.reach as usize;
        let fill = move |out: &mut Tile, [input]: [&Tile; 1]| {
            PIXELS.fetch_add(out.window.len() as u64, Ordering::Relaxed);
            for row in 0..out.height() {
                let (above, below) = (input.row(0, row), input.row(0, row + 2 * reach));
                let means = above[reach..].iter().zip(&below[reach..]).map(|(a, b)| 0.5 * (a + b));
                out.row_mut(0, row).iter_mut().zip(means).for_each(|(v, mean)| *v = mean);
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Gray, [cx.get(&self.input)?], Halo::px(reach), fill)))
    }
}

fn registry() -> Registry {
    use crate::evaluating::{Centre, Plus, Ramp, Shift, Smooth};
    let kinds = vec![
        Kind::of::<Ramp>(),
        Kind::of::<Plus>(),
        Kind::of::<Smooth>(),
        Kind::of::<Shift>(),
        Kind::of::<Centre>(),
        Kind::of::<Across>(),
    ];
    Registry::new([Family { name: "Test", doc: "For tests.", kinds }])
}

fn graph(nodes: &str, outputs: &str, (width, height): (u32, u32), tile: &str) -> Graph {
    let text = format!(
        "(canvas: (size_mm: ({width}, {height}), resolution: ({width}, {height}), tile: {tile}), \
         nodes: {{ {nodes} }}, outputs: {{ {outputs} }})"
    );
    let loaded = load_text(Path::new("parts.ron"), &text, &registry(), &LoadOptions::default());
    loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

fn session() -> Session {
    Session::new(registry(), &Settings { threads: 2, memory: 256 << 20, ..Settings::default() }).unwrap()
}

fn request(dir: &Path) -> RenderRequest {
    RenderRequest { dir: dir.to_path_buf(), once: true, ..RenderRequest::default() }
}

/// The files in a folder.
fn files(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = dir.read_dir().unwrap().map(|entry| entry.unwrap().path());
    let read = |path: std::path::PathBuf| {
        (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap())
    };
    let mut files: Vec<_> = entries.map(read).collect();
    files.sort();
    files
}

/// Renders the parts in reverse order, each in its own session, and joins them.
fn in_parts(graph: &Graph, count: u32) -> Vec<(String, Vec<u8>)> {
    let [parts, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let request = request(parts.path());
    for number in (1..=count).rev() {
        let part = (PartOf { number, count }, "parts");
        let report = session().render_part(graph, &request, part, &CancelToken::default(), &Silent).unwrap();
        assert!(!report.known);
        let again = session().render_part(graph, &request, part, &CancelToken::default(), &Silent).unwrap();
        assert!(again.known);
    }
    join(parts.path(), out.path(), 64 << 20, &|_, _| true).unwrap();
    files(out.path())
}

/// Renders each part in an empty folder, so that no part finds results of another.
fn apart(graph: &Graph, count: u32) {
    for number in 1..=count {
        let (parts, part) = (tempfile::tempdir().unwrap(), (PartOf { number, count }, "parts"));
        session().render_part(graph, &request(parts.path()), part, &CancelToken::default(), &Silent).unwrap();
    }
}

fn whole(graph: &Graph) -> Vec<(String, Vec<u8>)> {
    let out = tempfile::tempdir().unwrap();
    session().render(graph, &request(out.path()), &CancelToken::default(), &Silent).unwrap();
    files(out.path())
}

const NODES: &str = r#"
    "ramp": Ramp(factor: 0.0004),
    "far": Across(input: "ramp", reach: 90),
    "both": Plus(a: "far", b: "ramp"),
    "near": Across(input: "both", reach: 3),
    "soft": Smooth(input: "near"),
    "moved": Shift(input: "soft", by: "far", most: 40),
    "even": Centre(input: "moved"),
    "last": Across(input: "even", reach: 11),
"#;
const OUTPUTS: &str = r#"
    "last": "last",
    "float": File(from: "moved", format: Exr, depth: F32),
    "half": File(from: "near", format: Exr, depth: F16),
    "tiff": File(from: "far", format: Tiff),
"#;

#[test]
fn joined_parts_are_the_files_of_a_single_run() {
    let _counted = COUNTED.lock();
    for tile in ["Both", "None", "X", "Y"] {
        for (size, count) in [((300, 1100), 5), ((256, 1024), 4), ((520, 700), 2), ((90, 300), 1)] {
            let graph = graph(NODES, OUTPUTS, size, tile);
            assert!(whole(&graph) == in_parts(&graph, count), "{tile} {size:?}");
        }
    }
}

#[test]
fn parts_compute_little_more_than_a_single_run() {
    let _counted = COUNTED.lock();
    let mut nodes = "\"n0\": Ramp(factor: 0.001), ".to_owned();
    for i in 1..=4 {
        nodes += &format!("\"n{i}\": Across(input: \"n{}\", reach: 5), ", i - 1);
    }
    let graph = graph(&nodes, "\"out\": \"n4\"", (512, 4096), "Both");
    let count = |work: &dyn Fn()| {
        PIXELS.store(0, Ordering::Relaxed);
        work();
        PIXELS.load(Ordering::Relaxed)
    };
    let alone = count(&|| drop(whole(&graph)));
    assert_eq!(alone, 4 * 512 * 4096);
    // Each part is a single row of tiles.
    let parts = count(&|| apart(&graph, 16));
    assert!(parts * 10 <= alone * 12, "{parts} of {alone}");
}

/// A chain of slow filters, each of which reads `reach` pixels beyond its window.
fn filters(reach: u32, size: (u32, u32), tile: &str) -> Graph {
    let mut nodes = "\"n0\": Ramp(factor: 0.001), ".to_owned();
    for i in 1..=4 {
        nodes += &format!("\"n{i}\": Across(input: \"n{}\", reach: {reach}), ", i - 1);
    }
    graph(&nodes, "\"out\": \"n4\"", size, tile)
}

fn counted(work: impl FnOnce()) -> u64 {
    PIXELS.store(0, Ordering::Relaxed);
    work();
    PIXELS.load(Ordering::Relaxed)
}

#[test]
fn computes_shared_pixels_once_in_any_order() {
    let _counted = COUNTED.lock();
    for (tile, orders) in
        [("Both", &[[8, 7, 6, 5, 4, 3, 2, 1], [5, 2, 8, 1, 4, 7, 3, 6]][..]), ("None", &[[1, 2, 3, 4, 5, 6, 7, 8]])]
    {
        let graph = filters(30, (512, 2048), tile);
        let mut right = Vec::new();
        let alone = counted(|| right = whole(&graph));
        let apart = counted(|| apart(&graph, 8));
        assert!(apart * 4 > alone * 5, "filters reach too little for this test: {apart} of {alone}");
        for order in orders {
            let [parts, out] = [(); 2].map(|()| tempfile::tempdir().unwrap());
            let store = Arc::new(MemoryStore::new(1 << 30));
            let shared = counted(|| {
                for number in *order {
                    let part = (PartOf { number, count: 8 }, "parts");
                    let request = request(parts.path());
                    let settings = Settings { threads: 2, memory: 256 << 20, ..Settings::default() };
                    let session = Session::with_store(registry(), &settings, Some(Box::new(store.clone()))).unwrap();
                    session.render_part(&graph, &request, part, &CancelToken::default(), &Silent).unwrap();
                }
            });
            assert!(shared * 100 <= alone * 103, "{tile} {order:?}: {shared} of {alone}, {apart} without");
            join(parts.path(), out.path(), 64 << 20, &|_, _| true).unwrap();
            assert!(files(out.path()) == right, "{tile} {order:?}");
        }
    }
}

/// Counts the row bands.
#[derive(Default)]
struct Bands(AtomicU64);

impl Observer for Bands {
    fn event(&self, event: Event) {
        if matches!(event, Event::Rows { .. }) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[test]
fn strips_pass_on_shared_pixels() {
    let _counted = COUNTED.lock();
    let graph = filters(100, (8192, 2304), "Both");
    let made = |memory: u64| {
        let out = tempfile::tempdir().unwrap();
        let session = Session::new(registry(), &Settings { threads: 2, memory, ..Settings::default() }).unwrap();
        let bands = Bands::default();
        let count = counted(|| {
            session.render(&graph, &request(out.path()), &CancelToken::default(), &bands).unwrap();
        });
        let pictures = files(out.path());
        assert_eq!(pictures.len(), 1, "the files that wait are gone");
        (pictures, count as f64 / (4.0 * 8192.0 * 2304.0), bands.0.into_inner())
    };
    // The smaller memory holds two strips, but not the whole picture.
    let (whole, once, bands) = made(2 << 30);
    let (strips, count, more) = made(136 << 20);
    assert!(once == 1.0 && more >= 2 * bands, "the picture was not made in strips: {once}, {more} of {bands}");
    assert!(count < 1.03, "{count}");
    let [whole, strips] = [whole, strips].map(|of| shibo_picture::read_bytes(&of[0].1, &Default::default()).unwrap());
    assert!(whole.planes == strips.planes);
}

#[test]
fn a_region_is_cut_out_of_the_whole() {
    let _counted = COUNTED.lock();
    let graph = graph(NODES, "\"last\": \"last\"", (600, 900), "Both");
    let all = whole(&graph);
    let out = tempfile::tempdir().unwrap();
    let cut = RenderRequest { region: Some([130, 250, 200, 301]), ..request(out.path()) };
    session().render(&graph, &cut, &CancelToken::default(), &Silent).unwrap();
    let cut = shibo_picture::read_bytes(&files(out.path())[0].1, &Default::default()).unwrap();
    let whole = shibo_picture::read_bytes(&all[0].1, &Default::default()).unwrap();
    for y in 0..301 {
        let row = &whole.planes[(250 + y) * 600 + 130..][..200];
        assert_eq!(&cut.planes[y * 200..][..200], row, "{y}");
    }
}
