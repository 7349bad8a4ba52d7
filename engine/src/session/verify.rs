//! Verifies the caches: computes everything once more without them and compares.
use super::{Failure, Session};
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::{Caches, CancelToken, Keys, MemoryCache, Observer, Run, encode};
use crate::graph::Graph;
use crate::value::{Grid, Stop, Value, Window};
use glam::UVec2;
use petgraph::graph::NodeIndex;
use std::collections::BTreeSet;

/// The largest width and height at which fields are compared.
const SIDE: u32 = 320;

impl Session {
    /// Evaluates every output of every node with and without the caches, and compares the bytes. Reports the nodes that
    /// differ, but not the nodes that merely read one of them.
    ///
    /// # Errors
    /// Errors of the evaluation.
    pub fn verify(
        &self,
        graph: &Graph,
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Vec<Diagnostic>, Failure> {
        let cold = Caches::new(MemoryCache::new(self.memory), None);
        self.pooled(graph, || {
            let keys = Keys::of(graph)?;
            let warm = Run::new(graph, &keys, &self.caches, self.memory, cancel, observer);
            let cold = Run::new(graph, &keys, &cold, self.memory, cancel, observer);
            let mut bad = BTreeSet::new();
            let mut found = Vec::new();
            for &index in keys.order() {
                let impure = differs(graph, &warm, &cold, index)?;
                let follows = graph.nodes.neighbors_directed(index, petgraph::Incoming).any(|n| bad.contains(&n));
                if impure.is_some() || follows {
                    bad.insert(index);
                }
                if let (Some(output), false) = (impure, follows) {
                    let node = &graph.nodes[index];
                    let message = format!("`{}` gave another `{output}` the second time", node.name);
                    let help = "its result depends on something that is not in its key: this is a defect of the node";
                    found.push(Diagnostic::new(Code::BadValue, node.span, message).help(help));
                }
            }
            warm.report_values();
            Ok(found)
        })
    }
}

/// The first output of a node that differs between two runs.
fn differs(graph: &Graph, a: &Run<'_>, b: &Run<'_>, index: NodeIndex) -> Result<Option<&'static str>, Failure> {
    let grid = graph.canvas.grid(graph.canvas.resolution.min(UVec2::splat(SIDE)));
    for (i, output) in graph.nodes[index].node.outputs().iter().enumerate() {
        let (x, y) = (a.values(&[(index, i)])?, b.values(&[(index, i)])?);
        let (x, y) = (bytes(a, graph, &grid, x)?, bytes(b, graph, &grid, y)?);
        if x != y {
            return Ok(Some(output.name));
        }
    }
    Ok(None)
}

/// A value as bytes; a field as a small picture.
fn bytes(run: &Run<'_>, graph: &Graph, grid: &Grid, values: Vec<Value>) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    for value in values {
        for field in value.fields() {
            let window = Window::full(grid.period.unwrap_or(UVec2::ONE));
            let tile = run.raster(&field, grid, window).map_err(|stop: Stop| super::located(run, graph, stop))?;
            bytes.extend(tile.data().iter().flat_map(|v| v.to_bits().to_le_bytes()));
        }
        bytes.extend(encode(&value).unwrap_or_default());
    }
    Ok(bytes)
}
