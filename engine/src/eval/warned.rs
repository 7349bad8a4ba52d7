//! Reports the warnings of a run.
use super::run::Run;
use super::warnings::{Warning, Warnings};
use super::{Event, lock};
use crate::diagnostics::Problem;
use crate::graph::{GraphNode, Input};
use crate::value::Key;
use petgraph::graph::NodeIndex;
use std::sync::Arc;

impl Run<'_> {
    /// Records the warnings of a computed or fetched result, and reports the new ones.
    pub(super) fn note_warnings(&self, key: Key, warnings: &Warnings) {
        if warnings.is_empty() {
            return;
        }
        warnings.iter().for_each(|warning| self.report(warning));
        lock(&self.warnings.results).insert(key, Arc::clone(warnings));
    }

    /// Reports a warning about the values of a result, once.
    fn report(&self, warning: &Warning) {
        let mut reported = lock(&self.warnings.reported);
        if !reported.contains(warning) {
            reported.push(warning.clone());
            drop(reported);
            self.warn(warning.owner, warning.problem.clone());
        }
    }

    /// Reports a warning about the values of a result that a tile found; the first of each result.
    pub(super) fn warned(&self, owner: Key, problem: Problem) {
        if lock(&self.warnings.of_tiles).insert(owner) {
            self.warn(owner, problem);
        }
    }

    fn warn(&self, owner: Key, problem: Problem) {
        let makes = |index: &NodeIndex| {
            let outputs = 0..self.graph.nodes[*index].node.outputs().len();
            outputs.into_iter().any(|output| self.keys.output(*index, output) == owner)
        };
        if let Some(index) = self.graph.nodes.node_indices().find(makes) {
            let warning = self.at_node(&self.graph.nodes[index], problem).as_warning();
            self.observer.event(Event::Warning(warning));
        }
    }

    /// The warnings of a node and of its inputs: the warnings of all results that its outputs are made of.
    pub(super) fn warnings_of(&self, node: &GraphNode, owner: Key, own: Vec<Problem>) -> Warnings {
        let mut all: Vec<Warning> = Vec::new();
        let results = lock(&self.warnings.results);
        let wires = node.inputs.iter().filter(|input| matches!(input, Input::Wire { .. }));
        let inherited = wires.filter_map(|wire| results.get(&self.keys.input(wire)));
        let own = own.into_iter().map(|problem| Warning { owner, problem });
        for warning in inherited.flat_map(|list| list.iter().cloned()).chain(own) {
            if !all.contains(&warning) {
                all.push(warning);
            }
        }
        all.into()
    }

    /// The warnings of all results that a value was made of, each once. The value must have been computed or fetched.
    pub fn warnings(&self, (node, output): (NodeIndex, usize)) -> Vec<Problem> {
        let results = lock(&self.warnings.results);
        results
            .get(&self.keys.output(node, output))
            .into_iter()
            .flat_map(|list| list.iter().map(|warning| warning.problem.clone()))
            .collect()
    }
}
