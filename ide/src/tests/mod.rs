//! Tests of the editor features on the shipped graphs.
mod calls;
mod changes;
mod completion;
mod edits;
mod formula_changes;
mod formulas;
mod holes;
mod local_graphs;
mod news;
mod offers;
mod places;
mod ranks;

use super::{Cx, File, Habits, Workspace, World};
use shibo_node::registry::Registry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folder of the graphs.
pub(crate) fn graphs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").join("graphs")
}

/// Registry with all nodes and the graphs of the library.
pub(crate) fn registry() -> Registry {
    shibo_library::registry()
        .with_successor(super::migrate::successor)
        .with_retired_fields(super::migrate::is_retired_field)
}

/// A workspace of the shipped graphs.
pub(super) fn shipped() -> Workspace {
    Workspace::new(Arc::new(registry()), vec![graphs()])
}

/// Completions at the `|` of a text, in a workspace of one file.
pub(super) fn offered(text: &str) -> Vec<String> {
    let at = text.find('|').expect("a cursor");
    let mut workspace = Workspace::new(Arc::new(registry()), Vec::new());
    let file = workspace.open(Path::new("/nowhere/a.ron"), text.replacen('|', "", 1));
    let cx = Cx { world: &workspace, file: &file };
    super::complete(cx, at).into_iter().map(|one| one.label).collect()
}

/// Asks about a text, in a workspace of one file.
pub(super) fn with<T>(text: &str, ask: impl FnOnce(Cx<'_>, &Arc<File>) -> T) -> T {
    let mut workspace = Workspace::new(Arc::new(registry()), Vec::new());
    let file = workspace.open(Path::new("/nowhere/a.ron"), text);
    ask(Cx { world: &workspace, file: &file }, &file)
}

/// Asks about the `|` of a text that stands among the nodes of a graph, which imports another one as `lines`.
pub(super) fn at_cursor<T>(node: &str, ask: impl FnOnce(Cx<'_>, &Arc<File>, usize) -> T) -> T {
    let text = GRAPH.replace("HERE", node);
    let at = text.find('|').expect("a cursor");
    let mut workspace = Workspace::new(Arc::new(registry()), Vec::new());
    workspace.open(Path::new("/nowhere/lines.ron"), LINES);
    let file = workspace.open(Path::new("/nowhere/a.ron"), text.replacen('|', "", 1));
    ask(Cx { world: &workspace, file: &file }, &file, at)
}

/// A graph with nodes of all types.
const GRAPH: &str = r##"(
  imports: { "lines": "lines.ron" },
  functions: {
    // A ridge along the zeros of `x`.
    "ridge(x, w)": "1 - smoothstep(0, w, abs(x))",
  },
  params: {
    "pitch": Number(default: 2, doc: "Size of a wave"),
    "tint": Color(default: "#884422"),
    "style": Choice(default: "Fine", options: ["Fine", "Coarse"]),
  },
  inputs: { "field": Gray(default: 0.5) },
  nodes: {
    "dots": PoissonPoints(pitch: 1),
    "waves": Perlin(size: 3),
    "cells": Worley(size: 2),
    "swirl": Curl(size: 4),
    "color": GradientMap(input: "waves", stops: [(0, "#000000"), (1, "#ffffff")]),
    "leather": Material(base_color: "color", height: "waves"),
    "used": Use(graph: "lines"),
    HERE,
    "after": "= last + 1",
  },
  outputs: { "height": "after" },
)
"##;

/// A graph that `GRAPH` imports.
const LINES: &str = r##"(
  functions: { "groove(x)": "min(x, 0)" },
  nodes: { "lines": Perlin(), "m": Material(height: "lines") },
  outputs: { "depth": "lines", "material": "m", "sum": "= lines * 2" },
)
"##;

/// Statistics of all graphs but one, so that nothing is learnt from the text under test.
pub(super) fn habits_without(path: &str) -> Habits {
    let files: Vec<File> = shibo_library::graphs()
        .iter()
        .filter(|graph| graph.path != path)
        .map(|graph| File::new(graph.path, graph.text))
        .collect();
    Habits::of(shipped().registry(), &files)
}
