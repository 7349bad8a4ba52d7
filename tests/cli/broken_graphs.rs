//! Shipped graphs with random mistakes: loading never panics, and reports point into the texts.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use proptest::prelude::*;
use shibo_graph::syntax::{Tree, format};
use shibo_graph::{LoadOptions, Loaded, load_text};
use shibo_node::registry::Registry;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

static REGISTRY: LazyLock<Registry> = LazyLock::new(shibo_nodes::registry);

/// Small graphs of different kinds, with their texts.
static GRAPHS: LazyLock<Vec<(PathBuf, String)>> = LazyLock::new(|| {
    let names = ["starter", "noise_basics", "worn_strap", "inlay", "lib/wrinkles", "calf"];
    let path = |name| Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("graphs/{name}.ron"));
    names.map(|name| (path(name), std::fs::read_to_string(path(name)).unwrap())).into()
});

const PUT: [&str; 20] = [
    "", "\"", "(", ")", "[", "]", "{", "}", ",", ":", "//", "/*", "'", "\\", "$", "\n", "r#\"", "= (", "\u{FEFF}", "シ",
];

/// Number of steps into which a text is divided to choose a place.
const SHARES: usize = 100_000;

/// Replaces `len` bytes at a place by another text.
fn edit(text: &mut String, (at, len, put): (usize, usize, usize)) {
    let at = text.floor_char_boundary(at * text.len() / SHARES);
    let end = text.floor_char_boundary((at + len).min(text.len())).max(at);
    text.replace_range(at..end, PUT[put]);
}

fn check(loaded: &Loaded) {
    assert_eq!(loaded.graph.is_none(), loaded.has_errors());
    for (file, source) in loaded.sources.sources().iter().enumerate() {
        let told = loaded.diagnostics.iter().filter(|d| d.span.file.0 == file);
        let mut count = 0;
        for d in told {
            count += 1;
            assert!(source.text.get(d.span.start..d.span.end).is_some(), "{d:?}");
        }
        assert!(count <= 1000, "{count} reports");
    }
}

/// A report at the beginning of a text covers whole characters.
#[test]
fn accepts_any_first_character() {
    for text in ["シ", "シ(nodes: {})", "(シ: 1)", "é"] {
        check(&load_text(Path::new("a.ron"), text, &REGISTRY, &LoadOptions::default()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn loads_broken_texts_without_panic(
        which in 0..6_usize,
        edits in proptest::collection::vec((0..SHARES, 0..12_usize, 0..PUT.len()), 1..5),
    ) {
        let (path, text) = &GRAPHS[which];
        let mut text = text.clone();
        edits.into_iter().for_each(|one| edit(&mut text, one));
        let tree = Tree::parse(text.as_str());
        // A few edits cause few errors, however long the text is.
        prop_assert!(tree.errors().len() <= 100, "{:#?}", tree.errors());
        let loaded = load_text(path, &text, &REGISTRY, &LoadOptions::default());
        check(&loaded);
        match format(&text) {
            Ok(laid_out) => prop_assert_eq!(format(&laid_out), Ok(laid_out)),
            Err(errors) => prop_assert!(!errors.is_empty() && loaded.has_errors()),
        }
    }
}
