//! Graphs that are pinned at a change.
use crate::graph_nodes;
use shibo_graph::{LoadOptions, Loaded, load_text};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const OTHER: &str = r#"(nodes: { "r": Rays(width: 2) }, outputs: { "o": "r" })"#;

fn load(pins: &str, nodes: &str, newest: bool) -> Loaded {
    let text = format!(r#"({pins} imports: {{ "other": "other.ron" }}, nodes: {{ {nodes} }})"#);
    let overlay = [(PathBuf::from("other.ron"), Arc::from(OTHER))].into();
    let options = LoadOptions { newest, overlay, ..LoadOptions::default() };
    load_text(Path::new("a.ron"), &text, &graph_nodes::registry(), &options)
}

/// The versions of the nodes, or the first error.
fn versions(pins: &str, nodes: &str) -> Result<Vec<u32>, String> {
    let loaded = load(pins, nodes, false);
    let error = |d: &shibo_value::diagnostics::Diagnostic| {
        format!("{} {}: {}", d.code.as_str(), d.message, d.help.as_deref().unwrap_or_default())
    };
    match loaded.graph {
        Some(graph) => Ok(graph.nodes.node_weights().map(|node| node.node.version()).collect()),
        None => Err(loaded.diagnostics.iter().map(error).next().unwrap_or_default()),
    }
}

#[test]
fn nodes_have_the_version_of_their_pin() {
    let (plain, wide) = (r#""r": Rays()"#, r#""r": Rays(width: 3)"#);
    assert_eq!(versions("", wide), Ok(vec![5]));
    for pins in ["pins: 4,", "pins: 3,", "pins: (change: 2, hold: { \"Rays\": 5 }),"] {
        assert_eq!(versions(pins, wide), Ok(vec![5]), "{pins}");
    }
    assert_eq!(versions("pins: 2,", wide), Ok(vec![3]), "a kept version");
    assert_eq!(versions("pins: 2,", plain), Ok(vec![5]), "the change does not alter it");
    assert_eq!(versions("pins: (change: 4, hold: { \"Rays\": 3 }),", wide), Ok(vec![3]));
    let gone = versions("pins: 1,", wide).unwrap_err();
    assert_eq!(
        gone,
        "changed-kind `Rays` of version 2 is not in this program any more: `shibo migrate FILE` takes version 5: other rays \
         (up to 31 % of full scale)"
    );
    assert!(load("pins: 1,", wide, true).graph.is_some(), "--newest");
}

#[test]
fn a_file_without_pins_has_those_of_its_user() {
    let uses = r#""o": Use(graph: "other")"#;
    assert_eq!(versions("pins: 2,", uses), Ok(vec![3]));
    assert_eq!(versions("pins: 3,", uses), Ok(vec![5]));
    let local = r#"graphs: { "part": (nodes: { "r": Rays(width: 1) }, outputs: { "o": "r" }) }, pins: 2,"#;
    assert_eq!(versions(local, r#""o": Use(graph: "part")"#), Ok(vec![3]));
}

#[test]
fn wrong_pins_are_reported() {
    for (pins, says) in [
        ("pins: 57,", "unknown-version the graph was made with a newer Shibo: change 57, this one knows 4"),
        ("pins: 0,", "unknown-version changes are numbered from 1"),
        ("pins: -3,", "a whole number"),
        ("pins: 1.5,", "a whole number"),
        ("pins: 99999999999,", "a whole number"),
        ("pins: \"41\",", "`pins`"),
        ("pins: (hold: {}),", "missing-input `pins` needs `change`"),
        ("pins: (change: 4, hold: { \"Rais\": 3 }),", "did you mean `Rays`?"),
        ("pins: (change: 4, hold: { \"Rays\": 6 }),", "unknown-version `Rays` has the versions 2 to 5; found 6"),
        ("pins: (change: 4, hold: { \"Rays\": 1 }),", "unknown-version `Rays` has the versions 2 to 5; found 1"),
        ("pins: (change: 4, hold: { \"Mix\": 0 }),", "unknown-version `Mix` has the version 1; found 0"),
        ("pins: (change: 4, holds: {}),", "holds"),
    ] {
        let error = versions(pins, r#""r": Rays()"#).unwrap_err();
        assert!(error.contains(says), "{pins}: {error}");
    }
}

#[test]
fn a_family_is_words_in_lower_case() {
    let load = |family: &str| load(&format!("family: {family},"), r#""r": Rays()"#, false);
    assert_eq!(load("\"knit and rope\"").graph.unwrap().family.as_deref(), Some("knit and rope"));
    let long = format!("\"{}\"", "a".repeat(41));
    for family in ["\"Stone\"", "\"\"", "\"a  b\"", "\" a\"", "\"stone\\u{7}\"", "\"石\"", "stone", "[\"a\"]", &long] {
        assert!(load(family).graph.is_none(), "{family}");
    }
}
