//! Tests of the JSON form.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use super::{TextFault, to_json, to_ron};
use crate::testing::{graphs, tools};
use crate::{DiffRequest, GraphText, Tools, diff};
use shibo_graph::syntax::{Tree, format};
use std::path::Path;

fn graph(text: &str) -> GraphText {
    GraphText { path: "a.ron".into(), text: text.to_owned() }
}

fn there(tools: &Tools, text: &str) -> String {
    to_json(tools, &graph(text)).unwrap()
}

fn back(tools: &Tools, json: &str) -> Result<String, Vec<TextFault>> {
    to_ron(tools, &graph(json))
}

fn comments(text: &str) -> Vec<String> {
    let tree = Tree::parse(text);
    tree.comments().map(|range| text[range].to_owned()).collect()
}

/// Converts a graph there and back and compares.
fn keeps(tools: &Tools, path: &Path, text: &str) {
    let json = to_json(tools, &GraphText { path: path.to_owned(), text: text.to_owned() }).unwrap();
    serde_json::from_str::<serde_json::Value>(&json).unwrap();
    let again = to_ron(tools, &GraphText { path: path.to_owned(), text: json.clone() }).unwrap();
    let version = |text: &str| Some(GraphText { path: path.to_owned(), text: text.to_owned() });
    let request = DiffRequest { before: version(text), after: version(&again), comments: false };
    assert_eq!(diff(tools, &request).changes, [], "{}\n{again}", path.display());
    assert_eq!(comments(text), comments(&again), "{}", path.display());
    assert_eq!(to_json(tools, &GraphText { path: path.to_owned(), text: again }).unwrap(), json);
}

#[test]
fn shipped_graphs_keep_meaning_and_comments() {
    let tools = tools();
    for (path, text) in graphs() {
        keeps(&tools, &path, &text);
    }
    for graph in shibo_library::graphs() {
        keeps(&tools, Path::new("a.ron"), graph.text);
    }
}

const GRAPH: &str = r##"// A graph.
// With two lines.
(
  version: 1,
  pins: (change: 1, hold: { "Perlin": 1 }),
  canvas: (size_mm: (10, 20), tile: None, seed: 18446744073709551615), // the canvas
  params: { "word": Choice(default: "A", options: ["A", "B"]), "at": Number(default: 0.5, range: (0, 1)) },

  // Above the nodes.
  nodes: {
    "noise": Perlin(size: "$at"),
    "curve": Curve(
      input: Perlin,
      points: [
        (0, 0), // first
        // The middle.
        (0.5, 0.25),
        (1, 1),
        // Last.
      ],
    ),
    "blend": Blend(base: "noise", top: [0, 1, 2], mode: Multiply /* not Screen */),
    "springs": SimulateSprings(lattice: "x", boundary: Fixed(0.5), break_force: (1, inf), sample: Near(3)),
    "layers": LayerMaterials(layers: [(material: "a", by: Height)]),
    "sub": Use(graph: "g", with: { "Size": (1, 2), "mode": Multiply, "text": "a \"b\"\\" }),
    "sum": "= noise
      + 1",
    // End of nodes.
  },
  outputs: { "a": File(from: "sum", format: Exr, range: (0, 1)), "b": Gltf(material: "m", mesh: Sphere) },
)
// Below.
"##;

#[test]
fn converts_every_form() {
    let tools = tools();
    let json = there(&tools, GRAPH);
    for part in [
        r#""// file": ["A graph.", "With two lines."]"#,
        r#""size_mm": [10, 20]"#,
        r#""tile": null"#,
        "18446744073709551615",
        r#""canvas //": "the canvas""#,
        r#""// nodes": ["", "Above the nodes."]"#,
        r#""noise": { "Perlin": { "size": "$at" } }"#,
        r#""input": { "Perlin": null }"#,
        r#"{ "item //": "first" }"#,
        r#"{ "//": "The middle." }"#,
        r#""mode": "Multiply""#,
        r#""boundary": { "Fixed": 0.5 }"#,
        r#""break_force": [1, "inf"]"#,
        r#""by": "Height""#,
        r#""mode": { "Multiply": null }"#,
        r#""format": "Exr""#,
        r#""mesh": "Sphere""#,
        r#""file //": "Below.""#,
    ] {
        assert!(json.contains(part), "{part}\n{json}");
    }
    let again = back(&tools, &json).unwrap();
    for part in [
        "input: Perlin,",
        "break_force: (1, inf)",
        "by: Height",
        "\"mode\": Multiply",
        "mesh: Sphere",
        "hold: { \"Perlin\": 1 }",
    ] {
        assert!(again.contains(part), "{part}\n{again}");
    }
    assert_eq!(comments(&again), comments(GRAPH));
    // From then on even the layout stays.
    let json = there(&tools, &again);
    assert_eq!(back(&tools, &json).unwrap(), again);
}

#[test]
fn text_of_other_programs_is_read() {
    let tools = tools();
    let json = r#"{"nodes": {"a": {"Perlin": {"size": 1e1, "// size": "in mm\nsecond", "seed": 3}},
        "b": {"// above": "x */ y", "Levels": {"input": {"Perlin": {}}, "note": "\u00e9\/\t"}}}, "//": "end"}"#;
    let ron = back(&tools, json).unwrap();
    assert_eq!(format(&ron).unwrap(), ron);
    for part in ["// in mm\n", "// second\n", "size: 1e1", "// x */ y", "note: \"é/\\u{9}\"", "// end"] {
        assert!(ron.contains(part), "{part}\n{ron}");
    }
}

#[test]
fn mistakes_have_places() {
    let tools = tools();
    let fault = |json: &str| {
        let fault = back(&tools, json).unwrap_err().remove(0);
        (json[fault.range.clone()].to_owned(), fault.range.start, fault.message)
    };
    assert_eq!(fault("{\n  \"nodes\" 3}").1, 12);
    assert!(fault("{\"nodes\": {}").2.contains("EOF"));
    assert_eq!(fault("[1]").0, "[1]");
    assert_eq!(fault("{\"my field\": 1}").0, "\"my field\"");
    assert_eq!(fault("{\"nodes\": {\"a\": 1, \"a\": 2}}"), ("\"a\"".to_owned(), 19, "`a` is given twice".to_owned()));
    assert_eq!(fault(&"[".repeat(5000)).2, "not JSON: recursion limit exceeded");
    let wrong = to_json(&tools, &graph("(nodes: { \"a\": Perlin(size: 'x'), \"b\": )")).unwrap_err();
    assert!(!wrong.is_empty());
    assert_eq!(to_json(&tools, &graph("(nodes: { \"a\": Perlin(size: 'x') })")).unwrap_err()[0].range, 28..31);
    assert!(to_json(&tools, &graph("")).is_err());
}
