//! The node reference matches the code: its text, and a picture of every node's example.
//!
//! `BLESS=1 cargo test --release --test shipped docs` rewrites `docs/nodes.md` and `docs/nodes/KIND.png`.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::bless;
use crate::golden;

use crate::picture::{Picture, SIDE};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_value::{Channel, Field, Object, Points, Sketch, Value, Window};
use std::path::{Path, PathBuf};

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

#[test]
fn the_reference_is_up_to_date() {
    let page = std::process::Command::new(assert_cmd::cargo::cargo_bin!("shibo"))
        .args(["nodes", "--format", "markdown"])
        .output()
        .unwrap();
    assert!(page.status.success(), "{}", String::from_utf8_lossy(&page.stderr));
    bless::compare(&root("docs/nodes.md"), &page.stdout).unwrap();
}

/// The inside of `nodes: { … }` in a doc comment.
fn example(doc: &str) -> Option<String> {
    let block = doc.split("```ron\n").nth(1)?.split("```").next()?;
    block.contains("\"example\"").then(|| block.to_owned())
}

/// The graph of an example; its files are in `library/examples`.
fn graph(session: &Session, kind: &str, example: &str) -> Result<Graph, String> {
    let text = format!(
        "( version: 1, canvas: (size_mm: 40, resolution: {SIDE}, tile: Both, seed: 1),\nnodes: {{\n{example}\n}} )"
    );
    let path = root("library/examples").join(format!("{kind}.ron"));
    let options = LoadOptions { working_dir: root("library/examples"), ..LoadOptions::default() };
    let loaded = load_text(&path, &text, session.registry(), &options);
    let found: Vec<String> = loaded
        .diagnostics
        .iter()
        .map(|d| {
            format!("line {}: {}", loaded.sources.position(d.span.file, d.span.start).line.saturating_sub(2), d.message)
        })
        .collect();
    // Examples must not cause warnings either.
    loaded.graph.filter(|_| found.is_empty()).ok_or_else(|| found.join("; "))
}

/// The picture of the node `example`; `None` for a mesh, whose picture is drawn by `shibo render --view mesh`.
fn show(session: &Session, graph: &Graph) -> Result<Option<Picture>, String> {
    let mut nodes = graph.nodes.node_indices();
    let node = nodes.find(|&i| graph.nodes[i].name == "example").ok_or("there is no node `example`")?;
    let cancel = CancelToken::default();
    let value = session.value(graph, (node, 0), &cancel, &Silent).map_err(|e| format!("{e:?}"))?;
    let field = |field: &Field| {
        let size = glam::UVec2::splat(SIDE);
        let wanted = [(graph.canvas.grid(size), Window::full(size))];
        let (mut tiles, _) = session.rasters(graph, field, &wanted, &cancel, &Silent).map_err(|e| format!("{e:?}"))?;
        Ok::<_, String>(Picture::of_tile(field.ty(), &tiles.remove(0)))
    };
    if let Some(shown) = value.field() {
        return field(&shown).map(Some);
    }
    match &value {
        Value::Material(material) => {
            let shown = material.get(Channel::BaseColor).or_else(|| material.channels().first().map(|(_, f)| f));
            field(shown.ok_or("the material has no channels")?).map(Some)
        }
        Value::Lattice(lattice) => Ok(Some(Picture::of_lattice(lattice))),
        Value::SpringNet(springs) => Ok(Some(Picture::of_lattice(&springs.lattice))),
        other => match other.sketch() {
            Some(Sketch::Canvas(shapes)) => Ok(Some(Picture::of_shapes(&shapes))),
            Some(Sketch::Pixels(pixels)) => Ok(Some(Picture::of_pixels(&pixels))),
            Some(Sketch::Space(_)) => Ok(None),
            None => Err(format!("a {} cannot be shown", other.ty())),
        },
    }
}

fn check(session: &Session, kind: &str) -> Result<(), String> {
    let doc = session.registry().info(kind).map(|info| info.doc.clone()).unwrap_or_default();
    let example = example(&doc).ok_or("its doc comment has no ```ron block with a node `example`")?;
    let picture = graph(session, kind, &example).and_then(|graph| show(session, &graph))?;
    let path = root("docs/nodes").join(format!("{kind}.png"));
    match picture {
        Some(picture) if picture.is_flat() => Err("its picture is of one colour".to_owned()),
        Some(picture) => golden::compare(&path, &picture),
        None if path.is_file() => Ok(()),
        None => Err("it has no picture".to_owned()),
    }
}

#[test]
fn saves_failed_picture_beside_expected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kept.png");
    let points = |at: f32| {
        let points = Points { positions: vec![glam::Vec2::splat(at)], ..Points::default() };
        let Some(Sketch::Canvas(shapes)) = points.sketch() else { panic!("points are drawn on the canvas") };
        Picture::of_shapes(&shapes)
    };
    let (kept, made) = (points(10.0), points(30.0));
    kept.write(&path).unwrap();
    assert_eq!(golden::compare(&path, &kept), Ok(()));
    let compared = golden::compare(&path, &made);
    if bless::blessing() {
        assert_eq!((compared, golden::compare(&path, &made)), (Ok(()), Ok(())));
        return;
    }
    let message = compared.unwrap_err();
    let shown = message.lines().nth(1).and_then(|line| line.split(": ").nth(1)).unwrap();
    let shown = image::open(shown).unwrap().to_rgb8();
    assert_eq!((shown.width(), shown.height()), (3 * SIDE + 8, SIDE));
    // 10 mm and 30 mm of a canvas of 40 mm: each dot is in its panel, both are in the difference.
    let dot = |panel: u32, quarter: u32| shown.get_pixel(panel * (SIDE + 4) + quarter * SIDE / 4, quarter * SIDE / 4).0;
    assert!(dot(0, 1)[0] < 100 && dot(0, 3)[0] > 200 && dot(1, 1)[0] > 200 && dot(1, 3)[0] < 100);
    assert!(dot(2, 1)[0] > 200 && dot(2, 3)[0] > 200 && dot(2, 2)[0] == 0);
}

#[test]
fn every_example_is_as_pictured() {
    let session = Session::new(shibo_nodes::registry(), &Settings::default()).unwrap();
    std::fs::create_dir_all(root("docs/nodes")).unwrap();
    let kinds: Vec<String> = session.registry().kinds().map(str::to_owned).collect();
    let problems: Vec<String> = kinds
        .iter()
        .filter_map(|kind| check(&session, kind).err().map(|problem| format!("{kind}: {problem}")))
        .collect();
    // Pictures of removed kinds.
    let mut strays = Vec::new();
    for entry in std::fs::read_dir(root("docs/nodes")).unwrap().flatten() {
        let stem = entry.path().file_stem().map_or(String::new(), |s| s.to_string_lossy().into_owned());
        if !kinds.contains(&stem) {
            strays.extend(bless::stray(&entry.path()).err());
        }
    }
    let all: Vec<String> = problems.into_iter().chain(strays).collect();
    assert!(all.is_empty(), "{}", all.join("\n"));
}
