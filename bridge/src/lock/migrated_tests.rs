//! Graphs that follow the answers of a table of changes: `check` finds nothing, and exact answers keep the bits.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use super::{RESOLUTION, Sample, sample};
use crate::testing::tools;
use crate::{CheckRequest, GraphText, Tools, check};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Session, Settings};
use shibo_graph::{LoadOptions, load_text};
use shibo_ide::Workspace;
use shibo_ide::actions::{answered, pinned};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// The shipped nodes with a table of two changes.
fn changed(line: &str) -> Tools {
    let first = r#"(change: 1, all: true, version: 1, look: Look, what: "first", touches: All, worst: 0, keeps: Gone)"#;
    let table = format!("[{first}, (change: 2, {line}, touches: All, what: \"new\", worst: 0.1, keeps: Gone)]");
    Tools { registry: Arc::new(shibo_library::registry().with_changes(Box::leak(table.into_boxed_str()))), ..tools() }
}

/// The pictures of a graph with the newest versions, which stand for the earlier ones too.
fn pictures(tools: &Tools, text: &str) -> BTreeMap<String, Sample> {
    let options = LoadOptions { resolution: Some(RESOLUTION), newest: true, ..LoadOptions::default() };
    let loaded = load_text(Path::new("a.ron"), text, &tools.registry, &options);
    let graph = loaded.graph.unwrap_or_else(|| panic!("{text}: {:?}", loaded.diagnostics));
    let session = Session::new(tools.registry.clone(), &Settings { threads: 1, ..Settings::default() }).unwrap();
    sample(&session, &graph, &CancelToken::default()).unwrap()
}

#[test]
fn migrated_graphs_pass_check_and_keep_exact_pictures() {
    for (line, nodes, is_exact) in [
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: Set(field: "aspect", value: "1"), exact: true"#,
            r#""a": Fractal(size: 3)"#,
            true,
        ),
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: Set(field: "aspect", value: "1"), exact: true"#,
            r#""a": Blur(input: Fractal(size: "$p"), radius: 0.5)"#,
            true,
        ),
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: Remove(field: "aspect"), exact: true"#,
            r#""a": Fractal(aspect: 1, size: 3)"#,
            true,
        ),
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: Rename(field: "seed", to: "angle")"#,
            r#""a": Fractal(seed: 3)"#,
            false,
        ),
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: RenameKind(to: "Simplex")"#,
            r#""a": Fractal(size: 3)"#,
            false,
        ),
        (
            r#"kind: "Invert", version: 9, look: Look, answer: Formula("1 - {input}"), exact: true"#,
            r#""b": Fractal(size: 4), "a": Invert(input: "b")"#,
            true,
        ),
        (
            r#"kind: "Invert", version: 9, look: Look, answer: Formula("1 - {input}"), exact: true"#,
            r#""b": Fractal(size: 4), "a": Blur(input: Invert(input: "= b * $p / 4"))"#,
            true,
        ),
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: Scale(field: "size", by: 0.5)"#,
            r#""a": Fractal(size: "$p")"#,
            false,
        ),
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: Scale(field: "size", by: 0.5)"#,
            r#""a": Fractal(size: "= $p + 1")"#,
            false,
        ),
        (
            r#"kind: "Fractal", version: 4, look: Look, answer: Scale(field: "size", by: 1), exact: true"#,
            r#""a": Fractal(size: "$p")"#,
            true,
        ),
    ] {
        let tools = changed(line);
        let before = format!(
            "(version: 1, pins: 1, canvas: (size_mm: 16, resolution: 16), params: {{ \"p\": Number(default: 2, range: (1, 4)) }}, \
             nodes: {{ {nodes} }}, outputs: {{ \"o\": \"a\" }})"
        );
        let world = Workspace::new(tools.registry.clone(), Vec::new());
        let found = answered(&world, Path::new("a.ron"), &before, (1, 2));
        assert_eq!(found.differing.is_empty(), is_exact, "{line} {nodes}");
        let after = pinned(&found.text, Some(2)).unwrap();
        assert_ne!(found.text, before, "{line} {nodes}");
        let graph = GraphText { path: "a.ron".into(), text: after.clone() };
        let checked = check(&tools, &CheckRequest { graph });
        assert!(checked.diagnostics.is_empty(), "{after}: {:?}", checked.diagnostics);
        if is_exact {
            assert_eq!(pictures(&tools, &before), pictures(&tools, &after), "{after}");
        } else {
            // The comparison tells different pictures apart.
            assert_ne!(pictures(&tools, &before), pictures(&tools, &after), "{after}");
        }
    }
}

/// A renamed output of a shipped graph: the text before cannot be linked any more.
#[test]
fn migrated_graphs_read_renamed_outputs() {
    let line = r#"graph: "goat", version: 2, look: Names, answer: Outputs({ "seen": "lit" }), exact: true"#;
    let tools = changed(line);
    let before = "(version: 1, pins: 1, imports: { \"g\": \"shibo:goat\", \"h\": \"shibo:goat.ron\" }, \
                  nodes: { \"u\": Use(graph: \"g\"), \"v\": Use(graph: \"h\"), \"a\": \"= 0.5 * u.seen + 0.5 * v.seen\" }, \
                  outputs: { \"o\": \"a\", \"p\": \"u.seen\" })";
    let checked = |text: &str| {
        check(&tools, &CheckRequest { graph: GraphText { path: "a.ron".into(), text: text.to_owned() } }).diagnostics
    };
    assert!(checked(before).iter().any(|one| !one.warning), "there is no output `seen`");
    let world = Workspace::new(tools.registry.clone(), Vec::new());
    let found = answered(&world, Path::new("a.ron"), before, (1, 2));
    assert_eq!(found.text, before.replace(".seen", ".lit"));
    assert!(found.differing.is_empty());
    let left = checked(&pinned(&found.text, Some(2)).unwrap());
    assert!(left.iter().all(|one| one.warning), "{left:?}");
}
