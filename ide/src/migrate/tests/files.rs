//! Whole files: what stays, and how the result is laid out.
use super::{graph, kinds, migrated, output};
use crate::migrate::kinds::REMOVED;
use crate::migrate::{migrate, rewrite_of};
use shibo_graph::syntax::{NodeKind, Tree, format};
use std::fs;
use std::path::PathBuf;

fn shipped() -> Vec<(PathBuf, String)> {
    let graphs = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../graphs"));
    let folders = [graphs.join("lib"), graphs];
    let files = folders.iter().flat_map(|folder| fs::read_dir(folder).expect("a folder"));
    let paths =
        files.map(|file| file.expect("a file").path()).filter(|path| path.extension().is_some_and(|e| e == "ron"));
    paths.map(|path| (path.clone(), fs::read_to_string(path).expect("a text"))).collect()
}

#[test]
fn shipped_graphs_have_no_old_kinds_left() {
    let all = shipped();
    assert!(all.len() > 60);
    for (path, text) in all {
        let migration = migrated(&text);
        let name = path.display();
        let tree = Tree::parse(migration.text.as_str());
        assert!(tree.errors().is_empty(), "{name}: {:?}", tree.errors());
        let old: Vec<_> =
            tree.nodes().filter(|node| node.kind() == NodeKind::Call).filter_map(|node| node.name()).collect();
        let left = old.iter().find(|kind| crate::migrate::kinds::removed(kind, kinds()).is_some());
        assert_eq!(left, None, "{name}");
        assert_eq!(format(&migration.text).as_deref(), Ok(migration.text.as_str()), "{name} is laid out");
        let long = |line: &&str| {
            line.chars().count() > 120 && (line.contains(": \"= ") || line.contains("r#")) && !line.contains("//")
        };
        assert_eq!(migration.text.lines().find(long), None, "{name}");
        assert_eq!(migrated(&migration.text).text, migration.text, "{name}: a second run changes nothing");
        let comments =
            |text: &str| Tree::parse(text).comments().map(|range| text[range].to_owned()).collect::<Vec<_>>();
        assert_eq!(comments(&migration.text), comments(&text), "{name} keeps its comments");
    }
}

#[test]
fn table_has_all_retired_kinds() {
    let mut table = REMOVED.each_ref().map(|removed| removed.kind);
    table.sort_unstable();
    assert_eq!(table, kinds().retired());
    assert!(table.iter().all(|kind| kinds().is_retired(kind)));
}

#[test]
fn file_without_old_kinds_stays() {
    for text in [
        "",
        "(\n  nodes : {\n\n\n\"a\":Perlin( ) }\n)",
        "[1, 2]",
        "(nodes: { \"a\": \"= 1 +\" })",
        "\u{feff}(nodes: {})",
    ] {
        let Ok(migration) = migrate(text, kinds()) else { continue };
        assert_eq!((migration.text.as_str(), migration.changes.len()), (text, 0));
    }
}

#[test]
fn mistakes_of_syntax_are_reported() {
    let errors = migrate("(nodes: { \"a\": Math(a: ) })", kinds()).expect_err("a value is missing");
    assert_eq!(errors.len(), 1);
}

#[test]
fn unchanged_lines_keep_their_layout() {
    let text = "(nodes:{\"n\":Perlin(  size:3 ),\n  \"h\" : Math(a:\"n\",b:2), \"e\":Emboss( input:\"h\" ),\n},outputs:{\"o\":\"e\"})";
    let expected = "(nodes:{\"n\":Perlin(  size:3 ),\n  \"e\":Emboss( input:\"= n + 2\" ),\n},outputs:{\"o\":\"e\"})";
    assert_eq!(migrated(text).text, expected);
    let crlf = graph("    \"h\": Math(a: \"n\", b: 2),\n    \"e\": Emboss(input: \"h\"),\n", "\"o\": \"e\"")
        .replace('\n', "\r\n");
    let found = migrated(&crlf).text;
    assert_eq!(found.matches('\n').count(), found.matches("\r\n").count());
    assert!(found.contains("Emboss(input: \"= n + 2\"),\r\n"));
}

#[test]
fn changes_name_their_places() {
    let text = graph("    \"h\": Math(a: \"n\", b: 2),\n    \"e\": Emboss(input: \"h\"),\n", "\"o\": \"e\"");
    let migration = migrated(&text);
    let found: Vec<_> =
        migration.changes.iter().map(|change| (&text[change.range.clone()], change.message.as_str())).collect();
    assert_eq!(found, [("Math(a: \"n\", b: 2)", "`h` (`Math`) is written where it is read")]);
}

#[test]
fn single_nodes_have_a_replacement() {
    let of = |node: &str| {
        let text = graph(&format!("    \"r\": {node},\n"), "\"o\": \"r\"");
        let tree = Tree::parse(text.as_str());
        let at = text.find(node).expect("the node");
        rewrite_of(tree.covering(at..at + node.len()), kinds())
    };
    let some = |text: &str| Some(text.to_owned());
    assert_eq!(of("Math(operation: Multiply, a: \"n\", b: 2)"), some("\"= 2 * n\""));
    assert_eq!(of("Math(operation: Power, a: Math(a: \"n\", b: 1), b: 2)"), some("\"= max(n + 1, 0) ^ 2\""));
    assert_eq!(of("MixSolids(a: \"s\", b: \"t\", mask: \"s\")"), some("\"= mix(s, t, clamp(s, 0, 1))\""));
    assert_eq!(of("MaterialChannel(material: \"m\", channel: Height)"), some("\"= m.height\""));
    assert_eq!(of("Expression(a: \"n\", formula: \"a ^ 2\")"), some("\"= n ^ 2\""));
    assert_eq!(
        of("SetChannels(material: \"m\", height: Math(a: \"n\", b: 1))"),
        some("Material(from: \"m\", height: \"= n + 1\")")
    );
    assert_eq!(of("Constant"), some("\"= 0.5\""));
    assert_eq!(output("Constant"), "\"o\": \"= 0.5\"");
    assert_eq!(of("Math(b: 2)"), None);
    assert_eq!(of("Perlin(size: 2)"), None);
}
