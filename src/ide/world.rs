//! What the answers are computed from: the file, those around it, and the kinds of nodes.
use super::file::{File, Section};
use super::habits::Habits;
use shibo_engine::node::KindInfo;
use shibo_engine::registry::Registry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The files and the kinds. Texts that are not saved yet count instead of what is on disk.
pub(crate) trait World {
    /// The kinds of nodes.
    fn registry(&self) -> &Registry;

    /// The graph file at a path, if it can be read.
    fn file(&self, path: &Path) -> Option<Arc<File>>;

    /// The path of the graph that an import of the file `from` means.
    fn import(&self, from: &Path, name: &str) -> Option<PathBuf>;

    /// All graph files of the workspace.
    fn graphs(&self) -> Vec<Arc<File>>;

    /// The names in a folder, and whether each is a folder itself.
    fn folder(&self, path: &Path) -> Vec<(String, bool)>;

    /// What graphs usually look like.
    fn habits(&self) -> &Habits;
}

/// A file in its world.
#[derive(Clone, Copy)]
pub(crate) struct Cx<'a> {
    /// The others.
    pub(crate) world: &'a dyn World,
    /// The file.
    pub(crate) file: &'a File,
}

impl<'a> Cx<'a> {
    /// The kinds.
    pub(crate) fn registry(self) -> &'a Registry {
        self.world.registry()
    }

    /// What is known of a kind.
    pub(crate) fn kind(self, kind: &str) -> Option<&'a KindInfo> {
        self.registry().info(kind)
    }

    /// The path of an import.
    pub(crate) fn import_path(self, name: &str) -> Option<PathBuf> {
        let item = self.file.entry(Section::Imports, name)?;
        self.world.import(&self.file.path, item.value.as_ref()?.text()?)
    }

    /// The graph that an import means.
    pub(crate) fn imported(self, name: &str) -> Option<Arc<File>> {
        self.world.file(&self.import_path(name)?)
    }

    /// The graph that the entry `node` uses, if it is a `Use` or an `Each`.
    pub(crate) fn used(self, node: &str) -> Option<Arc<File>> {
        let value = self.file.entry(Section::Nodes, node)?.value.as_ref()?;
        is_use(self.file.word(value)?).then(|| self.imported(self.file.text_of(value, "graph")?))?
    }
}

/// Whether a kind puts other graphs into this one.
pub(crate) fn is_use(kind: &str) -> bool {
    matches!(kind, "Use" | "Each")
}
