//! The canvas of a graph: its resolution, and whether the outputs repeat with it.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::graph_nodes;

use glam::UVec2;
use shibo_graph::{LoadOptions, Loaded, load, load_text};
use shibo_value::Resolution;
use shibo_value::diagnostics::{Code, Origin};
use std::path::Path;

fn on(canvas: &str, resolution: Option<Resolution>) -> Loaded {
    let text = format!("(canvas: ({canvas}), nodes: {{\"n\": Bands()}}, outputs: {{\"o\": \"n\"}})");
    let options = LoadOptions { resolution, ..LoadOptions::default() };
    load_text(Path::new("a.ron"), &text, &graph_nodes::registry(), &options)
}

fn pixels(loaded: &Loaded) -> [u32; 2] {
    loaded.graph.as_ref().unwrap().canvas.resolution.to_array()
}

#[test]
fn one_number_is_the_longer_side() {
    for (canvas, expected) in [
        ("size_mm: (60, 30), resolution: 64", [64, 32]),
        ("resolution: 64, size_mm: (30, 60)", [32, 64]),
        ("size_mm: (60, 30)", [1024, 512]),
        ("size_mm: 60, resolution: 64", [64, 64]),
        ("size_mm: (60, 60)", [1024, 1024]),
        ("size_mm: (1000, 1), resolution: 64", [64, 1]),
        ("size_mm: (60, 30), resolution: (64, 32)", [64, 32]),
        ("size_mm: (90, 30), resolution: (100, 33)", [100, 33]),
        ("size_mm: (90, 30), resolution: (100, 34)", [100, 34]),
    ] {
        let loaded = on(canvas, None);
        assert_eq!((pixels(&loaded), loaded.diagnostics.len()), (expected, 0), "{canvas}");
        let loaded = on(canvas, Some(Resolution::Longer(expected[0].max(expected[1]))));
        assert_eq!(loaded.diagnostics, [], "{canvas}");
    }
}

#[test]
fn a_pair_is_taken_literally_with_a_warning() {
    let loaded = on("size_mm: (60, 30), resolution: (64, 64)", None);
    assert_eq!(pixels(&loaded), [64, 64]);
    let [warning] = &loaded.diagnostics[..] else { panic!("{:?}", loaded.diagnostics) };
    assert!(warning.warning && warning.code == Code::Advice, "{warning:?}");
    assert_eq!(loaded.sources.position(warning.span.file, warning.span.start).column, 42);
    assert_eq!(warning.help.as_deref(), Some("write `64` for the longer side alone, or `(64, 32)`"));

    // A resolution of the caller overrides that of the canvas.
    let typed = on("size_mm: (60, 30), resolution: (64, 64)", Some(Resolution::Exact(UVec2::new(32, 64))));
    assert_eq!(pixels(&typed), [32, 64]);
    let [warning] = &typed.diagnostics[..] else { panic!("{:?}", typed.diagnostics) };
    assert_eq!(typed.sources.origin(warning.span.file), &Origin::Resolution);
    assert_eq!(warning.help.as_deref(), Some("write `64` for the longer side alone, or `64x32`"));
    let typed = on("size_mm: (60, 30), resolution: (64, 64)", Some(Resolution::Longer(32)));
    assert_eq!((pixels(&typed), typed.diagnostics.len()), ([32, 16], 0));
}

#[test]
fn ignores_the_canvas_of_imported_graphs() {
    let folder = tempfile::tempdir().unwrap();
    let inner = "(canvas: (size_mm: (60, 30), resolution: 64), nodes: {\"n\": Bands()}, outputs: {\"o\": \"n\"})";
    std::fs::write(folder.path().join("i.ron"), inner.replace("64", "(64, 64)")).unwrap();
    let outer = "(imports: {\"i\": \"i.ron\"}, nodes: {\"u\": Use(graph: \"i\")}, outputs: {\"o\": \"u\"})";
    std::fs::write(folder.path().join("o.ron"), outer).unwrap();
    let loaded = load(&folder.path().join("o.ron"), &graph_nodes::registry(), &LoadOptions::default());
    assert_eq!((pixels(&loaded), loaded.diagnostics.len()), ([1024, 1024], 0));
}

/// The advice about a graph of these nodes and outputs: messages and columns.
fn advice(tile: &str, nodes: &str, outputs: &[&str]) -> Vec<(String, usize)> {
    let outputs: String = outputs.iter().enumerate().map(|(i, o)| format!("\"o{i}\": \"{o}\",")).collect();
    let text = format!("(canvas: (tile: {tile}), outputs: {{{outputs}}}, nodes: {{\n{nodes}\n}})");
    let loaded = load_text(Path::new("a.ron"), &text, &graph_nodes::registry(), &LoadOptions::default());
    let graph = loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    let advice = graph.advice();
    assert!(advice.iter().all(|d| d.warning && d.code == Code::Advice && d.related.is_empty()));
    let place = |d: &shibo_value::diagnostics::Diagnostic| graph.sources.position(d.span.file, d.span.start).column;
    advice.into_iter().map(|d| (d.message.clone(), place(&d))).collect()
}

#[test]
fn reports_a_node_that_breaks_the_tiling_once() {
    let nodes = "\"ramp\": Ramp(), \"good\": Bands(), \"a\": Mix(a: \"ramp\"), \"b\": Mix(a: \"a\", b: \"good\")";
    assert_eq!(
        advice("Both", nodes, &["a", "b", "good", "ramp", "b", "a"]),
        [(
            "the outputs `o0`, `o1`, `o3` and others do not tile: node `ramp` does not repeat with the canvas".into(),
            9
        )]
    );
    assert_eq!(
        advice("Both", nodes, &["b"]),
        [("the output `o0` does not tile: node `ramp` does not repeat with the canvas".into(), 9)]
    );
    assert_eq!(advice("None", nodes, &["a", "b"]), []);
    assert_eq!(advice("Both", nodes, &["good"]), []);
}

#[test]
fn reports_every_node_at_fault() {
    let nodes = "\"x\": Ramp(), \"y\": Ramp(), \"both\": Mix(a: \"x\", b: \"y\"), \"after\": Ramp(input: \"x\")";
    let found = advice("X", nodes, &["both", "y", "after"]);
    let expected = |outputs: &str, node: &str| {
        format!("the outputs {outputs} do not tile: node `{node}` does not repeat with the canvas")
    };
    assert_eq!(found, [(expected("`o0`, `o2`", "x"), 6), (expected("`o0`, `o1`", "y"), 19)]);
}

#[test]
fn a_node_can_make_its_input_tile() {
    let nodes = "\"x\": Ramp(), \"s\": Seamless(input: \"x\"), \"after\": Mix(a: \"s\")";
    assert_eq!(advice("Both", nodes, &["s", "after"]), []);
    let ramp =
        |outputs: &str, does: &str| format!("the {outputs} {does} not tile: node `x` does not repeat with the canvas");
    assert_eq!(advice("Both", nodes, &["after", "x"]), [(ramp("output `o1`", "does"), 6)]);
    // The direction that the node does not make repeat is reported at this node.
    let nodes = "\"s\": Seamless(input: \"x\", x_only: true), \"x\": Ramp()";
    let found = advice("Both", nodes, &["s"]);
    assert_eq!(found, [("the output `o0` does not tile: node `s` does not repeat with the canvas".to_owned(), 6)]);
}

#[test]
fn the_seed_may_be_given_like_a_parameter() {
    let load = |text: &str, set: &[(&str, &str)]| {
        let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        let options = LoadOptions { set, ..LoadOptions::default() };
        load_text(Path::new("a.ron"), text, &graph_nodes::registry(), &options)
    };
    let seed = |loaded: &Loaded| loaded.graph.as_ref().unwrap().canvas.seed;
    let plain = r#"(canvas: (seed: 3), nodes: {"n": Bands()}, outputs: {"o": "n"})"#;
    assert_eq!(seed(&load(plain, &[])), 3);
    assert_eq!(seed(&load(plain, &[("seed", "7")])), 7);
    assert_eq!(seed(&load(plain, &[("seed", "7"), ("seed", "18446744073709551615")])), u64::MAX);

    // A parameter of the same name takes precedence.
    let own = r#"(params: {"seed": Integer(default: 5)}, nodes: {"n": Bands()}, outputs: {"o": "n"})"#;
    let loaded = load(own, &[("seed", "7")]);
    assert_eq!((seed(&loaded), loaded.graph.unwrap().params[0].value.as_str()), (0, "7"));

    for wrong in ["-1", "1.5", "green", "", "18446744073709551616"] {
        let loaded = load(plain, &[("seed", wrong)]);
        let [error] = &loaded.diagnostics[..] else { panic!("{wrong}: {:?}", loaded.diagnostics) };
        assert!(!error.warning && loaded.graph.is_none(), "{error:?}");
        assert_eq!(loaded.sources.origin(error.span.file), &Origin::Param { name: "seed".to_owned() });
    }
}
