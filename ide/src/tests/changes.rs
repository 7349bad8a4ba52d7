//! Renames and code actions: the resulting text, and that its meaning stays the same.
use super::super::actions::{Action, actions, apply};
use super::super::diagnose::{by_file, hints};
use super::super::rename::rename;
use super::super::{Cx, Workspace};
use super::graphs;
use shibo_engine::eval::Keys;
use shibo_graph::{Graph, LoadOptions, load_text};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn workspace() -> Workspace {
    Workspace::new(Arc::new(super::registry()), Vec::new())
}

/// Actions for the selection between two `|` of a text, or at one `|`.
fn offered(text: &str) -> (String, Vec<Action>) {
    let (from, to) = (text.find('|').unwrap(), text.rfind('|').unwrap());
    let plain = text.replace('|', "");
    let mut workspace = workspace();
    let file = workspace.open(Path::new("/nowhere/a.ron"), plain.as_str());
    let cx = Cx { world: &workspace, file: &file };
    let found = hints(cx);
    let selected = from..if to == from { from } else { to - 1 };
    (plain, actions(cx, &selected, &found))
}

/// The text after applying the action whose title begins with `title`.
fn after(text: &str, title: &str) -> String {
    let (plain, actions) = offered(text);
    let titles: Vec<&str> = actions.iter().map(|action| action.title.as_str()).collect();
    let found = actions.iter().find(|action| action.title.starts_with(title));
    let found = found.unwrap_or_else(|| panic!("{title} is not among {titles:?}"));
    apply(&plain, &found.edits[Path::new("/nowhere/a.ron")])
}

#[test]
fn applies_each_code_action() {
    let text = "(\n  nodes: {\n    \"a\": Perlin(size: |3),\n  },\n  outputs: { \"o\": \"a\" },\n)";
    let named = after(text, "Name this value as parameter `$size`");
    assert!(named.contains("params: {\n    \"size\": Number(default: 3, unit: \"mm\""), "{named}");
    assert!(named.contains("Perlin(size: \"$size\")"), "{named}");
    let text = "(nodes: { \"a\": Perlin(size: 3), \"b\": Blur(|radius: 1) }, outputs: { \"o\": \"b\" })";
    assert!(after(text, "Add `input`").contains("Blur(radius: 1, input: \"a\")"));
    let text = "(presets: { |\"b\": { }, \"a\": { } }, nodes: {})";
    assert!(after(text, "Sort").contains("{ \"a\": { }, \"b\": { } }"));
    let text = "(nodes: { \"a\": Image(path: \"/nowhere/sub/|x.png\") })";
    assert!(after(text, "Make the path relative").contains("path: \"sub/x.png\""));
    let text = "(\n  nodes: {\n    // One.\n    \"a\": Perlin(),\n    \"|b\": Perlin(),\n    \"c\": Perlin(),\n  },\n  outputs: { \"o\": \"a\" },\n)";
    assert_eq!(
        after(text, "Remove all 2"),
        "(\n  nodes: {\n    // One.\n    \"a\": Perlin(),\n  },\n  outputs: { \"o\": \"a\" },\n)"
    );
}

#[test]
fn replaces_kinds_of_earlier_versions() {
    let text = "(nodes: { \"n\": Perlin(), \"h\": Math(operation: Multiply, a: \"n\", b: 0.5), \"e\": Emboss(input: \"h\"), \
                \"m\": SetChannels(material: \"o\", height: \"e\"), \"o\": Material(roughness: 0.5) }, outputs: { \"o\": \"m\" })";
    let path = Path::new("/nowhere/a.ron");
    let loaded = load_text(path, text, &super::registry(), &LoadOptions::default());
    let found = by_file(&loaded.diagnostics, &loaded.sources).remove(path).unwrap();
    let helps: Vec<_> = found.iter().map(|finding| finding.help.as_deref().unwrap_or_default()).collect();
    assert_eq!(
        helps,
        [
            "write `\"= 0.5 * n\"` instead, or run: shibo migrate FILE",
            "write `Material(from: \"o\", height: \"e\")` instead, or run: shibo migrate FILE",
        ]
    );
    let mut workspace = workspace();
    let file = workspace.open(path, text);
    let offered = actions(Cx { world: &workspace, file: &file }, &(0..0), &found);
    let of = |title: &str| offered.iter().find(|action| action.title == title).unwrap_or_else(|| panic!("{offered:?}"));
    let one = of("Replace `Math` by a formula");
    assert_eq!(one.mends, Some(0));
    let old = "Math(operation: Multiply, a: \"n\", b: 0.5)";
    assert_eq!(apply(text, &one.edits[path]), text.replace(old, "\"= 0.5 * n\""));
    let new = text.replace("SetChannels(material:", "Material(from:");
    assert_eq!(apply(text, &of("Replace `SetChannels` by `Material`").edits[path]), new);
    let all = apply(text, &of("Replace all old kinds in the file").edits[path]);
    // The line is too long for a formula in the place where it is read.
    assert_eq!(all, new.replace(old, "\"= 0.5 * n\""));
}

/// Keys of the outputs of a graph, which identify its pictures.
fn keys(path: &Path, text: &str, others: &[(PathBuf, String)]) -> BTreeMap<String, String> {
    let overlay = others.iter().map(|(path, text)| (path.clone(), text.as_str().into())).collect();
    let options = LoadOptions { overlay, ..LoadOptions::default() };
    let loaded = load_text(path, text, &super::registry(), &options);
    let graph: Graph = loaded.graph.unwrap_or_else(|| panic!("{text}\n{:?}", loaded.diagnostics));
    let keys = Keys::of(&graph).unwrap();
    let key = |output: &shibo_graph::GraphOutput| keys.output(output.node, output.output).to_string();
    graph.outputs.iter().map(|output| (output.name.clone(), key(output))).collect()
}

#[test]
fn extracting_keeps_pictures() {
    let mut tried = 0;
    for graph in shibo_library::graphs() {
        let path = graphs().join(graph.path);
        let mut workspace = workspace();
        let file = workspace.open(&path, graph.text);
        let cx = Cx { world: &workspace, file: &file };
        let items = file.entries(super::super::Section::Nodes);
        let before = keys(&path, graph.text, &[]);
        for window in items.windows(4).step_by(7) {
            let selected = window[0].range.start..window[3].range.end;
            let found = actions(cx, &selected, &[]);
            let Some(action) = found.into_iter().find(|action| !action.creates.is_empty()) else { continue };
            let text = apply(graph.text, &action.edits[&file.path]);
            assert_eq!(
                keys(&path, &text, &action.creates),
                before,
                "{}: {text}\n{}",
                action.title,
                action.creates[0].1
            );
            tried += 1;
        }
    }
    assert!(tried > 100, "{tried}");
}

#[test]
fn inlining_keeps_pictures() {
    let mut tried = 0;
    for graph in shibo_library::graphs() {
        let path = graphs().join(graph.path);
        let mut workspace = workspace();
        let file = workspace.open(&path, graph.text);
        let cx = Cx { world: &workspace, file: &file };
        let before = keys(&path, graph.text, &[]);
        for item in file.entries(super::super::Section::Nodes) {
            let found = actions(cx, &(item.range.start..item.range.start), &[]);
            let Some(action) = found.iter().find(|action| action.title.starts_with("Put the nodes")) else { continue };
            let text = apply(graph.text, &action.edits[&file.path]);
            assert_eq!(keys(&path, &text, &[]), before, "{}: {}\n{text}", graph.path, action.title);
            tried += 1;
        }
    }
    assert!(tried > 10, "{tried}");
}

#[test]
fn inlining_keeps_dependent_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let inner = r#"(params: { "grain": Integer(default: 3), "other": Integer(default: "$grain"), "far": Integer(default: "= $grain + $other") },
 nodes: { "a": Perlin(seed: "$other"), "b": Perlin(seed: "$far"), "sum": "= a + b" }, outputs: { "o": "sum" })"#;
    std::fs::write(folder.path().join("inner.ron"), inner).unwrap();
    let text = r#"(imports: { "inner": "inner.ron" }, nodes: { "u": Use(graph: "inner", with: { "grain": 5 }), "w": Use(graph: "inner") },
 outputs: { "o": "u.o", "p": "w.o" })"#;
    let path = folder.path().join("outer.ron");
    let mut workspace = workspace();
    let file = workspace.open(&path, text);
    let cx = Cx { world: &workspace, file: &file };
    let before = keys(&path, text, &[]);
    for item in file.entries(super::super::Section::Nodes) {
        let found = actions(cx, &(item.range.start..item.range.start), &[]);
        let action =
            found.iter().find(|action| action.title.starts_with("Put the nodes")).expect("it can be put there");
        let changed = apply(text, &action.edits[&file.path]);
        assert_eq!(keys(&path, &changed, &[]), before, "{changed}");
    }
}

#[test]
fn renames_in_escapes_and_expressions() {
    let text = r#"(params: { "p": Number(default: 1) }, nodes: { "a": Perlin(size: "= $p + 2 * $p"), "b": Blur(input: "\u{61}", radius: r"$p") }, outputs: { "o": "b" })"#;
    let mut workspace = workspace();
    let file = workspace.open(Path::new("/nowhere/a.ron"), text);
    let cx = Cx { world: &workspace, file: &file };
    let renamed = |at: usize, name: &str| {
        let edits = rename(cx, &file, at, name).unwrap();
        apply(text, &edits[&file.path])
    };
    let node = renamed(text.find("\"a\"").unwrap() + 1, "grain");
    assert!(node.contains("\"grain\": Perlin") && node.contains("input: \"grain\""), "{node}");
    let param = renamed(text.find("$p").unwrap() + 1, "size");
    assert!(param.contains("= $size + 2 * $size") && param.contains("radius: r\"$size\""), "{param}");
    assert!(param.starts_with("(params: { \"size\""), "{param}");
    assert!(rename(cx, &file, text.find("$p").unwrap() + 1, "1p").is_err());
    assert!(rename(cx, &file, text.find("\"a\"").unwrap() + 1, "b").unwrap_err().contains("already"));
}
