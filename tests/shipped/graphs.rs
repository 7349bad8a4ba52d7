//! Every shipped graph has no errors or warnings, renders, is seamless, and looks like its golden pictures.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]
use crate::bless;
use crate::golden;

use crate::picture::Picture;
use glam::UVec2;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{Graph, LoadOptions, load};
use shibo_value::{Field, Resolution, Tile, Tiling, Type, Value, Window};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Side of golden pictures in pixels.
const SIDE: u32 = 128;

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

pub(super) fn shipped() -> Vec<PathBuf> {
    let mut graphs = Vec::new();
    for folder in ["graphs", "graphs/lib"] {
        let files = std::fs::read_dir(root(folder)).unwrap().map(|e| e.unwrap().path());
        graphs.extend(files.filter(|path| path.extension().is_some_and(|e| e == "ron")));
    }
    graphs.sort();
    assert!(graphs.len() >= 6, "{graphs:?}");
    graphs
}

fn session() -> Session {
    Session::new(shibo_nodes::registry(), &Settings { threads: 2, ..Settings::default() }).unwrap()
}

/// A graph at `side`² pixels, or at its own resolution.
fn graph(session: &Session, path: &Path, side: Option<u32>) -> Graph {
    let resolved = |resolution| load(path, session.registry(), &LoadOptions { resolution, ..LoadOptions::default() });
    let own = resolved(None);
    let messages: Vec<&str> = own.diagnostics.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(messages, Vec::<&str>::new(), "{}", path.display());
    // Squares, although the canvas may have another shape.
    let square = side.map(|side| resolved(Some(Resolution::Exact(UVec2::splat(side)))));
    square.unwrap_or(own).graph.unwrap()
}

/// The fields of all outputs with their pixels in `part`, named as their files are. Outputs for other programs are left
/// out, because they contain the same.
fn pictures(session: &Session, graph: &Graph, part: Window) -> Vec<(String, Field, Tile)> {
    let cancel = CancelToken::default();
    let mut fields = Vec::new();
    for output in graph.outputs.iter().filter(|output| output.mesh.is_none()) {
        let value = session.value(graph, (output.node, output.output), &cancel, &Silent).unwrap();
        match value {
            Value::Field(field) => fields.push((output.name.clone(), field)),
            Value::Material(material) => fields.extend(
                material.channels().iter().map(|(c, field)| (format!("{}_{}", output.name, c.name()), field.clone())),
            ),
            // Segments are not compared; the nodes that draw them are.
            Value::Segments(_) => {}
            // Bodies of meshes are tested in `tests/cli/objects.rs`.
            other if other.ty() == Type::Mesh => {}
            other => panic!("{}: {}", output.name, other.ty()),
        }
    }
    let parts = [(graph.canvas.grid(graph.canvas.resolution), part)];
    let raster = |(name, field): (String, Field)| {
        let tile = session.rasters(graph, &field, &parts, &cancel, &Silent).unwrap().0.remove(0);
        assert!(tile.data().iter().all(|v| v.is_finite()), "{name}");
        (name, field, tile)
    };
    fields.into_iter().map(raster).collect()
}

/// The families of shipped graphs.
const FAMILIES: [&str; 16] = [
    "leather",
    "wood",
    "metal",
    "stone",
    "earth",
    "concrete and plaster",
    "ceramics and glass",
    "paint and lacquer",
    "fabric",
    "knit and rope",
    "plastic and rubber",
    "paper and print",
    "organic",
    "ground cover",
    "hybrid",
    "study",
];

#[test]
fn every_graph_names_its_family() {
    let session = session();
    for graph in shibo_library::graphs().iter().filter(|graph| !graph.is_part()) {
        let loaded = load(&root("graphs").join(graph.path), session.registry(), &LoadOptions::default());
        let family = loaded.graph.unwrap().family;
        assert_eq!(family.as_deref(), graph.family(), "{}", graph.name);
        assert!(family.is_some_and(|family| FAMILIES.contains(&family.as_str())), "{}", graph.name);
    }
}

/// In these graphs a joint of boards or tiles, the edge of a thread or a scratch lies exactly on the edge of the picture. The steps
/// across the edge must not exceed the largest step inside by much. A picture that is rolled by half its size shows no line.
const JOINT_AT_EDGE: [&str; 6] = ["carbon_twill", "cardboard", "concrete", "glazed_tile", "worn_strap", "zellige"];

/// Steps on each side of the edge that are compared with the step across it.
const NEAR: usize = 3;

/// A seam is a step across the edge of the picture that is large for the picture, and larger than the steps beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seam {
    /// The mean step across the edge, divided by the median, or the largest, of the mean steps inside.
    inside: f32,
    /// The mean step across the edge, divided by the mean of the largest of [`NEAR`] steps on each side.
    beside: f32,
}

impl Seam {
    /// The seam between the last and the first line of samples along one direction. `at` gives the sample `along` a line.
    fn of(lines: usize, length: usize, at: impl Fn(usize, usize) -> f32, largest: bool) -> Self {
        let step = |line: usize, along: usize| (at(line % lines, along) - at((line + lines - 1) % lines, along)).abs();
        let mean = |values: &mut dyn Iterator<Item = f32>| values.sum::<f32>() / length as f32;
        let mut steps: Vec<f32> =
            (1..lines).map(|line| mean(&mut (0..length).map(|along| step(line, along)))).collect();
        steps.sort_by(f32::total_cmp);
        let usual = if largest { steps[steps.len() - 1] } else { steps[steps.len() / 2] };
        let across = mean(&mut (0..length).map(|along| step(0, along)));
        let sides = || (1..=NEAR).flat_map(|offset| [offset, lines - offset]);
        let near = |along: usize| sides().map(|line| step(line, along)).fold(0.0, f32::max);
        let beside = mean(&mut (0..length).map(near));
        Self { inside: across / usual.max(1e-9), beside: across / beside.max(1e-9) }
    }

    /// True if the eye would find it.
    fn shows(self, largest: bool) -> bool {
        if largest { self.inside >= 1.3 } else { self.inside >= 1.6 && self.beside >= 1.0 }
    }
}

/// The seams of a picture from left to right, and from top to bottom.
fn seams_of(tile: &Tile, largest: bool) -> [Seam; 2] {
    let (w, h) = (tile.width(), tile.height());
    let at = |x: usize, y: usize| tile.row(0, y)[x];
    [Seam::of(w, h, at, largest), Seam::of(h, w, |y, x| at(x, y), largest)]
}

#[test]
fn finds_seams_of_waves_that_do_not_repeat() {
    let seam = |waves: f32| {
        let at = |x: usize, y: usize| (std::f32::consts::TAU * waves * (x as f32 / 64.0) + y as f32).sin();
        Seam::of(64, 64, at, false)
    };
    assert!(!seam(3.0).shows(false), "{:?}", seam(3.0));
    assert!(seam(3.4).shows(false), "{:?}", seam(3.4));
    // A spot that lies across the edge is no seam.
    let from_middle = |x: usize| (x as f32 - 2.0).abs().min((x as f32 - 66.0).abs());
    let spot = |x: usize, y: usize| if (28..36).contains(&y) { (16.0 - from_middle(x).powi(2)).max(0.0) } else { 0.0 };
    let spot = Seam::of(64, 64, spot, false);
    assert!(spot.inside > 1.6 && !spot.shows(false), "{spot:?}");
}

#[test]
fn every_graph_is_seamless_and_matches_golden() {
    let folder = root("tests/golden");
    let left = Mutex::new(shipped().into_iter());
    let found = Mutex::new((Vec::new(), BTreeSet::new()));
    let look = || {
        let session = session();
        loop {
            let Some(path) = left.lock().unwrap().next() else { return };
            // One session for both checks, so that objects without a resolution are made once.
            let seams = seams(&session, &path);
            found.lock().unwrap().0.extend(seams);
            for (name, picture) in shown(&session, &path) {
                let golden = folder.join(format!("{name}.png"));
                let problem = golden::compare(&golden, &picture).err();
                let mut found = found.lock().unwrap();
                found.0.extend(problem);
                found.1.insert(golden);
            }
            session.caches().memory.clear();
        }
    };
    // Two graphs at a time, because a small graph mostly uses one thread.
    std::thread::scope(|scope| [(); 2].map(|()| scope.spawn(look)).map(|worker| worker.join().unwrap()));
    let (mut problems, looked_at) = found.into_inner().unwrap();
    let kept = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let pictures = kept.filter(|path| path.extension().is_some_and(|ending| ending == "png"));
    problems.extend(pictures.filter(|path| !looked_at.contains(path)).filter_map(|path| bless::stray(&path).err()));
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// The outputs of a graph that have a seam.
fn seams(session: &Session, path: &Path) -> Vec<String> {
    let mut seams = Vec::new();
    let side = 256;
    let graph = graph(session, path, Some(side));
    assert!(session.advice(&graph).is_empty(), "{}", path.display());
    assert!(!graph.outputs.is_empty(), "{}", path.display());
    // A canvas that does not tile has no seam.
    if graph.canvas.tile == Tiling::NONE {
        return seams;
    }
    let largest = JOINT_AT_EDGE.iter().any(|name| path.file_stem().is_some_and(|stem| stem == *name));
    for (name, field, tile) in pictures(session, &graph, Window::full(UVec2::splat(side))) {
        let place = format!("{} {name}", path.display());
        if graph.canvas.tile == Tiling::BOTH {
            assert_eq!(field.tiling(), Tiling::BOTH, "{place}");
        }
        if field.tiling() == Tiling::BOTH && field.as_constant().is_none() {
            let found = seams_of(&tile, largest).into_iter().filter(|seam| seam.shows(largest));
            seams.extend(found.map(|seam| format!("{place}: {seam:?}")));
        }
    }
    seams
}

/// The golden pictures of a graph, by name.
fn shown(session: &Session, path: &Path) -> Vec<(String, Picture)> {
    let small = graph(session, path, Some(SIDE));
    let stem = path.file_stem().unwrap().display().to_string();
    let mut shown = Vec::new();
    let mut plain = Vec::new();
    let mut show = |name: &str, field: &Field, tile: &Tile| {
        shown.push((format!("{stem}_{name}"), Picture::of_tile(field.ty(), tile)));
    };
    for (name, field, tile) in pictures(session, &small, Window::full(UVec2::splat(SIDE))) {
        // The lit picture shows all of a material; without one, the colour or the normals are compared.
        let lit = is_lit(&name) || !small.outputs.iter().any(|o| is_lit(&o.name));
        let seen = lit && matches!(field.ty(), Type::Gray | Type::Rgb | Type::Normal);
        if seen && field.as_constant().is_none() {
            if is_plain(&tile) {
                plain.push(name);
            } else {
                show(&name, &field, &tile);
            }
        }
    }
    if plain.is_empty() {
        return shown;
    }
    // Details too fine for a small picture: a crop at full resolution.
    let large = graph(session, path, None);
    let corner = ((large.canvas.resolution - SIDE) / 2).as_ivec2();
    let part = Window { x: corner.x, y: corner.y, width: SIDE, height: SIDE };
    for (name, field, tile) in pictures(session, &large, part) {
        if plain.contains(&name) {
            assert!(!is_plain(&tile), "{stem} {name}: nothing to be seen");
            show(&name, &field, &tile);
        }
    }
    shown
}

/// True for the picture of a material in light.
fn is_lit(name: &str) -> bool {
    name == "lit" || name.ends_with("_lit")
}

/// True if all values are equal.
fn is_plain(tile: &Tile) -> bool {
    tile.data().iter().all(|v| *v == tile.data()[0])
}

#[test]
fn presets_and_parameters_are_sound() {
    let session = session();
    for path in shipped() {
        let plain = graph(&session, &path, Some(64));
        for preset in plain.presets.clone() {
            let options = LoadOptions { preset: Some(preset.clone()), ..LoadOptions::default() };
            let loaded = load(&path, session.registry(), &options);
            assert!(loaded.graph.is_some(), "{} {preset}: {:?}", path.display(), loaded.diagnostics);
        }
        for param in plain.params.iter().filter(|p| p.ty != "Path" && p.ty != "Text") {
            assert!(param.doc.len() > 8, "{} {}", path.display(), param.name);
            for edge in param.range.map_or(Vec::new(), |(lo, hi)| vec![lo, hi]) {
                let options =
                    LoadOptions { set: vec![(param.name.clone(), edge.to_string())], ..LoadOptions::default() };
                let loaded = load(&path, session.registry(), &options);
                assert!(loaded.graph.is_some(), "{} {}={edge}: {:?}", path.display(), param.name, loaded.diagnostics);
            }
        }
    }
}
