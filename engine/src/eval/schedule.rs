//! Schedules nodes: keeps a list of nodes whose inputs are available, processed by all threads.
//!
//! A node is put on the list when its last input is done, so a slow node delays only the nodes that need it. There is
//! no recursion over the graph.
use super::keys::no_op_slot;
use super::lock;
use super::run::Run;
use crate::diagnostics::Diagnostic;
use crate::graph::Input;
use crate::value::{Stop, Value};
use petgraph::graph::NodeIndex;
use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::Mutex;

impl Run<'_> {
    /// The values of these node outputs, in the same order. Objects are computed; fields are not evaluated yet.
    ///
    /// # Errors
    /// The failures of all nodes that could be tried, each at its place; empty if the run was cancelled.
    pub fn values(&self, wanted: &[(NodeIndex, usize)]) -> Result<Vec<Value>, Vec<Diagnostic>> {
        let missing = self.missing(wanted);
        let failed = if missing.is_empty() { Vec::new() } else { Schedule::new(self, missing).run() };
        if !failed.is_empty() {
            return Err(failed.into_iter().filter_map(|(node, stop)| self.locate(node, stop)).collect());
        }
        let values = lock(&self.values);
        Ok(wanted.iter().filter_map(|&(node, output)| values.get(&self.keys.output(node, output)).cloned()).collect())
    }

    /// The nodes that must be computed to get `wanted`, after looking into the caches.
    fn missing(&self, wanted: &[(NodeIndex, usize)]) -> Vec<NodeIndex> {
        let mut open: Vec<_> = wanted.iter().map(|output| self.origin(*output)).collect();
        let mut missing = Vec::new();
        let (mut seen, mut listed) = (HashSet::new(), HashSet::new());
        while let Some((node, output)) = open.pop() {
            if !seen.insert((node, output)) || self.fetch(node, output) || self.is_literal(node, output) {
                continue;
            }
            if listed.insert(node) {
                missing.push(node);
                open.extend(self.graph.nodes[node].inputs.iter().filter_map(wire).map(|output| self.origin(output)));
            }
        }
        missing
    }

    /// Returns true if a node only passes on a literal as this output. The node is not evaluated then, nor are its
    /// other inputs.
    fn is_literal(&self, node: NodeIndex, output: usize) -> bool {
        let read = &self.graph.nodes[node];
        let slot = (output == 0).then(|| no_op_slot(self.graph, read)).flatten();
        let Some(Input::Constant(field)) = slot.and_then(|slot| read.inputs.get(slot)) else { return false };
        self.hand_on(self.keys.output(node, 0), field.clone().into());
        true
    }

    /// The output that produces a value: further upstream if the node only passes the value on. Such a node is not
    /// evaluated, nor are its other inputs.
    fn origin(&self, output: (NodeIndex, usize)) -> (NodeIndex, usize) {
        let mut at = output;
        while at.1 == 0 {
            let node = &self.graph.nodes[at.0];
            match no_op_slot(self.graph, node).and_then(|slot| wire(node.inputs.get(slot)?)) {
                Some(before) => at = before,
                None => break,
            }
        }
        at
    }
}

fn wire(input: &Input) -> Option<(NodeIndex, usize)> {
    match input {
        Input::Wire { node, output } => Some((*node, *output)),
        Input::Constant(_) => None,
    }
}

/// The nodes to be computed.
struct Schedule<'r, 'g> {
    run: &'r Run<'g>,
    nodes: Vec<NodeIndex>,
    /// For each node, the indices of its readers.
    readers: Vec<Vec<usize>>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// For each node, the number of inputs that are not done yet.
    waits_for: Vec<usize>,
    ready: VecDeque<usize>,
    /// Number of threads that take nodes from the list.
    workers: usize,
    failed: Vec<(NodeIndex, Stop)>,
    cancelled: bool,
}

impl<'r, 'g> Schedule<'r, 'g> {
    fn new(run: &'r Run<'g>, nodes: Vec<NodeIndex>) -> Self {
        let places: HashMap<NodeIndex, usize> = nodes.iter().enumerate().map(|(place, node)| (*node, place)).collect();
        let mut readers = vec![Vec::new(); nodes.len()];
        let mut waits_for = vec![0; nodes.len()];
        for (reader, node) in nodes.iter().enumerate() {
            let read = run.graph.nodes[*node].inputs.iter().filter_map(wire).map(|output| run.origin(output));
            // Do not wait for an output that was found in the caches, even if another output of the same node must be
            // computed.
            let read = read.filter(|(node, output)| !run.is_at_hand(run.keys.output(*node, *output)));
            let before: HashSet<usize> = read.filter_map(|(node, _)| places.get(&node).copied()).collect();
            waits_for[reader] = before.len();
            #[expect(clippy::iter_over_hash_type, reason = "each of another list, so their order does not matter")]
            for place in before {
                readers[place].push(reader);
            }
        }
        let ready = (0..nodes.len()).filter(|place| waits_for[*place] == 0).collect();
        Self { run, nodes, readers, state: Mutex::new(State { waits_for, ready, ..State::default() }) }
    }

    /// Computes all nodes that can be computed; returns the failures.
    fn run(self) -> Vec<(NodeIndex, Stop)> {
        lock(&self.state).workers = 1;
        rayon::scope(|scope| self.work(scope));
        let state = self.state.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        if state.cancelled {
            return state.failed.into_iter().filter(|(_, stop)| *stop == Stop::Cancelled).take(1).collect();
        }
        state.failed
    }

    /// Takes nodes from the list until it is empty; starts more workers if more than one node is ready.
    fn work<'s>(&'s self, scope: &rayon::Scope<'s>) {
        while let Some((place, more)) = self.take() {
            (0..more).for_each(|_| scope.spawn(|scope| self.work(scope)));
            let result = self.run.make(self.nodes[place]);
            let mut state = lock(&self.state);
            match result {
                Ok(()) => {
                    for reader in &self.readers[place] {
                        state.waits_for[*reader] -= 1;
                        if state.waits_for[*reader] == 0 {
                            state.ready.push_back(*reader);
                        }
                    }
                }
                Err(stop) => {
                    state.cancelled |= stop == Stop::Cancelled;
                    state.failed.push((self.nodes[place], stop));
                }
            }
        }
    }

    /// The next node, and the number of additional workers that have work.
    fn take(&self) -> Option<(usize, usize)> {
        let mut state = lock(&self.state);
        let next = if state.cancelled { None } else { state.ready.pop_front() };
        let Some(place) = next else {
            state.workers -= 1;
            return None;
        };
        let more = state.ready.len().min(rayon::current_num_threads().saturating_sub(state.workers));
        state.workers += more;
        Some((place, more))
    }
}
