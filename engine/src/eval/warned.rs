//! Reports the warnings of a run.
use super::run::Run;
use super::warnings::{Finder, Gathered, Warning, Warnings};
use super::{Event, lock};
use crate::diagnostics::Problem;
use crate::graph::{GraphNode, Input};
use crate::value::Key;
use petgraph::graph::NodeIndex;
use std::sync::Arc;

impl Run<'_> {
    /// Records the warnings of a computed or fetched result, and reports the new ones of nodes.
    pub(super) fn note_warnings(&self, key: Key, warnings: &Warnings) {
        if warnings.is_empty() {
            return;
        }
        self.note_kept(warnings);
        lock(&self.warnings.results).insert(key, Arc::clone(warnings));
    }

    /// Reports the new warnings of nodes, and keeps those about values of tiles for the end of the run.
    pub(crate) fn note_kept(&self, warnings: &Warnings) {
        warnings.iter().filter(|warning| !warning.is_of_tile()).for_each(|warning| self.report(warning));
        self.note_values(warnings);
    }

    /// Keeps the warnings about values of tiles for the end of the run.
    pub(super) fn note_values(&self, warnings: &Warnings) {
        let of_tiles: Vec<Warning> = warnings.iter().filter(|warning| warning.is_of_tile()).cloned().collect();
        if !of_tiles.is_empty() {
            lock(&self.warnings.of_tiles).add(&of_tiles.into());
        }
    }

    /// Takes over the warnings about values that another run of the same graph has found.
    pub(crate) fn note_values_of(&self, other: &Run<'_>) {
        let found = lock(&other.warnings.of_tiles).warnings();
        self.note_values(&found);
    }

    /// Reports the warnings about values of tiles, in the order of the graph. Call it at the end of the run. A cancelled
    /// run reports none, because it knows only some of them.
    pub(crate) fn report_values(&self) {
        let found = std::mem::take(&mut *lock(&self.warnings.of_tiles)).warnings();
        if self.cancel.is_cancelled() {
            return;
        }
        let mut at: Vec<(NodeIndex, &Warning)> =
            found.iter().filter_map(|warning| Some((self.maker(warning.owner)?, warning))).collect();
        at.sort_by_key(|(index, _)| *index);
        at.into_iter().for_each(|(index, warning)| self.warn(index, warning.problem.clone()));
    }

    /// Reports a warning of a node, once.
    fn report(&self, warning: &Warning) {
        let mut reported = lock(&self.warnings.reported);
        if !reported.contains(warning) {
            reported.push(warning.clone());
            drop(reported);
            if let Some(index) = self.maker(warning.owner) {
                self.warn(index, warning.problem.clone());
            }
        }
    }

    /// The node that makes a result.
    fn maker(&self, owner: Key) -> Option<NodeIndex> {
        let makes = |index: &NodeIndex| {
            let outputs = 0..self.graph.nodes[*index].node.outputs().len();
            outputs.into_iter().any(|output| self.keys.output(*index, output) == owner)
        };
        self.graph.nodes.node_indices().find(makes)
    }

    fn warn(&self, index: NodeIndex, problem: Problem) {
        let warning = self.at_node(&self.graph.nodes[index], problem).as_warning();
        self.observer.event(Event::Warning(warning));
    }

    /// The warnings of a node, of the pictures that it has read, and of its inputs: the warnings of all results that its
    /// outputs are made of.
    pub(super) fn warnings_of(
        &self,
        node: &GraphNode,
        owner: Key,
        own: Vec<Problem>,
        of_pictures: &Warnings,
    ) -> Warnings {
        let mut all = Gathered::default();
        let results = lock(&self.warnings.results);
        let wires = node.inputs.iter().filter(|input| matches!(input, Input::Wire { .. }));
        wires.filter_map(|wire| results.get(&self.keys.input(wire))).for_each(|inherited| all.add(inherited));
        let own = own.into_iter().map(|problem| Warning { owner, problem, finder: Finder::Node });
        own.for_each(|warning| all.push(warning));
        all.add(of_pictures);
        all.warnings()
    }

    /// The warnings of all results that a value was made of, each once. The value must have been computed or fetched.
    pub(crate) fn warnings(&self, (node, output): (NodeIndex, usize)) -> Warnings {
        lock(&self.warnings.results).get(&self.keys.output(node, output)).cloned().unwrap_or_default()
    }
}
