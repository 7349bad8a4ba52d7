//! Looking into a graph part by part, as an interactive program does: the keys are derived once, and every look reads
//! what the last one left in the caches.
use super::{Failure, Session, located};
use crate::eval::{CancelToken, Keys, NodeStats, Observer, Run};
use crate::graph::Graph;
use crate::value::{Field, Grid, Stop, Tile, Value, Window};
use petgraph::graph::NodeIndex;

/// One look into a graph: its values and pictures, and what was done for them.
pub struct Look<'r> {
    run: &'r Run<'r>,
    graph: &'r Graph,
}

impl Session {
    /// The keys of all results of `graph`. Reads the files that it names.
    ///
    /// # Errors
    /// Files that cannot be read, at the parameters that name them.
    pub fn keys(&self, graph: &Graph) -> Result<Keys, Failure> {
        Keys::of(graph).map_err(Failure::Errors)
    }

    /// Lets `work` look into `graph` on the session's threads. What it makes is kept in the caches; the disk cache is not
    /// trimmed, see [`trim`](Self::trim).
    ///
    /// # Errors
    /// Those of `work`.
    pub fn look<T: Send>(
        &self,
        graph: &Graph,
        keys: &Keys,
        cancel: &CancelToken,
        observer: &dyn Observer,
        work: impl FnOnce(&Look<'_>) -> Result<T, Failure> + Send,
    ) -> Result<T, Failure> {
        self.pool.install(|| {
            let run = Run::new(graph, keys, &self.caches, self.memory, cancel, observer);
            work(&Look { run: &run, graph })
        })
    }

    /// Brings the disk cache back below its bound.
    pub fn trim(&self) {
        if let Some(disk) = &self.caches.disk {
            disk.trim();
        }
    }
}

impl Look<'_> {
    /// The value of an output of a node, if the node makes it; a field is not evaluated yet.
    ///
    /// # Errors
    /// What went wrong, at its place.
    pub fn value(&self, node: NodeIndex, output: usize) -> Result<Option<Value>, Failure> {
        Ok(self.run.values(&[(node, output)])?.pop())
    }

    /// The values of a field in a window of a grid.
    ///
    /// # Errors
    /// What went wrong, at its place.
    pub fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Failure> {
        self.run.raster(field, grid, window).map_err(|stop: Stop| located(self.run, self.graph, stop))
    }

    /// What was done for each node so far, in the order of the graph.
    pub fn stats(&self) -> Vec<NodeStats> {
        self.run.stats()
    }
}
