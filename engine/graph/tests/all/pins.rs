//! Graphs that are pinned at a change.
use crate::graph_nodes;
use shibo_graph::{LoadOptions, Loaded, load_text};
use shibo_node::registry::{Library, Registry};
use shibo_value::diagnostics::Diagnostic;
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
    match loaded.graph {
        Some(graph) => Ok(graph.nodes.node_weights().map(|node| node.node.version()).collect()),
        None => Err(loaded.diagnostics.iter().map(told).next().unwrap_or_default()),
    }
}

fn told(d: &Diagnostic) -> String {
    format!("{} {}: {}", d.code.as_str(), d.message, d.help.as_deref().unwrap_or_default())
}

/// Changes of shipped graphs. `coat` uses `goat`, and `swell` calls functions of `waves`; both have no change of their own.
const SHIPPED_CHANGES: &str = r#"[
    (change: 1, all: true, version: 1, look: Look, what: "first", touches: All, worst: 0, keeps: Gone),
    (change: 2, graph: "goat", version: 2, look: Look, what: "deeper bumps", touches: All, worst: 0.2, keeps: Gone),
    (change: 3, graph: "lib/folds", version: 2, look: Look, what: "fewer folds", touches: Given(["depth"]), worst: 0.1, keeps: Gone),
    (change: 4, graph: "lib/folds", version: 3, look: Look, what: "round folds", touches: Values("mode", ["Round"]), worst: 0.3, keeps: Gone),
    (change: 5, graph: "goat", version: 3, look: Names, what: "other names", touches: All, worst: 0, keeps: Gone),
    (change: 6, graph: "goat", version: 4, look: Roundings, what: "sums", touches: All, worst: 0.001, keeps: Gone),
    (change: 7, graph: "waves", version: 2, look: Look, what: "flatter bumps", touches: All, worst: 0.05, keeps: Gone),
    (change: 8, graph: "waves", version: 3, look: Look, what: "deeper", touches: Given(["depth"]), worst: 0.2, keeps: Gone),
]"#;

/// Graphs that a program ships.
struct Shipped;

impl Library for Shipped {
    fn names(&self) -> Vec<&str> {
        vec!["coat", "folds", "goat", "swell", "waves"]
    }

    fn find(&self, name: &str) -> Option<String> {
        [format!("{name}.ron"), format!("lib/{name}.ron")].into_iter().find(|path| self.text(path).is_some())
    }

    fn text(&self, path: &str) -> Option<&str> {
        match path {
            "coat.ron" => {
                Some(r#"(imports: { "goat": "goat.ron" }, nodes: { "g": Use(graph: "goat") }, outputs: { "o": "g" })"#)
            }
            "waves.ron" => Some(
                r#"(functions: { "bump(x)": "x * x", "twice(x)": "2 * bump(x)" }, nodes: { "r": Rays() }, outputs: { "o": "r" })"#,
            ),
            "swell.ron" => Some(
                r#"(imports: { "waves": "waves.ron" }, functions: { "high(x)": "waves.twice(x)" },
                    params: { "deep": Number(default: "= waves.bump(2)") },
                    nodes: { "r": Rays(width: "$deep") }, outputs: { "o": "r" })"#,
            ),
            "goat.ron" => Some(r#"(nodes: { "r": Rays() }, outputs: { "o": "r" })"#),
            "lib/folds.ron" => Some(
                r#"(params: { "depth": Number(default: 1), "mode": Choice(default: "Flat", options: ["Flat", "Round"]) },
                    presets: { "deep": { "depth": 3 }, "soft": { "mode": "Round" } },
                    nodes: { "r": Rays(width: "$depth") }, outputs: { "o": "r" })"#,
            ),
            _ => None,
        }
    }

    fn file(&self, _path: &str) -> Option<&'static [u8]> {
        None
    }
}

/// Loads a graph with imports of the graphs that its nodes use, or whose functions they call.
fn load_using(pins: &str, table: &'static str, nodes: &str, newest: bool) -> (Registry, Loaded) {
    let shipped = ["goat", "coat", "folds", "waves", "swell"].map(|name| (name, format!("shibo:{name}")));
    let own = ["free", "own", "mine", "formulas", "new"].map(|name| (name, format!("{name}.ron")));
    let is_used = |name: &str| nodes.contains(&format!("graph: {name:?}")) || nodes.contains(&format!("{name}."));
    let used = shipped.iter().chain(&own).filter(|(name, _)| is_used(name));
    let imports = used.map(|(name, path)| format!("{name:?}: {path:?}")).collect::<Vec<_>>().join(", ");
    let text = format!("({pins} imports: {{ {imports} }}, nodes: {{ {nodes} }})");
    let user = |pins: &str| {
        let nodes = r#""u": Use(graph: "goat")"#;
        format!(r#"({pins} imports: {{ "goat": "shibo:goat" }}, nodes: {{ {nodes} }}, outputs: {{ "o": "u" }})"#)
    };
    let caller = |pins: &str, node: &str| {
        let functions = r#"imports: { "waves": "shibo:waves" }, functions: { "f(x)": "1 + waves.bump(x)" }"#;
        format!(r#"({pins} {functions}, nodes: {{ "n": {node} }}, outputs: {{ "o": "n" }})"#)
    };
    let overlay = [
        ("free.ron", user("")),
        ("own.ron", user("pins: 2,")),
        ("mine.ron", caller("", "Rays()")),
        ("formulas.ron", caller("", r#""= waves.twice(x)""#)),
        ("new.ron", caller("pins: 7,", "Rays()")),
    ];
    let overlay = overlay.map(|(path, text)| (PathBuf::from(path), Arc::from(text))).into();
    let registry = graph_nodes::registry().with_library(Arc::new(Shipped)).with_changes(table);
    let options = LoadOptions { newest, overlay, ..LoadOptions::default() };
    let loaded = load_text(Path::new("a.ron"), &text, &registry, &options);
    (registry, loaded)
}

/// The errors of a graph that uses shipped graphs, each with the text at its place.
fn refused(pins: &str, table: &'static str, nodes: &str, newest: bool) -> Vec<(String, String)> {
    let (_, loaded) = load_using(pins, table, nodes, newest);
    assert_eq!(loaded.graph.is_some(), loaded.diagnostics.iter().all(|one| one.warning));
    let place = |one: &Diagnostic| {
        let text = loaded.sources.text(one.span.file);
        format!("{}: {}", loaded.sources.path(one.span.file).display(), &text[one.span.start..one.span.end])
    };
    loaded.diagnostics.iter().map(|one| (place(one), told(one))).collect()
}

#[test]
fn a_shipped_graph_of_an_earlier_version_is_refused() {
    let gone = "changed-kind `shibo:goat` of version 1 is not in this program any more: `shibo migrate FILE` takes version 4: \
                deeper bumps (up to 20 % of full scale)";
    for (uses, place) in [
        (r#""u": Use(graph: "goat")"#, "a.ron: Use"),
        (r#""p": Pieces(), "e": Each(graph: "goat", over: 3, ids: "p.ids")"#, "a.ron: Each"),
        // Nested: by a shipped graph that has no change of its own, and by a file without pins.
        (r#""u": Use(graph: "coat")"#, "a.ron: Use"),
        (r#""p": Pieces(), "e": Each(graph: "coat", over: 3, ids: "p.ids")"#, "a.ron: Each"),
        (r#""u": Use(graph: "free")"#, "free.ron: Use"),
    ] {
        assert_eq!(refused("pins: 1,", SHIPPED_CHANGES, uses, false), [(place.to_owned(), gone.to_owned())], "{uses}");
        if !uses.contains("Each") {
            for (pins, newest) in [("", false), ("pins: 1,", true), ("pins: 2,", false), ("pins: 6,", false)] {
                assert!(refused(pins, SHIPPED_CHANGES, uses, newest).is_empty(), "{pins} {uses}");
            }
        }
    }
    // The pins of a file do not depend on the graphs that use it.
    assert!(refused("pins: 1,", SHIPPED_CHANGES, r#""u": Use(graph: "own")"#, false).is_empty());
    // A graph that no node uses alters no picture.
    assert!(refused("pins: 1,", SHIPPED_CHANGES, r#""r": Rays(), /* graph: "goat" */"#, false).is_empty());
}

#[test]
fn a_shipped_graph_stays_where_its_changes_do_not_touch_the_use() {
    let found = |with: &str| {
        let nodes = format!(r#""u": Use(graph: "folds"{with})"#);
        refused("pins: 2,", SHIPPED_CHANGES, &nodes, false).into_iter().map(|(_, told)| told).collect::<Vec<_>>()
    };
    for with in ["", r#", with: { "mode": "Flat" }"#, ", seed: 3"] {
        assert_eq!(found(with), [""; 0], "{with}");
    }
    for (with, says) in [
        (r#", with: { "depth": 2 }"#, "fewer folds (up to 10 % of full scale)"),
        (r#", preset: "deep""#, "fewer folds (up to 10 % of full scale)"),
        (r#", with: { "mode": "Round" }"#, "round folds (up to 30 % of full scale)"),
        (r#", preset: "soft""#, "round folds (up to 30 % of full scale)"),
        (r#", preset: "deep + soft""#, "fewer folds (up to 30 % of full scale)"),
    ] {
        let told = found(with);
        let gone = "changed-kind `shibo:folds` of version 1 is not in this program any more: ";
        assert_eq!(told, [format!("{gone}`shibo migrate FILE` takes version 3: {says}")], "{with}");
    }
}

#[test]
fn a_function_of_a_shipped_graph_of_an_earlier_version_is_refused() {
    let gone = "changed-kind `shibo:waves` of version 1 is not in this program any more: `shibo migrate FILE` takes version 3: \
                flatter bumps (up to 5 % of full scale)";
    let found = |pins: &str, nodes: &str, newest: bool| refused(pins, SHIPPED_CHANGES, nodes, newest);
    for (nodes, place) in [
        (r#""f": "= waves.bump(x)""#, "a.ron: waves.bump"),
        (r#""f": "= 1 + waves.twice(x) + waves.twice(y)""#, "a.ron: waves.twice"),
        (r#""r": Rays(width: "= waves.bump(2)")"#, "a.ron: waves.bump"),
        (r#""u": Use(graph: "folds", with: { "depth": "= waves.bump(2)" })"#, "a.ron: waves.bump"),
        // A shipped graph calls functions of another one: in its nodes, and in a function.
        (r#""u": Use(graph: "swell")"#, "a.ron: Use"),
        (r#""f": "= swell.high(x)""#, "a.ron: swell.high"),
        // A file without pins has those of the graph that calls or uses it.
        (r#""f": "= mine.f(x)""#, "mine.ron: waves.bump"),
        (r#""u": Use(graph: "formulas")"#, "formulas.ron: waves.twice"),
    ] {
        assert_eq!(found("pins: 6,", nodes, false), [(place.to_owned(), gone.to_owned())], "{nodes}");
        // Change 8 touches no function.
        for (pins, newest) in [("", false), ("pins: 6,", true), ("pins: 7,", false), ("pins: 8,", false)] {
            assert!(found(pins, nodes, newest).is_empty(), "{pins} {nodes}");
        }
    }
    assert!(found("pins: 6,", r#""f": "= new.f(x)""#, false).is_empty(), "a file with pins of its own");
    let functions = r#"pins: 6, functions: { "f(x)": "waves.bump(x)" },"#;
    assert!(found(functions, r#""r": Rays() /* waves. */"#, false).is_empty(), "no formula calls the function");
    let place = "a.ron: waves.bump".to_owned();
    assert_eq!(found(functions, r#""g": "= f(x)" /* waves. */"#, false), [(place.clone(), gone.to_owned())]);
    // In a local graph.
    let local = r#"pins: 6, graphs: { "part": (nodes: { "n": "= waves.bump(x)" }, outputs: { "o": "n" }) },"#;
    assert_eq!(found(local, r#""u": Use(graph: "part") /* waves. */"#, false), [(place, gone.to_owned())]);
    assert!(found(local, r#""r": Rays() /* waves. */"#, false).is_empty(), "no node uses it");
}

#[test]
fn a_change_of_a_shipped_graph_alters_the_nodes_that_call_its_functions() {
    let altered = |before: &str, nodes: &str| {
        let (registry, loaded) = load_using(before, SHIPPED_CHANGES, nodes, false);
        let graph = loaded.graph.unwrap_or_else(|| panic!("{nodes}: {:?}", loaded.diagnostics));
        let change = registry.changes().since(6).next().unwrap();
        let mut names: Vec<String> = graph.altered_by(change).map(|node| node.name.clone()).collect();
        names.sort();
        names.join(" ")
    };
    let nodes = r#""f": "= waves.bump(x)", "r": Rays(), "w": Rays(width: "= waves.bump(2)"), "g": "= f + r""#;
    assert_eq!(altered("", nodes), "f w");
    assert_eq!(altered("", r#""f": "= swell.high(x)", "r": Rays()"#), "f");
    assert_eq!(altered("", r#""u": Use(graph: "waves"), "r": Rays()"#), "u/r");
    assert_eq!(altered("", r#""r": Rays()"#), "");
    // A default is a value of no node, so it may alter all.
    let params = r#"params: { "deep": Number(default: "= waves.bump(2)") },"#;
    assert_eq!(altered(params, r#""r": Rays(width: "$deep"), "s": Rays() /* waves. */"#), "r s");
}

#[test]
fn another_way_of_making_pictures_is_refused() {
    let table = r#"[
        (change: 1, all: true, version: 1, look: Look, what: "first", touches: All, worst: 0, keeps: Gone),
        (change: 2, all: true, version: 2, look: Roundings, what: "sums", touches: All, worst: 0.001, keeps: Gone),
        (change: 3, all: true, version: 3, look: Look, what: "sharper samples", touches: All, worst: 0.04, keeps: Gone),
    ]"#;
    for (pins, refuses) in [("pins: 1,", true), ("pins: (change: 2),", true), ("pins: 3,", false), ("", false)] {
        let found = refused(pins, table, r#""r": Rays()"#, false);
        assert_eq!(found.len(), usize::from(refuses), "{pins} {found:?}");
        assert!(
            found.iter().all(|(_, told)| {
                told.starts_with("changed-kind the way in which pictures were made before change 3 ")
                    && told.ends_with("takes the newest one: sharper samples (up to 4 % of full scale)")
            }),
            "{found:?}"
        );
    }
    assert!(refused("pins: 1,", table, r#""r": Rays()"#, true).is_empty());
}

#[test]
fn a_version_that_is_held_and_gone_is_named() {
    let held = r#"pins: (change: 4, hold: { "Rays": 2 }),"#;
    let loaded = load(held, r#""r": Rays(width: 3)"#, false);
    let [error] = &loaded.diagnostics[..] else { panic!("{:?}", loaded.diagnostics) };
    assert_eq!(
        told(error),
        "changed-kind `Rays` of version 2 is not in this program any more: remove `Rays` from `hold` of the pins to take \
         version 5: other rays (up to 31 % of full scale)"
    );
    let held_at = error.related[0].span;
    assert_eq!(&loaded.sources.text(held_at.file)[held_at.start..held_at.end], "\"Rays\"");
    // The pins of the user of a file hold its kinds too.
    assert!(versions(held, r#""o": Use(graph: "other")"#).unwrap_err().contains("remove `Rays` from `hold`"));
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
