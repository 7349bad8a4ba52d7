//! Sources and readers of entries.
use super::registry;
use crate::calls::{Call, entry_at, readers, sources};
use crate::{Cx, Workspace};
use std::path::Path;
use std::sync::Arc;

const WORN: &str = r##"(
  functions: { "ridge(x)": "1 - abs(x)" },
  params: { "size": Number(default: 4), "half": Number(default: "= $size / 2") },
  presets: { "fine": { "size": 2 } },
  inputs: { "mask": Gray(default: 1) },
  nodes: {
    "noise": Perlin(size: "$half"),
    "worn": "= ridge(noise) * mask",
  },
  outputs: { "height": "worn", "mask": "mask" },
)
"##;

const WHOLE: &str = r##"(
  imports: { "worn": "worn.ron" },
  graphs: {
    "dots": (nodes: { "points": PoissonPoints(pitch: 2), "it": Dots(points: "points") }, outputs: { "dots": "it" }),
  },
  nodes: {
    "spots": Use(graph: "dots"),
    "used": Use(graph: "worn", with: { "size": 3, "mask": "spots" }),
    "soft": Blur(input: "used.height", radius: 1),
    "sum": "= worn.ridge(soft) + spots.dots",
  },
  outputs: { "sum": "sum" },
)
"##;

/// The names of entries, with the texts that name them.
fn told(calls: &[Call], text: impl Fn(&Call) -> Arc<str>) -> String {
    let one = |call: &Call| {
        let text = text(call);
        let places: Vec<&str> = call.ranges.iter().map(|range| &text[range.clone()]).collect();
        format!("{} {}: {}", call.entry.section.key(), call.entry.name, places.join(" "))
    };
    calls.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The sources and the readers of the entry at the `|` of one of the two texts.
fn at(path: &str, found: &str) -> [String; 2] {
    let mut workspace = Workspace::new(Arc::new(registry()), Vec::new());
    workspace.open(Path::new("/nowhere/worn.ron"), WORN);
    workspace.open(Path::new("/nowhere/whole.ron"), WHOLE);
    let text = if path == "worn.ron" { WORN } else { WHOLE };
    let at = text.find(&found.replace('|', "")).expect("the text") + found.find('|').expect("a cursor");
    let file = workspace.open(&Path::new("/nowhere").join(path), text);
    let cx = Cx { world: &workspace, file: &file };
    let entry = entry_at(cx, &file, at).expect("an entry");
    [
        told(&sources(cx, &entry), |_| entry.file.text.clone()),
        told(&readers(cx, &entry), |call| call.entry.file.text.clone()),
    ]
}

#[test]
fn follows_wires_and_formulas() {
    assert_eq!(at("worn.ron", "\"no|ise\": Perlin"), ["params half: half", "nodes worn: noise"]);
    // On a kind, the entry around it counts; a name counts wherever it is used.
    assert_eq!(at("worn.ron", "Per|lin"), at("worn.ron", "ridge(noi|se)"));
    assert_eq!(
        at("worn.ron", "\"wo|rn\": \"="),
        ["functions ridge: ridge, nodes noise: noise, inputs mask: mask", "outputs height: worn"]
    );
    assert_eq!(at("worn.ron", "\"rid|ge(x)"), ["", "nodes worn: ridge, nodes sum: ridge"]);
    assert_eq!(at("worn.ron", "\"ha|lf\""), ["params size: size", "nodes noise: half"]);
}

#[test]
fn follows_graphs_that_use_each_other() {
    // A `Use` reads the outputs of its graph, and is read at its outputs.
    assert_eq!(
        at("whole.ron", "\"us|ed\": Use"),
        ["nodes spots: spots, outputs height: worn, outputs mask: worn", "nodes soft: used"]
    );
    assert_eq!(at("worn.ron", "\"hei|ght\": "), ["nodes worn: worn", "nodes soft: height, nodes used: worn"]);
    assert_eq!(at("whole.ron", "\"so|ft\""), ["nodes used: used, outputs height: height", "nodes sum: soft"]);
    // An input reads what its users give it, and so does a parameter.
    assert_eq!(at("worn.ron", "\"ma|sk\": Gray"), ["nodes spots: \"mask\"", "nodes worn: mask, outputs mask: mask"]);
    assert_eq!(at("worn.ron", "\"si|ze\": Number"), ["nodes used: \"size\"", "params half: size"]);
    // Local graphs are graphs as others.
    assert_eq!(at("whole.ron", "\"it|\": Dots"), ["nodes points: points", "outputs dots: it"]);
    assert_eq!(at("whole.ron", "\"do|ts\": \"it\""), ["nodes it: it", "nodes sum: dots, nodes spots: dots"]);
}
