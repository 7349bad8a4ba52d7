//! Tests of the comparison.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::diff::{Change, ChangeKind, Effect, GraphDiff, diff};
use crate::testing::{Dice, Edit, graphs, tools};
use crate::{DiffRequest, GraphText};
use shibo_graph::syntax::format;
use std::path::{Path, PathBuf};

const BEFORE: &str = r##"(
  version: 1,
  params: { "pitch": Number(default: 0.62, range: (0.3, 2), unit: "mm", doc: "Size") },
  presets: { "fine": { "pitch": 0.3 } },
  nodes: {
    "noise": Perlin(size: "$pitch", octaves: 2),
    "colors": GradientMap(input: "noise", stops: [(0, "#000000"), (0.5, "#808080"), (1, "#ffffff")]),
    "soft": Blur(input: "noise", radius: 1.5),
    "sum": "= noise + 2 * soft",
  },
  outputs: { "sum": "sum", "color": "colors" },
)
"##;

fn compared(path: &Path, before: &str, after: &str) -> GraphDiff {
    let graph = |text: &str| Some(GraphText { path: path.to_owned(), text: text.to_owned() });
    diff(&tools(), &DiffRequest { before: graph(before), after: graph(after), comments: false })
}

/// A change as `path: before -> after`.
fn line(change: Change) -> String {
    let [before, after] = [change.before, change.after].map(|text| text.unwrap_or_else(|| "-".to_owned()));
    format!("{}: {before} -> {after}", change.path.join("."))
}

/// Changes of a text with replacements.
fn after(replacements: &[(&str, &str)]) -> Vec<String> {
    let text = replacements.iter().fold(BEFORE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    compared(Path::new("a.ron"), BEFORE, &text).changes.into_iter().map(line).collect()
}

#[test]
fn lists_changed_fields() {
    assert_eq!(after(&[("default: 0.62", "default: 0.7")]), ["params.pitch.default: 0.62 -> 0.7"]);
    assert_eq!(after(&[("radius: 1.5", "radius: 1.50 /* mm */"), ("noise + 2 * soft", "noise\n + 2*soft")]), [""; 0]);
    assert_eq!(
        after(&[("\"soft\": Blur(input: \"noise\", radius: 1.5),\n", "")]),
        ["nodes.soft: Blur(input: \"noise\", radius: 1.5) -> -"]
    );
    assert_eq!(
        after(&[(", radius: 1.5", ""), ("octaves: 2", "octaves: 2, seed: 3")]),
        ["nodes.noise.seed: - -> 3", "nodes.soft.radius: 1.5 -> -"]
    );
    assert_eq!(
        after(&[("Perlin(size: \"$pitch\", octaves: 2)", "Simplex(size: \"$pitch\")")]),
        ["nodes.noise: Perlin(size: \"$pitch\", octaves: 2) -> Simplex(size: \"$pitch\")"]
    );
}

#[test]
fn pairs_elements_of_lists_by_content() {
    assert_eq!(after(&[("(0, \"#000000\"), ", "")]), ["nodes.colors.stops.0: (0, \"#000000\") -> -"]);
    assert_eq!(
        after(&[("(0.5, \"#808080\")", "(0.5, \"#908080\"), (0.7, \"#a0a0a0\")")]),
        [
            "nodes.colors.stops.1: (0.5, \"#808080\") -> (0.5, \"#908080\")",
            "nodes.colors.stops.2: - -> (0.7, \"#a0a0a0\")"
        ]
    );
}

#[test]
fn reports_renamed_things_once() {
    let renamed = [("\"noise\": P", "\"ground\": P"), ("\"noise\",", "\"ground\","), ("noise +", "ground +")];
    assert_eq!(after(&renamed), ["nodes.ground: noise -> ground"]);
    // The reader of a renamed node is renamed too, and a parameter with its uses.
    let both = [&renamed[..], &[("\"soft\"", "\"smooth\""), ("2 * soft", "2 * smooth")]].concat();
    assert_eq!(after(&both), ["nodes.ground: noise -> ground", "nodes.smooth: soft -> smooth"]);
    assert_eq!(after(&[("pitch", "size_of_cells")]), ["params.size_of_cells: pitch -> size_of_cells"]);
    let diff = compared(Path::new("a.ron"), BEFORE, &BEFORE.replace("soft", "smooth"));
    assert_eq!((diff.changes[0].change, diff.changes[0].references), (ChangeKind::Renamed, Some(1)));
    assert_eq!((diff.changes[0].line_before, diff.changes[0].line_after), (Some(8), Some(8)));
}

#[test]
fn tells_units_defaults_and_effects() {
    let text = BEFORE.replace("0.62", "0.7").replace(", radius: 1.5", "").replace("\"Size\"", "\"Size of a cell\"");
    let changes = compared(Path::new("a.ron"), BEFORE, &text).changes;
    assert_eq!((changes[0].unit.as_deref(), changes[0].effect), (Some("mm"), Effect::Picture));
    assert_eq!((changes[1].path[2].as_str(), changes[1].effect), ("doc", Effect::None));
    assert!(changes[2].default.is_some(), "{:?}", changes[2]);
    let json = GraphDiff { changes, unreadable: Vec::new() };
    assert_eq!(json.changes.len(), 3);
}

#[test]
fn lists_changes_of_pins() {
    let held = r#"pins: (change: 4, hold: { "Fractal": 2 }),"#;
    for (before, after, expected) in [
        ("", "pins: 4,", vec!["pins: - -> 4"]),
        ("pins: 4,", "pins: 5,", vec!["pins: 4 -> 5"]),
        ("pins: 4,", "", vec!["pins: 4 -> -"]),
        ("pins: 4,", held, vec![r#"pins: 4 -> (change: 4, hold: { "Fractal": 2 })"#]),
        (
            held,
            r#"pins: (hold: { "Fractal": 3 }, change: 5),"#,
            vec!["pins.hold.Fractal: 2 -> 3", "pins.change: 4 -> 5"],
        ),
        (held, r#"pins: (hold: { "Fractal": 2, }, /* four */ change: 4),"#, vec![]),
    ] {
        let [old, new] = [before, after].map(|pins| BEFORE.replace("version: 1,", &format!("version: 1, {pins}")));
        let changes = compared(Path::new("a.ron"), &old, &new).changes;
        assert!(changes.iter().all(|change| change.effect == Effect::Picture), "{changes:?}");
        assert_eq!(changes.into_iter().map(line).collect::<Vec<_>>(), expected, "{before} {after}");
    }
}

#[test]
fn compares_readable_parts_of_broken_texts() {
    let broken = BEFORE.replace("radius: 1.5", "radius: ").replace("0.62", "0.7");
    let diff = compared(Path::new("a.ron"), BEFORE, &broken);
    assert!(diff.unreadable.iter().any(|line| line.starts_with("after:8:")), "{diff:?}");
    assert!(diff.changes.iter().any(|change| change.path.join(".") == "params.pitch.default"), "{diff:?}");
}

#[test]
fn lists_comments_on_request() {
    let graph = |text: &str| Some(GraphText { path: PathBuf::from("a.ron"), text: text.to_owned() });
    let after = BEFORE.replace("    \"soft\"", "    // Smooth.\n    \"soft\"");
    let request = |comments| DiffRequest { before: graph(BEFORE), after: graph(&after), comments };
    assert!(diff(&tools(), &request(false)).changes.is_empty());
    let changes = diff(&tools(), &request(true)).changes;
    assert_eq!((changes.len(), changes[0].path.join(".")), (1, "nodes.soft".to_owned()));
}

#[test]
fn lists_all_random_edits_and_nothing_else() {
    let tools = tools();
    let (mut count, mut listed) = (0, 0);
    for (seed, (path, before)) in graphs().into_iter().enumerate().filter(|(_, (_, text))| text.len() < 20_000) {
        assert!(compared(&path, &before, &format(&before).unwrap()).changes.is_empty(), "{}", path.display());
        for round in 0..6 {
            let mut dice = Dice((seed * 100 + round) as u64);
            let edit = Edit::random(&before, "new", &mut dice);
            let Some(after) = edit.apply(&tools, &path, &before) else { continue };
            let changes = compared(&path, &before, &after).changes;
            let paths: Vec<String> = changes.iter().map(|change| change.path.join(".")).collect();
            let is = |start: &[String]| paths.len() == 1 && paths[0].starts_with(&start.join("."));
            let good = match &edit {
                Edit::Comment(..) | Edit::Format | Edit::Move(_) => paths.is_empty(),
                Edit::Rename(_, new) => {
                    changes.len() == 1
                        && changes[0].change == ChangeKind::Renamed
                        && is(&["nodes".to_owned(), new.clone()])
                }
                Edit::Add(..) => changes.len() == 1 && changes[0].change == ChangeKind::Added,
                Edit::Remove(path) => is(path) && changes[0].change == ChangeKind::Removed,
                // The number may be the same, or make two elements of a list equal.
                Edit::Number(path, ..) => {
                    paths.len() <= 2 && paths.iter().all(|found| found.starts_with(&path.join(".")))
                }
            };
            assert!(good, "{} {edit:?}: {changes:?}", path.display());
            (count, listed) = (count + 1, listed + changes.len());
        }
    }
    assert!(count > 200 && listed > 150, "{count} edits, {listed} changes");
}
