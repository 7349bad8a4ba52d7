//! One evaluation of a graph.
use super::demand::At;
use super::files::NodeFiles;
use super::keep::CachePolicy;
use super::known::Known;
use super::limit::Limit;
use super::meter::Meter;
use super::stats::{Ledger, Stored, Work};
use super::warnings::{Found, Gathered, Warnings};
use super::{CancelToken, Event, Keys, MemoryCache, NodeState, NodeStats, Observer, Store, keys, lock};
use crate::diagnostics::{Code, Diagnostic, Problem};
use crate::graph::{Graph, GraphNode, GraphOutput, Input};
use crate::node::{Call, Outputs};
use crate::picture::contained;
use crate::value::{
    Blocks, Cuts, Field, Grid, Key, Material, PictureFields, Piece, SolidMaterial, Stop, Tile, Value, Window,
};
use petgraph::graph::NodeIndex;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Duration;

/// Caches of results between runs.
pub struct Caches {
    /// In memory.
    pub memory: MemoryCache,
    /// The store that outlives the process, if any.
    pub store: Option<Arc<dyn Store>>,
    pub(super) policy: CachePolicy,
}

impl Caches {
    /// Empty caches in front of `store`.
    pub fn new(memory: MemoryCache, store: Option<Box<dyn Store>>) -> Self {
        Self { memory, store: store.map(Arc::from), policy: CachePolicy::default() }
    }
}

/// One evaluation of a graph. Use it inside the thread pool that should do the work.
pub struct Run<'g> {
    pub(super) graph: &'g Graph,
    pub(super) keys: &'g Keys,
    pub(super) caches: &'g Caches,
    pub(super) cancel: &'g CancelToken,
    pub(super) ledger: Ledger,
    pub(super) observer: &'g dyn Observer,
    pub(super) memory: u64,
    pub(super) values: Mutex<HashMap<Key, Value>>,
    pub(super) known: Known,
    pub(super) cuts: Cuts,
    /// Limits the computed pixels if only a part of a picture is computed.
    pub(super) limit: RwLock<Option<Arc<Limit>>>,
    /// CPU time of the running nodes.
    pub(super) meter: Meter,
    /// The picture windows whose demand was checked. The fields are kept alive along with them, so that their
    /// identities are not reused.
    pub(super) bounded: Mutex<HashMap<At, (Field, Window)>>,
    failures: Mutex<Vec<(Key, Problem)>>,
    /// Results put into the store, other than tiles.
    pub(super) stored: Mutex<Vec<(Key, Stored)>>,
    pub(super) warnings: Found,
}

impl<'g> Run<'g> {
    /// Creates a run. Nodes may take `memory` bytes for their computation.
    pub fn new(
        graph: &'g Graph,
        keys: &'g Keys,
        caches: &'g Caches,
        memory: u64,
        cancel: &'g CancelToken,
        observer: &'g dyn Observer,
    ) -> Self {
        Self {
            graph,
            keys,
            caches,
            cancel,
            ledger: Ledger::default(),
            observer,
            memory,
            values: Mutex::default(),
            known: Known::default(),
            cuts: Cuts::default(),
            limit: RwLock::default(),
            meter: Meter::default(),
            bounded: Mutex::default(),
            failures: Mutex::default(),
            stored: Mutex::default(),
            warnings: Found::default(),
        }
    }

    /// The keys of the graph's results.
    pub fn keys(&self) -> &'g Keys {
        self.keys
    }

    /// The limit of computed pixels, if only a part of a picture is computed.
    pub(super) fn limit(&self) -> Option<Arc<Limit>> {
        self.limit.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Fetches an output's value from the caches; returns true if it was found.
    pub(super) fn fetch(&self, node: NodeIndex, output: usize) -> bool {
        let key = self.keys.output(node, output);
        if lock(&self.values).contains_key(&key) {
            return true;
        }
        let memory = &self.caches.memory;
        if let Some((value, warnings)) = memory.objects.get(&key) {
            self.note_warnings(key, &warnings);
            if is_object(&value) {
                self.ledger.add(key, Work { memory: 1, ..Work::default() });
            }
            lock(&self.values).insert(key, value);
            return true;
        }
        let ty = self.graph.nodes[node].outputs[output];
        let Some((value, warnings)) = self.stored_object(key, ty) else { return false };
        self.note_warnings(key, &warnings);
        self.ledger.add(key, Work { disk: 1, ..Work::default() });
        memory.keep(key, value.clone(), warnings);
        lock(&self.values).insert(key, value);
        true
    }

    /// Records a value that needs no work, for the nodes that read it.
    pub(super) fn hand_on(&self, key: Key, value: Value) {
        lock(&self.values).insert(key, value);
    }

    /// Returns true if a value was fetched or computed.
    pub(super) fn is_at_hand(&self, key: Key) -> bool {
        lock(&self.values).contains_key(&key)
    }

    /// Evaluates a node whose inputs are available.
    pub(super) fn make(&self, index: NodeIndex) -> Result<(), Stop> {
        self.cancel.check()?;
        let node = &self.graph.nodes[index];
        let inputs: Vec<Value> = node.inputs.iter().map(|input| self.input(input)).collect();
        let working = self.meter.begin();
        let evaluator = self.evaluator(node, self.keys.output(index, 0), &working);
        let call =
            Call { kind: &node.kind, canvas: &node.canvas, inputs: &inputs, files: &node.files, evaluator: &evaluator };
        let handed_on = keys::no_op_slot(self.graph, node).and_then(|slot| inputs.get(slot)?.convert(node.outputs[0]));
        let files = self.keys.files(index).map(NodeFiles::new);
        // A value that is passed on has the key of the input, so it must be the input itself.
        let outputs = match handed_on {
            Some(_) if node.outputs.len() == 1 => Ok(Outputs::default()),
            _ => match &files {
                Some(files) => files.evaluate(|| node_code(|| node.node.evaluate(&call))),
                None => node_code(|| node.node.evaluate(&call)),
            },
        };
        let first = self.keys.output(index, 0);
        let (own, of_pictures) = evaluator.into_warnings();
        let warnings = self.warnings_of(node, first, own, &of_pictures);
        self.note_warnings(first, &warnings);
        let outputs = outputs?;
        let time = working.time();
        drop(working);
        let mut object = false;
        for (i, spec) in node.node.outputs().iter().enumerate() {
            let key = self.keys.output(index, i);
            let handed_on = handed_on.as_ref().filter(|_| i == 0);
            let Some(value) = handed_on.or_else(|| outputs.take(spec.name, i == 0)) else {
                let message = format!("`{}` did not make its output `{}`", node.kind, spec.name);
                return Err(Problem::new(Code::BadValue, message).help("this is a defect of the node").into());
            };
            object |= is_object(value);
            let made = files.as_ref().filter(|_| handed_on.is_none());
            let supervised = made.map(|files| files.supervise(value));
            self.keep(key, keyed(supervised.as_ref().unwrap_or(value), key), &warnings, time);
        }
        self.caches.policy.made(time);
        let work = Work { time, computed: u64::from(object), ..Work::default() };
        self.ledger.add(self.keys.output(index, 0), work);
        if object {
            self.observer.event(Event::Node { name: node.name.clone(), done: 1, total: 1 });
        }
        Ok(())
    }

    /// Drops values of other graphs from memory if there are too many.
    pub fn relieve(&self) {
        let values = lock(&self.values);
        self.caches.memory.relieve(|key| values.contains_key(key));
    }

    fn keep(&self, key: Key, value: Value, warnings: &Warnings, time: Duration) {
        self.note_warnings(key, warnings);
        self.keep_object(key, &value, warnings, time);
        self.caches.memory.keep(key, value.clone(), Arc::clone(warnings));
        lock(&self.values).insert(key, value);
    }

    fn input(&self, input: &Input) -> Value {
        match input {
            Input::Constant(field) => Value::Field(field.clone()),
            Input::Wire { .. } => match lock(&self.values).get(&self.keys.input(input)) {
                Some(value) => value.clone(),
                // Unreachable, since the schedule runs a node after its inputs. A constant avoids a panic.
                None => Value::Field(Field::constant(crate::value::Type::Gray, &[0.0])),
            },
        }
    }

    /// Computes the values of `field` in `window` on all threads.
    ///
    /// # Errors
    /// As the field's code reports.
    pub fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
        self.picture(field, grid, window).map(|(tile, _)| tile)
    }

    /// The same, with the warnings about the values and about those that they were made of.
    pub(crate) fn picture(&self, field: &Field, grid: &Grid, window: Window) -> Result<(Tile, Warnings), Stop> {
        let out = Mutex::new(Tile::new(*grid, window, field.channels()));
        let warnings = self.blocks(field, grid, window, |part| lock(&out).copy_from(part, 0, 0))?;
        Ok((out.into_inner().unwrap_or_else(PoisonError::into_inner), warnings))
    }

    /// Computes the same values into `out`, row by row from the top, with the channels of a pixel interleaved. The
    /// length of `out` must match exactly.
    ///
    /// # Errors
    /// As the field's code reports. The content of `out` is then unspecified.
    pub fn raster_into(&self, field: &Field, grid: &Grid, window: Window, out: &mut [f32]) -> Result<(), Stop> {
        let out = Mutex::new(out);
        self.blocks(field, grid, window, |part| part.interleave(window, &mut lock(&out))).map(drop)
    }

    /// Computes the parts of a window on all threads and passes each to `take`. Returns the warnings about their values.
    fn blocks(
        &self,
        field: &Field,
        grid: &Grid,
        window: Window,
        take: impl Fn(&Tile) + Sync,
    ) -> Result<Warnings, Stop> {
        self.check_bounds(field, grid, window)?;
        self.prepare(field, grid)?;
        let owner = field.owner().or(field.key()).unwrap_or_else(|| Key::of("raster", &[]));
        let blocks: Vec<Window> = Blocks::endless(window).iter().map(|(x, y)| Piece::window(x, y)).collect();
        let found = Mutex::new(Gathered::default());
        // Each part is freed right after `take`.
        let done = blocks.par_iter().try_for_each(|block| {
            let part = self.read(field, grid, block.intersection(&window), owner)?;
            take(&part.tile);
            if !part.warnings.is_empty() {
                lock(&found).add(&part.warnings);
            }
            Ok(())
        });
        let found = lock(&found).warnings();
        self.note_values(&found);
        done.map(|()| found)
    }

    pub(super) fn failed(&self, owner: Key, problem: &Problem) {
        lock(&self.failures).push((owner, problem.clone()));
    }

    /// Runs code of a field. Records a failure for the result `owner`.
    pub(super) fn of_owner<T>(&self, owner: Option<Key>, code: impl FnOnce() -> Result<T, Stop>) -> Result<T, Stop> {
        node_code(code).inspect_err(|stop| {
            if let (Stop::Failed(problem), Some(owner)) = (stop, owner) {
                self.failed(owner, problem);
            }
        })
    }

    /// True if the work was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// The diagnostic for a failure of field work, at the node that caused it; `None` if the work was cancelled.
    pub fn diagnose(&self, stop: Stop, fallback: crate::diagnostics::Span) -> Option<Diagnostic> {
        let Stop::Failed(problem) = stop else { return None };
        let failures = lock(&self.failures);
        // The thread that fails first is random, so report the first failed node in graph order.
        let nodes = self.graph.nodes.node_indices();
        let found = nodes.filter_map(|index| {
            let outputs = 0..self.graph.nodes[index].node.outputs().len();
            let keys: Vec<Key> = outputs.map(|output| self.keys.output(index, output)).collect();
            let (_, problem) = failures.iter().find(|(key, _)| keys.contains(key))?;
            Some(self.at_node(&self.graph.nodes[index], problem.clone()))
        });
        Some(found.min_by_key(|d| d.span).unwrap_or_else(|| Diagnostic::from_problem(*problem, fallback)))
    }

    pub(super) fn at_node(&self, node: &GraphNode, problem: Problem) -> Diagnostic {
        let span = match problem.code {
            Code::TooLarge if problem.field.is_none() => self.graph.canvas_span,
            _ => node.field_span(problem.field.as_deref()),
        };
        Diagnostic::from_problem(problem, span)
    }

    pub(super) fn locate(&self, node: NodeIndex, stop: Stop) -> Option<Diagnostic> {
        match stop {
            Stop::Cancelled => None,
            Stop::Failed(problem) => {
                if lock(&self.failures).is_empty() {
                    Some(self.at_node(&self.graph.nodes[node], *problem))
                } else {
                    self.diagnose(Stop::Failed(problem), self.graph.nodes[node].span)
                }
            }
        }
    }

    /// The CPU time of all node code so far.
    pub fn spent(&self) -> Duration {
        self.ledger.spent()
    }

    /// The work done for each node, in the order of the graph.
    pub fn stats(&self) -> Vec<NodeStats> {
        self.stats_for(&self.graph.outputs)
    }

    /// The work done for each node when only these outputs of the graph are requested.
    pub fn stats_for<'o>(&self, outputs: impl IntoIterator<Item = &'o GraphOutput>) -> Vec<NodeStats> {
        let needed = self.graph.needed_by(outputs);
        self.graph.nodes.node_indices().map(|index| self.node_stats(index, needed[index.index()])).collect()
    }

    fn node_stats(&self, index: NodeIndex, needed: bool) -> NodeStats {
        let node = &self.graph.nodes[index];
        // A value that a node only passes on is the work of another node.
        let own = usize::from(keys::no_op_slot(self.graph, node).is_some())..node.node.outputs().len();
        let mut work = Work::default();
        own.for_each(|output| work.add(self.ledger.get(self.keys.output(index, output))));
        let state = match work {
            Work { computed: 1.., .. } => NodeState::Computed,
            Work { disk: 1.., .. } => NodeState::Disk,
            Work { memory: 1.., .. } => NodeState::Memory,
            _ if needed => NodeState::Folded,
            _ => NodeState::Unused,
        };
        let tiles = if node.outputs.iter().any(|ty| ty.is_field()) { work.computed } else { 0 };
        let (name, kind, pixels) = (node.name.clone(), node.kind.clone(), work.pixels);
        NodeStats { name, kind, state, seconds: work.time.as_secs_f64(), tiles, pixels }
    }
}

/// Runs code of a node. A panic is a defect of the node: it is reported there and stops nothing else.
pub(super) fn node_code<T>(code: impl FnOnce() -> Result<T, Stop>) -> Result<T, Stop> {
    contained(code).unwrap_or_else(|said| Err(defect(&said).into()))
}

/// The problem that reports a panic.
pub(crate) fn defect(said: &str) -> Problem {
    let problem = Problem::new(Code::BadValue, format!("this cannot be computed, because of a defect: {said}"));
    problem.help("please report it with the graph; other values may avoid it")
}

/// Returns true if a value is data, computed when its node is evaluated.
fn is_object(value: &Value) -> bool {
    value.handle().is_some()
}

/// Gives the fields of a new value their keys.
fn keyed(value: &Value, key: Key) -> Value {
    let part = |field: &Field, name: &str| match field.key() {
        Some(_) => field.clone(),
        None => field.clone().keyed(Key::of("part", &[key.as_bytes(), name.as_bytes()])).owned_by(key),
    };
    match value {
        Value::Field(field) => Value::Field(field.clone().keyed(key)),
        Value::Picture(picture) => Value::Picture(Arc::new(PictureFields {
            gray: part(&picture.gray, "gray"),
            rgb: picture.rgb.clone().keyed(key),
            is_gray: picture.is_gray,
        })),
        Value::Material(material) => Value::Material(Arc::new(Material::new(
            material.channels().iter().map(|(channel, field)| (*channel, part(field, channel.name()))),
        ))),
        Value::Solid(solid) => Value::Solid(solid.clone().keyed(key)),
        Value::SolidMaterial(material) => {
            let channels = material.channels().iter().map(|(channel, solid)| {
                let part = Key::of("part", &[key.as_bytes(), channel.name().as_bytes()]);
                let solid = if solid.key().is_some() { solid.clone() } else { solid.clone().keyed(part).owned_by(key) };
                (*channel, solid)
            });
            Value::SolidMaterial(Arc::new(SolidMaterial::new(channels)))
        }
        value => value.clone(),
    }
}
