//! Results of expressions in graphs, and of nodes without a name.
use crate::graph_nodes;

use shibo_engine::eval::Keys;
use shibo_graph::{Graph, GraphNode, LoadOptions, Loaded, load_text};
use shibo_value::Type;
use std::path::Path;

fn load(text: &str, set: &[(&str, &str)]) -> Loaded {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    load_text(Path::new("dir/a.ron"), text, &graph_nodes::registry(), &LoadOptions { set, ..LoadOptions::default() })
}

fn graph(text: &str, set: &[(&str, &str)]) -> Graph {
    let loaded = load(text, set);
    let messages: Vec<_> = loaded.diagnostics.iter().map(|d| d.message.clone()).collect();
    loaded.graph.unwrap_or_else(|| panic!("{messages:?}"))
}

fn node<'g>(graph: &'g Graph, name: &str) -> &'g GraphNode {
    let names: Vec<_> = graph.nodes.node_weights().map(|node| node.name.clone()).collect();
    graph.nodes.node_weights().find(|node| node.name == name).unwrap_or_else(|| panic!("{name} is not in {names:?}"))
}

/// The canonical form of the only node of a graph with these parameters.
fn canonical(params: &str, node: &str, set: &[(&str, &str)]) -> Vec<u8> {
    let text = format!("(canvas: (size_mm: (40, 20), seed: 3), params: {{ {params} }}, nodes: {{ \"it\": {node} }})");
    self::node(&graph(&text, set), "it").node.canonical()
}

#[test]
fn expressions_give_what_parameters_take() {
    let params = r##""n": Number(default: 2), "style": Choice(default: "Fine", options: ["Fine", "Coarse"]), "worn": Bool(default: true),
        "tint": Color(default: (0.5, 0.25, 1))"##;
    for (written, meant) in [
        (r#"Bands(pitch: "= canvas.width / canvas.height + canvas.seed")"#, "Bands(pitch: 5)"),
        (r#"Bands(on: "= $n > 1")"#, "Bands(on: true)"),
        (r#"Bands(on: "= !$worn")"#, "Bands(on: false)"),
        (r#"Bands(pitch: "= if($style == Fine && $worn, 3, 4)")"#, "Bands(pitch: 3)"),
        (r#"Bands(profile: "= if($style == Coarse, Smooth, Linear)")"#, "Bands(profile: Linear)"),
        (r#"Bands(tint: "= $tint * $n")"#, "Bands(tint: (1, 0.5, 2))"),
        (r#"Bands(offset: "= ($n, $tint.g)")"#, "Bands(offset: (2, 0.25))"),
        (r#"Bands(count: "= -7 % 4")"#, "Bands(count: 1)"),
    ] {
        assert_eq!(canonical(params, written, &[]), canonical(params, meant, &[]), "{written}");
    }
}

#[test]
fn defaults_follow_other_parameters() {
    let params = r#""c": Number(default: "= $b + $a"), "b": Number(default: "= $a * 2"), "a": Number(default: 3),
        "w": Number(default: "= canvas.width / 4")"#;
    let pitch = |set: &[(&str, &str)]| canonical(params, r#"Bands(pitch: "$c", k: "$b", seed: "$w")"#, set);
    let meant = |text: &str| canonical(params, text, &[]);
    assert_eq!(pitch(&[]), meant("Bands(pitch: 9, k: 6, seed: 10)"));
    assert_eq!(pitch(&[("a", "1")]), meant("Bands(pitch: 3, k: 2, seed: 10)"));
    assert_eq!(pitch(&[("b", "1")]), meant("Bands(pitch: 4, k: 1, seed: 10)"));
    assert_eq!(pitch(&[("c", "1"), ("w", "7")]), meant("Bands(pitch: 1, k: 6, seed: 7)"));
}

#[test]
fn evaluates_the_canvas_and_its_parameters_first() {
    let text = r#"(canvas: (size_mm: "= $side * 2"), nodes: { "it": Bands(pitch: "$part") },
        params: { "side": Number(default: "= $base + 1"), "base": Number(default: 4), "part": Number(default: "= canvas.width / 5") })"#;
    let graph = graph(text, &[("base", "9")]);
    assert_eq!(graph.canvas.size_mm.x, 20.0);
    assert_eq!(node(&graph, "it").node.canonical(), canonical("", "Bands(pitch: 4)", &[]));
    let params: Vec<_> = graph.params.iter().map(|p| (p.name.as_str(), p.value.as_str(), p.default.as_str())).collect();
    assert_eq!(params, [("side", "10", "5"), ("base", "9", "4"), ("part", "4", "4")]);
}

#[test]
fn random_numbers_come_from_the_seed() {
    let of = |seed: u32| {
        let text = format!(r#"(canvas: (seed: {seed}), nodes: {{ "it": Bands(pitch: "= 0.1 + random(1)") }})"#);
        node(&graph(&text, &[]), "it").node.canonical()
    };
    assert_eq!(of(1), of(1));
    assert_ne!(of(1), of(2));
}

#[test]
fn nodes_compute_the_types_of_their_outputs() {
    let text = r##"(nodes: { "a": Compute(a: (1, 2), formula: ""), "b": Compute(a: "a", formula: ""), "c": Warp(input: 1, vector: "b"),
        "d": Compute(a: "#fff", formula: "a.r"), "e": Mix(a: "d") })"##;
    let graph = graph(text, &[]);
    let types = ["a", "b", "c", "d", "e"].map(|name| node(&graph, name).outputs[0]);
    assert_eq!(types, [Type::Vec2, Type::Vec2, Type::Gray, Type::Rgb, Type::Rgb]);
}

const NAMED: &str = r#"(params: { "p": Number(default: 2) }, nodes: {
    "x": Bands(pitch: "$p", label: "$$p"), "y": Mix(a: "x", b: 0.5), "z": Compute(a: "x", formula: "a"),
    "it": Sum(inputs: ["y", 0.25, "z"]),
}, outputs: { "it": "it" })"#;

const UNNAMED: &str = r#"(params: { "p": Number(default: 2) }, nodes: {
    "it": Sum(inputs: [
        Mix(a: Bands(pitch: "$p", label: "$$p"), b: 0.5),
        0.25,
        Compute(formula: "a", a: Bands(pitch: "$p", label: "$$p")),
    ]),
}, outputs: { "it": "it" })"#;

#[test]
fn a_node_without_a_name_is_the_same_as_one_with_a_name() {
    let (named, unnamed) = (graph(NAMED, &[]), graph(UNNAMED, &[]));
    let names: Vec<_> = unnamed.nodes.node_weights().map(|node| node.name.as_str()).collect();
    assert_eq!(names, ["it", "it.inputs.1", "it.inputs.3", "it.inputs.1.a", "it.inputs.3.a"]);
    let (a, b) = (Keys::of(&named).unwrap(), Keys::of(&unnamed).unwrap());
    let key = |graph: &Graph, keys: &Keys, name: &str| {
        let index = graph.nodes.node_indices().find(|index| graph.nodes[*index].name == name).unwrap();
        keys.output(index, 0)
    };
    for (one, other) in
        [("it", "it"), ("y", "it.inputs.1"), ("x", "it.inputs.1.a"), ("x", "it.inputs.3.a"), ("z", "it.inputs.3")]
    {
        assert_eq!(key(&named, &a, one), key(&unnamed, &b, other), "{one} {other}");
    }
}

#[test]
fn nodes_without_a_name_are_given_to_sub_graphs() {
    let dir = tempfile::tempdir().unwrap();
    let inner = r#"(inputs: { "f": Gray(default: Bands(pitch: 3)), "l": Lattice(default: GridPoints(pitch: 1)) },
        nodes: { "sum": Sum(inputs: ["f"]) }, outputs: { "sum": "sum" })"#;
    std::fs::write(
        dir.path().join("inner.ron"),
        inner.replace("Lattice(default: GridPoints(pitch: 1))", "Points(default: GridPoints(pitch: 1))"),
    )
    .unwrap();
    let text = r#"(imports: { "i": "inner.ron" }, nodes: {
        "plain": Use(graph: "i"),
        "given": Use(graph: "i", with: { "f": Mix(a: Bands()), "l": GridPoints(pitch: 4) }),
        "twice": Mix(a: Use(graph: "i", with: { "f": Use(graph: "i") })),
    }, outputs: { "a": "given", "b": "twice", "c": "plain" })"#;
    let loaded = load_text(&dir.path().join("a.ron"), text, &graph_nodes::registry(), &LoadOptions::default());
    let messages: Vec<_> = loaded.diagnostics.iter().map(|d| d.message.clone()).collect();
    let graph = loaded.graph.unwrap_or_else(|| panic!("{messages:?}"));
    for (name, kind) in [
        ("plain/f.default", "Bands"),
        ("given.f", "Mix"),
        ("given.f.a", "Bands"),
        ("given.l", "GridPoints"),
        ("given/f", "Input"),
        ("twice.a/sum", "Sum"),
        ("twice.a.f/sum", "Sum"),
        ("twice.a.f/f.default", "Bands"),
    ] {
        assert_eq!(node(&graph, name).kind, kind);
    }
}

#[test]
fn many_nodes_without_names_are_counted() {
    let text = format!("(nodes: {{ \"a\": Sum(inputs: [{}]) }})", "Bands(), ".repeat(100_001));
    let loaded = load(&text, &[]);
    assert!(loaded.graph.is_none());
    assert!(loaded.diagnostics[0].message.contains("more than 100000 nodes"), "{}", loaded.diagnostics[0].message);
}

#[test]
fn structs_in_lists_have_ports() {
    let text = |count: u32| {
        format!(
            r#"(params: {{ "p": Number(default: 0.25) }}, nodes: {{
            "s": Surface(roughness: 1), "m": Bands(),
            "it": Stack(top: "s", base: "s", layers: [
                (material: "s"),
                (count: {count}, mask: "m", material: Surface(height: Bands(pitch: 2)), opacity: "$p"),
            ]),
        }}, outputs: {{ "it": "it" }})"#
        )
    };
    let graph = graph(&text(2), &[]);
    let it = node(&graph, "it");
    let slots = ["base", "layers.1.material", "layers.2.material", "layers.2.mask", "layers.2.opacity", "top"];
    assert_eq!(it.slots, slots);
    assert_eq!(node(&graph, "it.layers.2.material.height").kind, "Bands");
    assert_eq!(graph.nodes[graph.outputs[0].node].channels.iter().count(), 2, "of all materials");
    // The slots that the struct received.
    let told = load(&text(77), &[]).diagnostics;
    let expected = r#"Some(0) ["Some(1) None None 1", "Some(2) Some(3) Some(4) 77"] Some(5)"#;
    assert_eq!(told.iter().map(|d| d.message.as_str()).collect::<Vec<_>>(), [expected]);
}
