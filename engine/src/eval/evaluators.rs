//! The engine as seen by code that computes whole pictures. Time spent on its inputs is measured separately.
use super::meter::Working;
use super::run::{Run, node_code};
use super::warnings::{Gathered, Warnings};
use super::{Event, lock};
use crate::diagnostics::{Code, Problem};
use crate::graph::GraphNode;
use crate::node::{Call, Outputs};
use crate::value::{Cuts, Evaluator, Field, Grid, Key, Pictures, Read, Stop, Tile, Value, Window};
use std::sync::{Mutex, PoisonError};

/// The engine as a node sees it.
pub(super) struct NodeEvaluator<'r, 'g> {
    pub(super) run: &'r Run<'g>,
    pub(super) node: &'r GraphNode,
    pub(super) key: Key,
    pub(super) working: &'r Working<'r>,
    /// The warnings of the node.
    warnings: Mutex<Vec<Problem>>,
    /// The warnings about the pictures that it has read.
    found: Mutex<Gathered>,
}

impl NodeEvaluator<'_, '_> {
    /// The warnings of the node, and the ones about the pictures it has read.
    pub(super) fn into_warnings(self) -> (Vec<Problem>, Warnings) {
        let found = lock(&self.found).warnings();
        (self.warnings.into_inner().unwrap_or_else(PoisonError::into_inner), found)
    }
}

impl Evaluator for NodeEvaluator<'_, '_> {
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
        let (tile, warnings) = self.working.read(|| self.run.picture(field, grid, window))?;
        lock(&self.found).add(&warnings);
        Ok(tile)
    }

    fn check(&self) -> Result<(), Stop> {
        self.run.cancel.check()
    }

    fn progress(&self, done: u64, total: u64) {
        self.run.observer.event(Event::Node { name: self.node.name.clone(), done, total });
    }

    fn key(&self) -> Option<Key> {
        Some(self.key)
    }

    fn memory(&self) -> u64 {
        self.run.memory
    }

    fn cuts(&self) -> Option<&Cuts> {
        Some(&self.run.cuts)
    }

    fn warn(&self, problem: Problem) {
        lock(&self.warnings).push(problem);
    }
}

impl<'g> Run<'g> {
    /// Returns the engine for `node`, whose first output has the key `key`.
    pub(super) fn evaluator<'r>(
        &'r self,
        node: &'r GraphNode,
        key: Key,
        working: &'r Working<'r>,
    ) -> NodeEvaluator<'r, 'g> {
        NodeEvaluator { run: self, node, key, working, warnings: Mutex::default(), found: Mutex::default() }
    }

    /// Returns true if the work was cancelled.
    pub fn is_over(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// Evaluates a node with inputs other than its own; `key` identifies the inputs.
    ///
    /// # Errors
    /// As the node reports.
    pub fn apply(&self, node: &GraphNode, inputs: &[Value], key: Key) -> Result<Outputs, Stop> {
        let working = self.meter.begin();
        let evaluator = self.evaluator(node, key, &working);
        let (canvas, files) = (&node.canvas, &node.files);
        let call = Call { kind: &node.kind, canvas, inputs, files, evaluator: &evaluator };
        let made = node_code(|| node.node.evaluate(&call));
        for problem in evaluator.into_warnings().0 {
            self.observer.event(Event::Warning(self.at_node(node, problem).as_warning()));
        }
        made
    }
}

/// The pictures that a whole-picture operation reads.
pub(super) struct Whole<'r, 'g> {
    pub(super) run: &'r Run<'g>,
    pub(super) reads: Vec<Read<'r>>,
    pub(super) working: &'r Working<'r>,
    /// The warnings about the pictures that were read.
    pub(super) found: Mutex<Gathered>,
}

impl Pictures for Whole<'_, '_> {
    fn read(&self, number: usize, window: Window) -> Result<Tile, Stop> {
        let Some(Read { field, grid, .. }) = self.reads.get(number).filter(|r| r.window.contains(&window)) else {
            let message = format!("picture {number} is read beyond what was stated");
            return Err(Problem::new(Code::BadValue, message).help("this is a defect of the node").into());
        };
        let (tile, warnings) = self.working.read(|| self.run.picture(field, grid, window))?;
        lock(&self.found).add(&warnings);
        Ok(tile)
    }

    fn check(&self) -> Result<(), Stop> {
        self.run.cancel.check()
    }
}
