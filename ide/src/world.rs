//! Environment of the answers: the file, related files, and the node kinds.
use super::file::{File, Section};
use super::habits::Habits;
use shibo_graph::LoadOptions;
use shibo_node::KindInfo;
use shibo_node::registry::Registry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Access to files and node kinds. Unsaved texts take precedence over the files on disk.
pub trait World {
    /// The node kinds.
    fn registry(&self) -> &Registry;

    /// Returns the graph file at a path, if it can be read.
    fn file(&self, path: &Path) -> Option<Arc<File>>;

    /// Resolves the path of an import of the file `from`.
    fn import(&self, from: &Path, name: &str) -> Option<PathBuf>;

    /// All graph files of the workspace.
    fn graphs(&self) -> Vec<Arc<File>>;

    /// Names in a folder, each with whether it is a folder.
    fn folder(&self, path: &Path) -> Vec<(String, bool)>;

    /// Statistics of the library graphs.
    fn habits(&self) -> &Habits;

    /// Options for loading a graph: unsaved texts, and folders for imports.
    fn options(&self) -> LoadOptions {
        LoadOptions::default()
    }

    /// True if no answer is needed any more. Long work then ends early with an incomplete one.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// A file and its world.
#[derive(Clone, Copy)]
pub struct Cx<'a> {
    /// The world.
    pub world: &'a dyn World,
    /// The file.
    pub file: &'a File,
}

impl<'a> Cx<'a> {
    /// Another file in the same world.
    pub fn with<'b>(self, file: &'b File) -> Cx<'b>
    where
        'a: 'b,
    {
        Cx { world: self.world, file }
    }

    /// The node kinds.
    pub fn registry(self) -> &'a Registry {
        self.world.registry()
    }

    /// Description of a kind.
    pub fn kind(self, kind: &str) -> Option<&'a KindInfo> {
        self.registry().info(kind)
    }

    /// Path of an import.
    pub fn import_path(self, name: &str) -> Option<PathBuf> {
        let item = self.file.entry(Section::Imports, name)?;
        self.world.import(&self.file.path, item.value.as_ref()?.text()?)
    }

    /// The graph of an import, or the local graph of that name.
    pub fn imported(self, name: &str) -> Option<Arc<File>> {
        match self.import_path(name) {
            Some(path) => self.world.file(&path),
            None => self.file.local(name).map(Arc::new),
        }
    }

    /// The graph of the entry `node`, if that is a `Use` or an `Each`.
    pub fn used(self, node: &str) -> Option<Arc<File>> {
        let value = self.file.entry(Section::Nodes, node)?.value.as_ref()?;
        is_use(self.file.word(value)?).then(|| self.imported(self.file.text_of(value, "graph")?))?
    }
}

/// Returns whether a kind includes another graph.
pub(crate) fn is_use(kind: &str) -> bool {
    matches!(kind, "Use" | "Each")
}
