//! The lock: pictures of pinned graphs, written into `shibo.lock` and compared later. Source: LASTING §1.
mod file;
#[cfg(test)]
mod migrated_tests;
mod sample;
mod verify;

pub use file::{Entry, LOCK, Lock, MOST_BYTES, merge};
pub use sample::{Look, PIXELS, RESOLUTION, Sample, bits_of, sample};
pub use verify::{Because, State, Verified, VerifiedPicture, verified};

use crate::shape::{Field, Fields, canonical};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, Session};
use shibo_graph::Graph;
use shibo_graph::syntax::Tree;
use shibo_ide::actions::pinned_at;
use shibo_value::Key;
use shibo_value::diagnostics::Origin;
use std::path::{Component, Path, PathBuf};

/// The entry of a graph as it is now. The graph must have been loaded at [`RESOLUTION`].
///
/// # Errors
/// Errors of the graph, at their places.
pub fn entry(session: &Session, graph: &Graph, cancel: &CancelToken) -> Result<Entry, Failure> {
    let folder = graph.path.parent().unwrap_or(Path::new(""));
    let sources = graph.sources.sources();
    let text = sources.first().map(|source| source.text.clone()).unwrap_or_default();
    let mut entry = Entry {
        pins: pinned_at(&text).unwrap_or_else(|| session.registry().changes().newest()),
        text: text_hash(&text),
        pictures: sample(session, graph, cancel)?,
        ..Entry::default()
    };
    let shipped = |path: &Path| path.starts_with("shibo:");
    let imports = sources.iter().skip(1).filter(|source| source.origin == Origin::File && !shipped(&source.path));
    entry.files.extend(imports.map(|source| (relative(folder, &source.path), import_hash(&source.text))));
    let keys = session.keys(graph)?;
    for node in graph.nodes.node_indices() {
        for (path, hash) in keys.read_files(node).filter(|(path, _)| !shipped(path)) {
            entry.files.insert(relative(folder, path), short(Key::of("file", &[hash])));
        }
    }
    Ok(entry)
}

/// Identifies the text of a graph apart from comments, layout, the order of named things, and the change at which it is
/// pinned: [`Entry::pins`] is that. Versions that the pins hold count.
pub fn text_hash(text: &str) -> String {
    hash_of(text, |pins| {
        let hold = Fields::readable(pins.value)?.get("hold")?.value;
        (!Fields::readable(hold)?.entries.is_empty()).then(|| canonical(hold))
    })
}

/// Identifies the text of an import apart from comments, layout and the order of named things. Its pins count, since an
/// entry has only those of the graph.
fn import_hash(text: &str) -> String {
    hash_of(text, |pins| Some(canonical(pins.entry)))
}

/// Identifies a text; `pins` is the meaning of its pins.
fn hash_of(text: &str, pins: impl Fn(&Field<'_>) -> Option<String>) -> String {
    let tree = Tree::parse(text);
    let things = tree.value().and_then(Fields::readable).map(|top| {
        let thing = |field: &Field<'_>| if field.name == "pins" { pins(field) } else { Some(canonical(field.entry)) };
        let mut things: Vec<String> = top.entries.iter().filter_map(thing).collect();
        things.sort();
        things.join(",")
    });
    // A text that is no graph counts as it is.
    short(Key::of("text", &[things.unwrap_or_else(|| text.to_owned()).as_bytes()]))
}

fn short(key: Key) -> String {
    key.to_string().chars().take(16).collect()
}

/// A path as seen from a folder, with `/` on every system.
fn relative(folder: &Path, path: &Path) -> String {
    let whole = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned())
    };
    let (folder, path) = (whole(folder), whole(path));
    let same = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let mut seen = PathBuf::new();
    folder.components().skip(same).for_each(|_| seen.push(".."));
    seen.extend(path.components().skip(same).filter(|part| !matches!(part, Component::CurDir)));
    seen.to_string_lossy().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_counts_without_comments_order_and_pin() {
        let graph = "(version: 1, pins: 4, nodes: { \"a\": Perlin(size: 3), \"b\": \"= a * 2\" })";
        let same = "( // A.\n  nodes: { \"b\": \"=a*2\", \"a\": Perlin(size: 3.0) },\n  version: 1,\n)";
        assert_eq!(text_hash(graph), text_hash(same));
        assert_ne!(text_hash(graph), text_hash(&same.replace("3.0", "3.1")));
        assert_eq!([graph, same, "(pins: (hold: {}, change: 12))"].map(pinned_at), [Some(4), None, Some(12)]);
    }

    #[test]
    fn versions_that_a_pin_holds_are_part_of_a_text() {
        let [plain, other, empty, held, later] = [
            "4",
            "12",
            "(change: 4, hold: {})",
            "(hold: { \"A\": 2, \"B\": 1 }, change: 4)",
            "(change: 12, hold: { \"B\": 1, \"A\": 2 })",
        ]
        .map(|pins| format!("(pins: {pins}, nodes: {{}})"));
        assert_eq!([&plain, &other].map(|text| text_hash(text)), [&empty, &empty].map(|text| text_hash(text)));
        assert_eq!(text_hash(&held), text_hash(&later));
        assert_ne!(text_hash(&held), text_hash(&plain));
        assert_ne!(text_hash(&held), text_hash(&held.replace("2", "3")));
    }

    #[test]
    fn pins_are_part_of_an_import() {
        let [none, four, five, held] = ["", "pins: 4,", "pins: 5,", "pins: (change: 4, hold: { \"A\": 2 }),"]
            .map(|pins| import_hash(&format!("({pins} nodes: {{}})")));
        let all = std::collections::BTreeSet::from([&none, &four, &five, &held]);
        assert_eq!(all.len(), 4, "{all:?}");
        assert_eq!(four, import_hash("(nodes: {}, // A.\n pins: 4)"));
        assert_eq!(none, text_hash("(nodes: {})"));
    }

    #[test]
    fn paths_are_seen_from_the_folder() {
        for (folder, path, seen) in [
            ("", "a.png", "a.png"),
            ("g", "g/b/a.png", "b/a.png"),
            ("g/h", "g/a.png", "../a.png"),
            ("g", "a.ron", "../a.ron"),
        ] {
            assert_eq!(relative(Path::new(folder), Path::new(path)), seen);
        }
    }
}
