//! Evaluates an output with some of its upstream outputs replaced by other values.
use petgraph::graph::NodeIndex;
use shibo_engine::session::{Failure, Look};
use shibo_graph::{Graph, GraphNode, Input};
use shibo_node::Call;
use shibo_value::diagnostics::{Code, Diagnostic, Problem};
use shibo_value::{Evaluator, Field, Grid, Key, Material, Stop, Tile, Value, Window};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Memory that a node may use, in bytes.
const MEMORY: u64 = 256 << 20;

/// The engine as seen by a node that is evaluated here.
struct Through<'a, 'r> {
    look: &'a Look<'r>,
    key: Key,
}

impl Evaluator for Through<'_, '_> {
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
        self.look.raster(field, grid, window).map_err(|failure| match failure {
            Failure::Cancelled => Stop::Cancelled,
            failure => Problem::new(Code::BadValue, failure.to_string()).into(),
        })
    }

    fn check(&self) -> Result<(), Stop> {
        if self.look.is_over() { Err(Stop::Cancelled) } else { Ok(()) }
    }

    fn progress(&self, _done: u64, _total: u64) {}

    fn memory(&self) -> u64 {
        MEMORY
    }

    fn key(&self) -> Option<Key> {
        Some(self.key)
    }

    fn warn(&self, _problem: Problem) {}
}

/// Returns the value of an output when upstream outputs are replaced by `others`; `None` if it depends on none of them.
/// `name` identifies the replacement values, and `keys` returns the original key of a node's output.
///
/// # Errors
/// Fails if evaluating a node fails.
pub fn instead(
    look: &Look<'_>,
    graph: &Graph,
    keys: &dyn Fn(NodeIndex, usize) -> Key,
    at: (NodeIndex, usize),
    (others, name): (&HashMap<(NodeIndex, usize), Value>, Key),
) -> Result<Option<Value>, Failure> {
    let mut made = others.clone();
    for index in before(graph, at.0) {
        let node = &graph.nodes[index];
        let other = |input: &Input| match input {
            Input::Wire { node, output } => made.get(&(*node, *output)).cloned(),
            Input::Constant(_) => None,
        };
        let found: Vec<Option<Value>> = node.inputs.iter().map(other).collect();
        if found.iter().all(Option::is_none) {
            continue;
        }
        let mut inputs = Vec::with_capacity(found.len());
        for (input, other) in node.inputs.iter().zip(found) {
            let value = match (other, input) {
                (Some(other), _) => Some(other),
                (None, Input::Wire { node, output }) => look.value(*node, *output)?,
                (None, Input::Constant(field)) => Some(Value::Field(field.clone())),
            };
            let Some(value) = value else { return Ok(None) };
            inputs.push(value);
        }
        let key = |output| Key::of("instead", &[keys(index, output).as_bytes(), name.as_bytes()]);
        for (i, value) in evaluated(look, node, &inputs, &key)?.into_iter().enumerate() {
            if let Some(value) = value {
                made.entry((index, i)).or_insert(value);
            }
        }
    }
    Ok(made.remove(&at))
}

/// The outputs of a node with other inputs. `key` gives the keys of the outputs.
///
/// # Errors
/// Fails if evaluating the node fails.
pub fn evaluated(
    look: &Look<'_>,
    node: &GraphNode,
    inputs: &[Value],
    key: &dyn Fn(usize) -> Key,
) -> Result<Vec<Option<Value>>, Failure> {
    let evaluator = Through { look, key: key(0) };
    let (canvas, files) = (&node.canvas, &node.files);
    let call = Call { kind: &node.kind, canvas, inputs, files, evaluator: &evaluator };
    let outputs = node.node.evaluate(&call).map_err(|stop| failed(node, stop))?;
    let specs = node.node.outputs().iter().enumerate();
    Ok(specs.map(|(i, spec)| outputs.take(spec.name, i == 0).map(|value| keyed(value, key(i)))).collect())
}

fn failed(node: &GraphNode, stop: Stop) -> Failure {
    match stop {
        Stop::Failed(problem) => {
            let span = node.field_span(problem.field.as_deref());
            Failure::Errors(vec![Diagnostic::new(problem.code, span, problem.message.clone())])
        }
        Stop::Cancelled => Failure::Cancelled,
    }
}

/// Gives fields a key, so that equal fields are computed once.
fn keyed(value: &Value, key: Key) -> Value {
    match value {
        Value::Field(field) => Value::Field(field.clone().keyed(key)),
        Value::Material(material) => {
            Value::Material(Arc::new(Material::new(material.channels().iter().map(|(channel, field)| {
                (*channel, field.clone().keyed(Key::of("part", &[key.as_bytes(), channel.name().as_bytes()])))
            }))))
        }
        value => value.clone(),
    }
}

/// A node and all its upstream nodes in topological order, inputs first.
fn before(graph: &Graph, node: NodeIndex) -> Vec<NodeIndex> {
    let (mut order, mut seen) = (Vec::new(), HashSet::new());
    let mut stack = vec![(node, false)];
    while let Some((index, done)) = stack.pop() {
        if done {
            order.push(index);
        } else if seen.insert(index) {
            stack.push((index, true));
            let wired = |input: &Input| match input {
                Input::Wire { node, .. } => Some((*node, false)),
                Input::Constant(_) => None,
            };
            stack.extend(graph.nodes[index].inputs.iter().filter_map(wired));
        }
    }
    order
}
