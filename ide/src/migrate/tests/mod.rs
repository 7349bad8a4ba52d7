//! Tests of the rewriting of whole files.
mod files;
mod formulas;
mod hostile;
mod joining;
mod operations;
mod trees;
mod values;

use super::{Migration, migrate};
use shibo_node::registry::Registry;
use std::sync::OnceLock;

/// The kinds, read once.
fn kinds() -> &'static Registry {
    static KINDS: OnceLock<Registry> = OnceLock::new();
    KINDS.get_or_init(shibo_library::registry)
}

fn migrated(text: &str) -> Migration {
    migrate(text, kinds()).expect("valid RON")
}

/// Some nodes to read: numbers `n` and `k`, a colour `c`, a vector `w`, a solid `s`, a solid colour `sc`, pieces `p` and
/// a material `m`.
const READ: &str = r##"    "n": Perlin(size: 3),
    "k": Fractal(size: 5),
    "c": GradientMap(input: "n"),
    "w": VectorField(input: "n"),
    "s": SolidNoise(size: 3),
    "t": SolidNoise(size: 4),
    "sc": Board(),
    "p": Brick(),
    "m": Material(base_color: "c", height: "n", roughness: 0.4),
"##;

/// A graph with more nodes.
fn graph(nodes: &str, outputs: &str) -> String {
    format!(
        "(\n  params: {{\n    \"wide\": Number(default: 1, range: (0.5, 4)),\n  }},\n  nodes: {{\n{READ}{nodes}  }},\n  outputs: {{ {outputs} }},\n)\n"
    )
}

/// The new lines of the nodes, and the outputs.
fn lines(nodes: &str, outputs: &str) -> (String, String) {
    let text = migrated(&graph(nodes, outputs)).text;
    let text = text.split_once(READ).map_or_else(|| text.clone(), |(_, after)| after.to_owned());
    let (nodes, outputs) = text.split_once("  },\n  outputs: {").expect("outputs");
    let outputs = outputs.trim_end_matches([' ', '\n', ')', ',', '}']).trim();
    (nodes.to_owned(), outputs.to_owned())
}

/// The new text of an output that reads a node.
fn output(node: &str) -> String {
    lines(&format!("    \"r\": {node},\n"), "\"o\": \"r\"").1
}
