//! Nodes that need more memory than available.
use super::{Graph, GraphNode};
use crate::diagnostics::{Code, Diagnostic};

impl Graph {
    /// A warning for each node that an output depends on and that needs more than `memory` bytes for the whole picture:
    /// a render would refuse it. Other nodes work in tiles, with any amount of memory.
    pub fn too_large(&self, memory: u64) -> Vec<Diagnostic> {
        let needed = self.needed();
        let warning = |node: &GraphNode| {
            let bytes = Some(node.node.whole_bytes(&node.canvas)).filter(|bytes| *bytes > memory)?;
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
            Some(Diagnostic::new(Code::Advice, node.span, message).help(help).as_warning())
        };
        let nodes = self.nodes.node_weights().zip(needed).filter(|(_, needed)| *needed);
        nodes.filter_map(|(node, _)| warning(node)).collect()
    }
}
