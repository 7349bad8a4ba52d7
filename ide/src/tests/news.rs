//! Advice about later versions: one source for `check` and for the language server.
use super::super::Workspace;
use super::super::news::advice;
use super::super::server::{Checker, Encoding, Job, uris};
use super::registry;
use lsp_server::Message;
use shibo_graph::{LoadOptions, load_text};
use shibo_node::registry::Registry;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// A kind whose earlier versions are kept, and changes of at most 1/255.
const TABLE: &str = r#"[
    (change: 1, all: true, version: 1, look: Look, what: "first", touches: All, worst: 0, keeps: Gone),
    (change: 2, kind: "Fractal", version: 3, look: Look, what: "turned octaves", touches: Values("kind", ["Turbulence"]), worst: 0.2, keeps: Kernel),
    (change: 3, kind: "Fractal", version: 4, look: Look, what: "other octaves", touches: All, worst: 0.2, keeps: Kernel),
    (change: 4, kind: "Perlin", version: 1, look: Roundings, what: "sums", touches: All, worst: 0.001, keeps: Gone),
    (change: 5, graph: "goat", version: 1, look: Roundings, what: "rounded sums", touches: All, worst: 0.001, keeps: Gone),
]"#;

const OLD: &str = "the pin keeps `Fractal` at version 3; version 4: other octaves";
const OLDER: &str = "the pin keeps `Fractal` at version 2; version 4: other octaves";
const TURNED: &str = "the pin keeps `Fractal` at version 2; version 3: turned octaves";
const ROUNDED: &str = "`Perlin` differs by at most 1 of 255 since change 4, in spite of the pin: sums";
const GOAT: &str = "`shibo:goat` differs by at most 1 of 255 since change 5, in spite of the pin: rounded sums";

fn changed() -> Registry {
    registry().with_changes(TABLE)
}

fn graph(pins: &str, node: &str) -> String {
    format!(
        "({pins} imports: {{ \"g\": \"shibo:goat\" }}, canvas: (size_mm: 8, resolution: 8), nodes: {{ \"a\": {node} }}, outputs: {{ \"a\": \"a\" }})"
    )
}

/// The messages about pins, and the texts at their places.
fn advised(text: &str) -> Vec<(String, String)> {
    let registry = changed();
    let loaded = load_text(Path::new("/nowhere/a.ron"), text, &registry, &LoadOptions::default());
    let graph = loaded.graph.unwrap_or_else(|| panic!("{text}: {:?}", loaded.diagnostics));
    let told = advice(&registry, &graph).into_iter().filter(|one| one.message.contains("the pin"));
    let told = told.map(|one| {
        let source = graph.sources.text(one.span.file);
        assert!(one.warning && one.help.is_some(), "{one:?}");
        (one.message, source[one.span.start..one.span.end].to_owned())
    });
    told.collect()
}

#[test]
fn later_versions_are_advised_at_the_nodes() {
    let plain = "Fractal(octaves: 2)";
    for (pins, node, expected) in [
        ("pins: 2,", plain, vec![(OLD, "Fractal")]),
        ("pins: 3,", plain, vec![]),
        // A change that does not touch the node is no reason for it to have a later version.
        ("pins: 1,", plain, vec![(OLDER, "Fractal")]),
        ("pins: 1,", "Fractal(kind: Turbulence)", vec![(TURNED, "Fractal"), (OLDER, "Fractal")]),
        ("", plain, vec![]),
        ("pins: 3,", "Perlin()", vec![(ROUNDED, "Perlin")]),
        // A version that is held stays when the pin is raised.
        ("pins: (change: 2, hold: { \"Fractal\": 3 }),", plain, vec![]),
        ("pins: (change: 5, hold: { \"Fractal\": 3 }),", plain, vec![]),
        // Nodes of a shipped graph are told at its use.
        ("pins: 2,", "Use(graph: \"g\")", vec![(OLD, "Use"), (GOAT, "Use")]),
        ("pins: 4,", "Use(graph: \"g\")", vec![(GOAT, "Use")]),
        ("pins: 5,", "Use(graph: \"g\")", vec![]),
    ] {
        let found = advised(&graph(pins, node));
        // The shipped graph may have nodes of other kinds that a line of the table names.
        let found: Vec<(&str, &str)> = found.iter().map(|(told, at)| (told.as_str(), at.as_str())).collect();
        let found: Vec<_> = found.into_iter().filter(|one| node != "Use(graph: \"g\")" || one.0 != ROUNDED).collect();
        assert_eq!(found, expected, "{pins} {node}");
    }
}

#[test]
fn the_language_server_tells_the_same_advice() {
    for (pins, node) in
        [("pins: 2,", "Fractal(octaves: 2)"), ("pins: 1,", "Use(graph: \"g\")"), ("pins: 3,", "Perlin()")]
    {
        let (text, path) = (graph(pins, node), Path::new("/nowhere/a.ron"));
        let advised: Vec<String> = advised(&text).into_iter().map(|(told, _)| told).collect();
        assert!(!advised.is_empty(), "{text}");
        let mut workspace = Workspace::new(Arc::new(changed()), Vec::new());
        let file = workspace.open(path, text.as_str());
        let told = Arc::new(Mutex::new(Vec::new()));
        let out = told.clone();
        let send = move |message: Message| {
            if let Message::Notification(note) = message {
                let diagnostics = note.params["diagnostics"].as_array().expect("a list").clone();
                out.lock().expect("one thread").extend(diagnostics);
            }
        };
        let mut checker = Checker::new(workspace, "/nowhere".into(), Encoding::Utf8, send);
        checker.take(Job::Text { uri: uris::uri(path).expect("an address"), version: 1, file });
        while checker.check_next() {}
        let told = told.lock().expect("one thread");
        for message in advised {
            let one = told.iter().find(|one| one["data"]["message"] == message.as_str());
            let one = one.unwrap_or_else(|| panic!("{message} is not among {told:?}"));
            assert_eq!((&one["severity"], &one["code"]), (&2.into(), &"advice".into()));
        }
    }
}
