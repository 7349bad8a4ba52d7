//! Inspects a graph part by part, as an interactive program does: the keys are derived once, and each look reuses the
//! results that the last one left in the caches.
use super::{Failure, Session, located};
use crate::eval::{CancelToken, Keys, NodeStats, Observer, Run};
use crate::graph::{Graph, Input};
use crate::value::{Field, Grid, Key, Stop, Tile, Value, Window};
use petgraph::graph::NodeIndex;

/// One look into a graph: its values and pictures, and statistics of the work.
pub struct Look<'r> {
    run: &'r Run<'r>,
    graph: &'r Graph,
}

impl Session {
    /// The keys of all results of `graph`. Reads the files that the graph names.
    ///
    /// # Errors
    /// Files that cannot be read, at the parameters that name them.
    pub fn keys(&self, graph: &Graph) -> Result<Keys, Failure> {
        Keys::of(graph).map_err(Failure::Errors)
    }

    /// Runs `work` with a look into `graph` on the session's threads. Results stay in the caches; the store is not
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
        self.pooled(graph, || {
            let run = Run::new(graph, keys, &self.caches, self.memory, cancel, observer);
            let result = work(&Look { run: &run, graph });
            run.report_values();
            result
        })
    }

    /// Trims the store of results to its bound.
    pub fn trim(&self) {
        if let Some(store) = &self.caches.store {
            store.tidy();
        }
    }
}

impl Look<'_> {
    /// The value of an output of a node, if the node produces it; a field is not evaluated yet.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn value(&self, node: NodeIndex, output: usize) -> Result<Option<Value>, Failure> {
        Ok(self.run.values(&[(node, output)])?.pop())
    }

    /// The main output that `by` would have with an output of `node` connected to the slot `slot`.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn through(
        &self,
        (node, output): (NodeIndex, usize),
        (by, slot): (NodeIndex, usize),
    ) -> Result<Option<Value>, Failure> {
        let reader = &self.graph.nodes[by];
        let mut inputs = Vec::with_capacity(reader.inputs.len());
        for (at, input) in reader.inputs.iter().enumerate() {
            let value = match input {
                _ if at == slot => self.value(node, output)?,
                Input::Wire { node, output } => self.value(*node, *output)?,
                Input::Constant(field) => Some(Value::Field(field.clone())),
            };
            let Some(value) = value else { return Ok(None) };
            inputs.push(value);
        }
        let keys = self.run.keys();
        let key = Key::of("through", &[keys.output(by, 0).as_bytes(), keys.output(node, output).as_bytes()]);
        let made = self.run.apply(reader, &inputs, key).map_err(|stop| located(self.run, self.graph, stop))?;
        let main = reader.node.outputs().first().map_or("", |output| output.name);
        Ok(made.take(main, true).cloned())
    }

    /// Computes the values of a field in a window of a grid.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Failure> {
        self.run.raster(field, grid, window).map_err(|stop: Stop| located(self.run, self.graph, stop))
    }

    /// Returns true if the work was cancelled.
    pub fn is_over(&self) -> bool {
        self.run.is_over()
    }

    /// The work done for each node so far, in the order of the graph.
    pub fn stats(&self) -> Vec<NodeStats> {
        self.run.stats()
    }
}
