//! Graph files: from text, by way of a checked document, to nodes that can be evaluated.
mod linked;

pub use linked::{Graph, GraphNode, GraphOutput, GraphParam, Input};

use crate::diagnostics::{Diagnostic, SourceMap};
use crate::registry::Registry;
use std::path::{Path, PathBuf};

/// What the caller changes of a graph.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// The preset to start from.
    pub preset: Option<String>,
    /// Parameters by name.
    pub set: Vec<(String, String)>,
    /// The resolution instead of the file's.
    pub resolution: Option<glam::UVec2>,
    /// What relative paths in `set` are relative to.
    pub working_dir: PathBuf,
}

/// A graph, or why there is none.
pub struct Loaded {
    /// The graph, if there is no error.
    pub graph: Option<Graph>,
    /// Errors and warnings.
    pub diagnostics: Vec<Diagnostic>,
    /// The texts that they point into.
    pub sources: SourceMap,
    /// Everything that was looked at, missing files too.
    pub files: Vec<PathBuf>,
}

/// Reads and checks a graph file.
pub fn load(path: &Path, _registry: &Registry, _options: &LoadOptions) -> Loaded {
    Loaded { graph: None, diagnostics: Vec::new(), sources: SourceMap::default(), files: vec![path.to_path_buf()] }
}
