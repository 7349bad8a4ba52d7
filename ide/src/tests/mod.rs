//! Tests of the editor features on the shipped graphs.
mod changes;
mod completion;
mod edits;
mod places;

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
    shibo_library::registry(std::env::temp_dir().join("shibo-library"))
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

/// Statistics of all graphs but one, so that nothing is learnt from the text under test.
pub(super) fn habits_without(path: &str) -> Habits {
    let files: Vec<File> = shibo_library::graphs()
        .iter()
        .filter(|graph| graph.path != path)
        .map(|graph| File::new(graph.path, graph.text))
        .collect();
    Habits::of(shipped().registry(), &files)
}
