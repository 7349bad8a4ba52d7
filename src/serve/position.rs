//! Source positions of nodes.
use petgraph::graph::NodeIndex;
use serde::Serialize;
use shibo_graph::Graph;
use std::path::PathBuf;
use std::sync::Arc;

/// Callback that receives the source positions of clicked nodes.
pub(super) type Jumps = Arc<dyn Fn(&SourcePosition) + Send + Sync>;

/// A position in a file for display: line and column count from 1, columns in characters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct SourcePosition {
    pub(crate) file: PathBuf,
    pub(crate) line: usize,
    pub(crate) column: usize,
}

impl SourcePosition {
    /// Position of the kind of a node; `None` if the node is in a graph of the library.
    pub(super) fn of(graph: &Graph, node: NodeIndex) -> Option<Self> {
        let span = graph.nodes[node].span;
        let at = graph.sources.position(span.file, span.start);
        // Library graphs and command-line arguments have no file.
        let file = graph.sources.path(span.file).canonicalize().ok()?;
        Some(Self { file, line: at.line, column: at.column })
    }
}
