//! What a graph needs more memory for than there is.
use super::Graph;
use crate::diagnostics::{Code, Diagnostic};

impl Graph {
    /// A warning for each node that outputs need and that needs more than `memory` bytes for the whole picture: a render would
    /// refuse it. All others work by tiles, in any memory.
    pub fn too_large(&self, memory: u64) -> Vec<Diagnostic> {
        let needed = self.needed();
        let warning = |index: petgraph::graph::NodeIndex| {
            let node = &self.nodes[index];
            let bytes = node.node.whole_bytes(&node.canvas);
            let size = node.canvas.resolution;
            let message = format!(
                "`{}` works on the whole picture: {} × {} pixels take at least {} MiB, and {} MiB are allowed",
                node.name,
                size.x,
                size.y,
                bytes >> 20,
                memory >> 20
            );
            let help = if node.fields.iter().any(|(name, _)| name == "resolution") {
                "lower its `resolution`, or raise --memory"
            } else {
                "lower the resolution, or raise --memory"
            };
            (bytes > memory).then(|| Diagnostic::new(Code::Advice, node.span, message).help(help).as_warning())
        };
        self.nodes.node_indices().filter(|index| needed[index.index()]).filter_map(warning).collect()
    }
}
