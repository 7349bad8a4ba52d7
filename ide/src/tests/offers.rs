//! Offers in places without a node: presets, `with`, empty files, and names of other programs.
use super::super::complete;
use super::super::hover;
use super::super::{Cx, Workspace, World, signature};
use super::edits::NoPictures;
use super::{offered, with};
use std::path::Path;
use std::sync::Arc;

/// A graph that the tests import as `layer`.
const LAYER: &str = r#"(
  params: {
    "style": Choice(default: "Fine", options: ["Fine", "Coarse"], doc: "How the strands run"),
    "wet": Bool(default: false, doc: "Whether it rained"),
  },
  inputs: { "field": Gray(default: 0.5) },
  presets: { "old": { "style": "Coarse" }, "rainy": { "wet": true } },
  nodes: { "a": Perlin() },
  outputs: { "depth": "a", "sum": "= a * 2" },
)"#;

/// Asks about the `|` of a text that imports `LAYER`.
fn at<T>(text: &str, ask: impl FnOnce(Cx<'_>, usize) -> T) -> T {
    let at = text.find('|').expect("a cursor");
    let mut workspace = Workspace::new(Arc::new(super::registry()), Vec::new());
    workspace.open(Path::new("/nowhere/layer.ron"), LAYER);
    let file = workspace.open(Path::new("/nowhere/a.ron"), text.replacen('|', "", 1));
    ask(Cx { world: &workspace, file: &file }, at)
}

/// Labels and inserted texts of the offers at the `|` of a text.
fn inserted(text: &str) -> Vec<(String, String)> {
    at(text, |cx, at| complete(cx, at).into_iter().map(|one| (one.label, one.insert)).collect())
}

/// Labels of the offers at the `|` of the arguments of a `Use`.
fn of_use(args: &str) -> Vec<(String, String)> {
    inserted(&format!(
        "(imports: {{ \"layer\": \"layer.ron\" }}, nodes: {{ \"u\": Use(graph: \"layer\", {args}) }}, outputs: {{ \"o\": \"u\" }})"
    ))
}

/// Labels of the offers at the `|` of the values of a preset.
fn of_preset(values: &str) -> Vec<(String, String)> {
    inserted(&LAYER.replace("\"wet\": true", values))
}

fn first(found: &[(String, String)], count: usize) -> Vec<&str> {
    found.iter().take(count).map(|(label, _)| label.as_str()).collect()
}

fn hovered(text: &str) -> String {
    at(text, |cx, at| hover::hover(cx, at, &NoPictures).map_or(String::new(), |hover| hover.markdown))
}

#[test]
fn offers_values_of_parameters() {
    for found in [of_preset("\"style\": |"), of_use("with: { \"style\": | }")] {
        assert_eq!(first(&found, 2), ["Fine", "Coarse"], "{found:?}");
        assert_eq!(found[0].1, "\"Fine\"", "an option is a text");
    }
    for found in
        [of_preset("\"style\": \"|\""), of_use("with: { \"style\": \"|\" }"), of_use("with: { \"style\": \"| }")]
    {
        assert_eq!(first(&found, 2), ["Fine", "Coarse"], "{found:?}");
        assert_eq!(found[0].1, "Fine", "the quotes are there already");
    }
    for found in [of_preset("\"wet\": |"), of_use("with: { \"wet\": | }")] {
        let mut words = first(&found, 2);
        words.sort_unstable();
        assert_eq!(words, ["false", "true"], "{found:?}");
        assert_eq!(found[0].1, found[0].0, "booleans have no quotes");
    }
    assert_eq!(first(&of_preset("\"wet\": tr|"), 1), ["true"]);
    assert_eq!(first(&of_use("with: { \"wet\": tr| }"), 1), ["true"]);
    assert_eq!(first(&of_use("with: { \"style\": \"Co|\" }"), 1), ["Coarse"]);
}

#[test]
fn offers_a_graph_in_an_empty_file() {
    for text in ["|", "\n|\n", "// A note.\n|", "no|", "("] {
        let text = if text.contains('|') { text.to_owned() } else { format!("{text}|") };
        assert!(!offered(&text).is_empty(), "{text:?}");
    }
    let found = inserted("|");
    assert!(found[0].1.starts_with('(') && found[0].1.contains("nodes: {"), "{found:?}");
    assert!(offered("(|").contains(&"nodes".to_owned()));
}

#[test]
fn offers_ports_of_a_use() {
    for rest in ["\"layer.|", "\"layer.|\"", "\"layer.de|"] {
        let text = format!(
            "(\n  imports: {{ \"layer\": \"layer.ron\" }},\n  nodes: {{\n    \"layer\": Use(graph: \"layer\"),\n    \
             \"b\": Blur(input: {rest}\n  }},\n  outputs: {{ \"o\": \"b\" }},\n)"
        );
        let found = inserted(&text);
        assert_eq!(first(&found, 1), ["layer.depth"], "{rest}: {found:?}");
    }
}

#[test]
fn finds_imports_without_their_extension() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("layer.ron"), LAYER).unwrap();
    let text = "(imports: { \"layer\": \"layer\" }, nodes: { \"l\": Use(graph: \"layer\"), \"b\": Blur(input: \"l.";
    let mut workspace = Workspace::new(Arc::new(super::registry()), Vec::new());
    let file = workspace.open(&folder.path().join("a.ron"), text);
    let found = complete(Cx { world: &workspace, file: &file }, text.len());
    let labels: Vec<&str> = found.iter().map(|one| one.label.as_str()).collect();
    assert_eq!(labels[..2], ["l.depth", "l.sum"], "the imported file is not open in the editor");
}

#[test]
fn names_of_other_programs_find_kinds() {
    for (word, kind) in [
        ("Voronoi", "Worley"),
        ("Voro", "Worley"),
        ("Cells", "Worley"),
        ("Uniform", "= …"),
        ("ColorRamp", "GradientMap"),
    ] {
        let found = offered(&format!("(nodes: {{ \"a\": {word}| }})"));
        assert!(found.iter().take(4).any(|label| label == kind), "{word}: {found:?}");
    }
}

#[test]
fn choices_and_presets_have_manuals() {
    let used = |args: &str| {
        hovered(&format!(
            "(imports: {{ \"layer\": \"layer.ron\" }}, nodes: {{ \"u\": Use(graph: \"layer\", {args}) }}, outputs: {{ \"o\": \"u\" }})"
        ))
    };
    assert!(hovered("(nodes: { \"a\": Blend(mode: Mul|tiply) })").contains("a choice of **mode**"));
    assert!(used("preset: \"o|ld\"").contains("preset **old**"));
    assert!(used("preset: \"old+ra|iny\"").contains("preset **rainy**"));
    let preset = hovered(&LAYER.replace("\"old\"", "\"o|ld\""));
    assert!(preset.contains("preset **old**") && preset.contains("style"), "{preset}");
    for text in [
        used("with: { \"style\": \"Coa|rse\" }"),
        hovered(&LAYER.replace("\"style\": \"Coarse\"", "\"style\": \"Co|arse\"")),
        hovered(&LAYER.replace("default: \"Fine\"", "default: \"Fi|ne\"")),
    ] {
        assert!(text.contains("How the strands run") && text.contains("`Fine`, `Coarse`"), "{text}");
    }
    for text in [used("with: { \"wet\": tr|ue }"), hovered(&LAYER.replace("\"wet\": true", "\"wet\": tr|ue"))] {
        assert!(text.contains("Whether it rained"), "{text}");
    }
}

#[test]
fn signatures_list_choices() {
    with("(nodes: { \"a\": Blend(mode: Multiply) })", |cx, _| {
        let found = signature(cx, cx.file.text.find("mode").unwrap()).unwrap();
        let active = &found.fields[found.active.unwrap()];
        let label = &found.label[active.0.clone()];
        assert!(label.starts_with("mode: Normal | ") && label.contains("Multiply"), "{label}");
    });
}

#[test]
fn frequent_words_come_early() {
    let place = |text: &str, word: &str| offered(text).iter().position(|label| label == word);
    let node = |typed: &str| format!("(nodes: {{ \"noise\": Perlin(size: 3), \"a\": {typed} }})");
    for (text, word, most) in [
        (node("S|"), "Switch", 8),
        (node("Sw|"), "Switch", 2),
        (node("G|"), "GradientMap", 3),
        (node("Gr|"), "GradientMap", 1),
        (node("Blend(base: \"noise\", mode: |)"), "Normal", 4),
        (node("Blend(base: \"noise\", mode: N|)"), "Normal", 1),
        ("(params: { \"p\": | })".to_owned(), "Number", 1),
        ("(params: { \"p\": N| })".to_owned(), "Number", 1),
        ("(inputs: { \"p\": | })".to_owned(), "Gray", 1),
    ] {
        let found = place(&text, word);
        assert!(found.is_some_and(|place| place < most), "{word} in {text}: {found:?}");
    }
}

#[test]
fn misspelt_sections_of_nodes_are_graphs() {
    let is_meant = |path: &str, text: &str| {
        let mut workspace = Workspace::new(Arc::new(super::registry()), Vec::new());
        let file = workspace.open(Path::new(path), text);
        file.is_meant_as_graph(&|kind| workspace.registry().info(kind).is_some())
    };
    for text in [
        "(nods: {})",
        "(nods: { \"a\": Perlin() })",
        "(things: { \"a\": Perlin(), \"b\": \"= a\" })",
        "(canvas: (size_mm: 4))",
        "(nodes: {",
    ] {
        assert!(is_meant("/nowhere/a.ron", text), "{text}");
    }
    for text in ["", "(", "(window: (width: 3), \"oops", "(scenes: {}, entities: { \"a\": Entity() })", "(nods: 3)"] {
        assert!(!is_meant("/nowhere/a.ron", text), "{text}");
    }
    assert!(is_meant("/nowhere/a.shibo.ron", "(window: (width: 3))"));
}
