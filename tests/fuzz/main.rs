//! All readers of foreign input, fed with damaged input: none panics, hangs, or shows internals of the program.
//! `FUZZ_SECONDS=600 cargo test --release --test fuzz -- --nocapture --test-threads 1` is a long run; see
//! docs/internals/reliability.md. The page of `shibo watch` and the language server are in `tests/live/noise.rs`.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]
mod damage;
mod formulas;
#[path = "../../engine/picture/tests/all/pictures/mod.rs"]
mod pictures;

use damage::{fuzz, plain};
use shibo_bridge::lock::{Entry, Lock, Look, Sample, merge as merge_locks};
use shibo_bridge::{DiffRequest, GraphText, MergeRequest, Tools, diff, merge, to_json, to_ron};
use shibo_engine::eval::{CancelToken, Silent, decode, encode};
use shibo_engine::session::{Failure, Session, Settings};
use shibo_graph::syntax;
use shibo_graph::{Gate, LoadOptions, Loaded, load_text};
use shibo_picture::{header_bytes, join, read_bytes};
use shibo_value::Value;
use shibo_value::diagnostics::Diagnostic;
use shibo_value::expression::{self, Meaning, Names, UserFunction};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn root(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The contents of all files in a folder whose names end with `end`.
fn files(folder: &str, end: &str) -> Vec<Vec<u8>> {
    let mut paths: Vec<PathBuf> = root(folder).read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.to_string_lossy().ends_with(end));
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

fn told(diagnostics: &[Diagnostic]) {
    for diagnostic in diagnostics {
        plain(&diagnostic.message);
        diagnostic.help.as_deref().into_iter().for_each(plain);
    }
}

fn loaded(text: &str, path: &Path) -> Loaded {
    let loaded = load_text(path, text, &shibo_nodes::registry(), &LoadOptions::default());
    told(&loaded.diagnostics);
    assert!(loaded.graph.is_some() || !loaded.diagnostics.is_empty(), "a graph is refused without a reason");
    loaded
}

#[test]
fn loads_damaged_graphs() {
    let path = root("graphs/damaged.ron");
    let registry = shibo_nodes::registry();
    fuzz("graphs", &files("graphs", ".ron"), 400, |input| {
        let text = String::from_utf8_lossy(input);
        let loaded = load_text(&path, &text, &registry, &LoadOptions::default());
        told(&loaded.diagnostics);
        assert!(loaded.graph.is_some() || !loaded.diagnostics.is_empty(), "a graph is refused without a reason");
    });
}

#[test]
fn formats_damaged_graphs() {
    fuzz("layout", &files("graphs", ".ron"), 1500, |input| {
        let Ok(text) = std::str::from_utf8(input) else { return };
        let Ok(once) = syntax::format(text) else { return };
        assert_eq!(syntax::format(&once).as_ref(), Ok(&once), "another layout each time");
    });
}

#[test]
fn reads_damaged_locks() {
    let picture = |bits: &str| Sample { bits: bits.to_owned(), look: vec![Look(118.2, 21.4, 6.1, 8.0, 9.7)] };
    let entry = |bits: &str| Entry {
        pins: 4,
        text: "9c1e2b".to_owned(),
        files: [("hide.png".to_owned(), "4567".to_owned())].into(),
        pictures: [("lit".to_owned(), picture(bits)), ("m.height".to_owned(), picture("0"))].into(),
    };
    let lock = Lock([("a.ron", "1"), ("b \"c\".ron", "2")].map(|(name, bits)| (name.to_owned(), entry(bits))).into());
    fuzz("locks", &[lock.written().into_bytes(), b"{}".to_vec()], 5000, |input| {
        let Ok(text) = std::str::from_utf8(input) else { return };
        match Lock::read(text) {
            Ok(read) => {
                let again = Lock::read(&read.written()).unwrap();
                assert_eq!(again.written(), read.written(), "a lock changes when it is written");
                merge_locks(&lock, &read, &Lock::default());
            }
            Err(reason) => plain(&reason),
        }
    });
}

/// The differences, the merge and the JSON form of texts that are no good graphs.
#[test]
fn compares_and_merges_damaged_graphs() {
    let tools = Tools {
        registry: Arc::new(shibo_library::registry()),
        import_paths: Vec::new(),
        gate: Gate::default(),
        cancel: CancelToken::default(),
    };
    let mut seeds = files("graphs", ".ron");
    seeds.retain(|seed| seed.len() < 6000);
    let whole = String::from_utf8(seeds[0].clone()).unwrap();
    let ours = format!("// Ours.\n{whole}");
    let graph = |text: &str| GraphText { path: root("graphs/damaged.ron"), text: text.to_owned() };
    fuzz("versions", &seeds, 200, |input| {
        let text = String::from_utf8_lossy(input);
        let request = DiffRequest { before: Some(graph(&whole)), after: Some(graph(&text)), comments: true };
        diff(&tools, &request);
        let path = root("graphs/damaged.ron");
        let sides = MergeRequest {
            base: whole.clone(),
            ours: ours.clone(),
            theirs: text.clone().into_owned(),
            path,
            marker_size: 7,
        };
        let merged = merge(&tools, &sides);
        assert!(merged.refused.is_none(), "{:?}", merged.refused);
        let json = to_json(&tools, &graph(&text));
        let ron = json.and_then(|json| to_ron(&tools, &graph(&json)));
        let loaded = load_text(&root("graphs/damaged.ron"), &text, &tools.registry, &LoadOptions::default());
        if loaded.graph.is_some() {
            let ron = ron.unwrap_or_else(|faults| panic!("a good graph has no JSON form: {faults:?}"));
            let request = DiffRequest { before: Some(graph(&text)), after: Some(graph(&ron)), comments: false };
            let changes = diff(&tools, &request).changes;
            assert!(changes.is_empty(), "the JSON form has another meaning: {changes:?}");
        }
    });
}

/// Names in expressions, of every type.
struct Any;

impl Names for Any {
    fn param(&mut self, name: &str) -> Meaning {
        match name {
            "a" => Meaning::Known(expression::Value::Number(-1.5)),
            "b" => Meaning::Known(expression::Value::Vector(vec![1.0, 2.0, 0.0])),
            "c" => Meaning::Choice("On".into(), vec!["On".into(), "Off".into()]),
            _ => Meaning::Broken,
        }
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        match name {
            "u" => Some(Meaning::Planes { first: 0, count: 1 }),
            "v" => Some(Meaning::Planes { first: 1, count: 3 }),
            "w" => Some(Meaning::Any { first: 4 }),
            "ids" => Some(Meaning::Ids { plane: 8 }),
            _ => None,
        }
    }

    fn all(&self) -> Vec<String> {
        vec!["u".into(), "v".into(), "w".into(), "ids".into()]
    }

    fn has_words(&self) -> bool {
        true
    }

    fn seed(&mut self) -> Option<u64> {
        Some(7)
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        Some(seed)
    }

    fn function(&mut self, name: &str) -> Option<Arc<UserFunction>> {
        let function = |params: &[&str], body: &str| {
            let params = params.iter().map(|param| (*param).to_owned()).collect();
            Some(Arc::new(UserFunction { name: name.to_owned(), params, body: body.to_owned() }))
        };
        match name {
            "f" => function(&["x", "w"], "let y = x * w; g(y) + y.x"),
            "g" => function(&["x"], "luminance(x) + random(x)"),
            _ => None,
        }
    }
}

#[test]
fn compiles_damaged_expressions() {
    let seeds = [
        "1 + 2 * -$a ^ 2 % 3",
        "clamp(0.5 + (2.2 * (u - 0.5) * $a), 0, 1)",
        "if $c == On && u < 0.5 || !(v.x >= 1) { mix(v, $b, 0.25) } else { [u, 1e-3, smoothstep(0, 1, u)] }",
        "$c == Off ? random(1) : noise(u * 9, v.y) + fract(sin(360 * u))",
        "max(abs(-1), sqrt(2), pow(2, 0.5), atan(1, 2), min(1, 2)) / 0",
        "$b.y + length($b) + dot(v, $b)",
        "let p = v.bgr * w.x; let q = f(p, 2); q + random(ids, 3 + 1) * f(w, u)",
        "rotate((u, 2), 30).yx + from_oklab(oklab(v)).rg * (ids == 4)",
    ];
    let seeds: Vec<Vec<u8>> = seeds.iter().map(|text| text.as_bytes().to_vec()).collect();
    fuzz("expressions", &seeds, 30_000, |input| {
        formulas::compiled(&String::from_utf8_lossy(input));
    });
}

#[test]
fn reads_damaged_pictures() {
    fuzz("pictures", &pictures::samples(), 6000, |input| {
        let read = read_bytes(input, &pictures::LIMITS);
        if let Err(error) =
            read.as_ref().map_err(ToString::to_string).and(header_bytes(input).map_err(|e| e.to_string()))
        {
            plain(&error);
        }
        if let Ok(picture) = read {
            assert_eq!(picture.planes.len(), picture.pixels() * usize::from(picture.channels));
        }
    });
}

/// Evaluates `nodes`, whose node `node` reads the file `name`, with damaged files.
fn by_file((target, name): (&str, &str), seeds: &[Vec<u8>], count: usize, nodes: &str) {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings { threads: 1, memory: 64 << 20, ..Settings::default() };
    let session = Session::new(shibo_nodes::registry(), &settings).unwrap();
    let graph = folder.path().join("graph.ron");
    let text = format!(
        "(version: 1, canvas: (size_mm: 8, resolution: 16), nodes: {{ {nodes} }}, outputs: {{ \"node\": \"node\" }})"
    );
    let path = folder.path().join(name);
    fuzz(target, seeds, count, |input| {
        std::fs::write(&path, input).unwrap();
        let Some(graph) = loaded(&text, &graph).graph else { return };
        let output = graph.outputs.first().unwrap();
        let made = session.value(&graph, (output.node, output.output), &CancelToken::default(), &Silent);
        if let Err(Failure::Errors(errors)) = made {
            told(&errors);
        }
    });
}

#[test]
fn reads_damaged_svg() {
    let other = br##"<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="8mm" viewBox="0 0 8 8">
<defs><linearGradient id="g"><stop offset="0" stop-color="red"/><stop offset="1"/></linearGradient><clipPath id="c"><circle r="3"/></clipPath>
<filter id="f"><feGaussianBlur stdDeviation="2"/></filter><mask id="m"><rect width="9" height="9" fill="url(#g)"/></mask></defs>
<g clip-path="url(#c)" mask="url(#m)" filter="url(#f)" transform="rotate(30) scale(1e-3)"><path d="M1 1C2 2 3 3 4 1A2 2 0 0 1 5 5z" stroke-dasharray="1 .1"/></g>
<use xlink:href="#g"/><image href="data:image/png;base64,AAAA"/><text x="1">a</text><style>path{fill:blue}</style></svg>"##;
    let seeds: Vec<Vec<u8>> = files("library/examples", ".svg").into_iter().chain([other.to_vec()]).collect();
    by_file(("svg", "a.svg"), &seeds, 1500, r#""node": Svg(path: "a.svg")"#);
}

#[test]
fn reads_damaged_point_lists() {
    let seeds = [b"1,2\n3.5,-4e0\n# a remark\n 5 , 6 \n".to_vec(), b"1,2\r\n\"3\",4\r\n\r\n1e7,0".to_vec()];
    by_file(("csv", "a.csv"), &seeds, 3000, r#""node": PointList(file: "a.csv")"#);
}

/// OBJ, GLB and glTF, which are recognised by their content; and nodes that read the mesh.
#[test]
fn reads_damaged_meshes() {
    let nodes = r#""mesh": LoadMesh(path: "a.obj"), "atlas": MeshAtlas(mesh: "mesh", page: 64), "flow": TangentField(mesh: "mesh", from: Smooth),
        "node": JacobianFromMesh(atlas: "atlas", frames: "flow")"#;
    by_file(("meshes", "a.obj"), &files("tests/meshes", "e.obj"), 400, nodes);
}

#[test]
fn reads_damaged_fonts() {
    let seeds = files("nodes/fonts", ".otf");
    by_file(("fonts", "a.otf"), &seeds, 150, r#""node": Text(text: "Shibo 0", font: "a.otf")"#);
}

/// Results of costly nodes, which are kept between runs and machines.
#[test]
fn decodes_damaged_results() {
    let text = r#"(version: 1, canvas: (size_mm: 8, resolution: 16), nodes: {
        "points": PoissonPoints(pitch: 1), "links": ConnectNeighbors(points: "points"), "noise": Perlin(size: 2),
        "exemplar": Exemplar(input: "noise", size: (16, 16)), "coords": Synthesize(exemplar: "exemplar", size: (16, 16)),
        "trunk": TrunkNodes(), "skeleton": FitSkeleton(curve: "trunk"),
    }, outputs: { "noise": "noise" })"#;
    let settings = Settings { threads: 1, memory: 64 << 20, ..Settings::default() };
    let session = Session::new(shibo_nodes::registry(), &settings).unwrap();
    let graph = loaded(text, &root("graphs/kept.ron")).graph.unwrap();
    let value = |node| session.value(&graph, (node, 0), &CancelToken::default(), &Silent).unwrap();
    let seeds: Vec<Vec<u8>> = graph.nodes.node_indices().filter_map(|node| encode(&value(node))).collect();
    assert!(seeds.len() >= 5, "only {} of the nodes are kept", seeds.len());
    fuzz("kept", &seeds, 20_000, |input| {
        if let Some(read) = decode(input) {
            assert!(!matches!(read, Value::Field(_)));
        }
    });
}

#[test]
fn joins_damaged_parts() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, broken, out) = (folder.path().join("whole"), folder.path().join("broken"), folder.path().join("out"));
    let graph = folder.path().join("a.ron");
    let text = r#"(version: 1, canvas: (size_mm: 8, resolution: 300), nodes: { "noise": Perlin(size: 2) }, outputs: { "noise": "noise" })"#;
    std::fs::write(&graph, text).unwrap();
    for part in ["1/2", "2/2"] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_shibo"));
        command.arg("render").arg(&graph).args(["--part", part, "--no-cache", "-o"]).arg(&whole);
        assert!(command.output().unwrap().status.success());
    }
    let mut parts: Vec<PathBuf> = whole.read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    parts.sort();
    let seeds: Vec<Vec<u8>> = parts.iter().map(|part| std::fs::read(part).unwrap()).collect();
    std::fs::create_dir_all(&broken).unwrap();
    fuzz("parts", &seeds, 600, |input| {
        let names = parts.iter().map(|part| broken.join(part.file_name().unwrap()));
        for (name, bytes) in names.zip([input, &seeds[1][..]]) {
            std::fs::write(name, bytes).unwrap();
        }
        if let Err(error) = join(&broken, &out, 1 << 24, &|_, _| true) {
            plain(&error.to_string());
            assert!(!out.exists() || out.read_dir().unwrap().count() == 0, "half a picture");
        }
        let _ = std::fs::remove_dir_all(&out);
    });
}
