//! The keys of all results, derived without computing them.
use super::files::KeyedFile;
use crate::diagnostics::{Code, Diagnostic};
use crate::graph::{Graph, GraphNode, Input};
use crate::node::Fact;
use crate::picture::udim_file;
use crate::value::{Canvas, Key};
use petgraph::graph::NodeIndex;
use petgraph::visit::Topo;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Version of the key derivation. The same graph has the same keys
/// in every build, and pictures contain them. The seal of entries ([`Seal`](super::Seal)) keeps the results of
/// different builds apart.
const DOMAIN: &str = "shibo 2";

/// The keys of the outputs of every node of a graph.
#[derive(Debug, Default)]
pub struct Keys {
    outputs: Vec<Vec<Key>>,
    order: Vec<NodeIndex>,
    /// The files of the nodes that read files.
    files: BTreeMap<NodeIndex, Arc<[KeyedFile]>>,
}

impl Keys {
    /// Derives the keys of all nodes. Reads the files that nodes name and hashes their content.
    ///
    /// # Errors
    /// A file that cannot be read, reported at the parameter that names it.
    pub fn of(graph: &Graph) -> Result<Self, Vec<Diagnostic>> {
        let mut keys = Self { outputs: vec![Vec::new(); graph.nodes.node_count()], ..Self::default() };
        let mut errors = Vec::new();
        let mut topo = Topo::new(&graph.nodes);
        while let Some(index) = topo.next(&graph.nodes) {
            let node = &graph.nodes[index];
            let files = keyed_files(node).unwrap_or_else(|e| {
                errors.extend(e);
                Vec::new()
            });
            let outputs = keys.node(graph, node, &files);
            keys.outputs[index.index()] = outputs;
            keys.order.push(index);
            if !files.is_empty() {
                keys.files.insert(index, files.into());
            }
        }
        if errors.is_empty() { Ok(keys) } else { Err(errors) }
    }

    fn node(&self, graph: &Graph, node: &GraphNode, files: &[KeyedFile]) -> Vec<Key> {
        let inputs: Vec<Key> = node.inputs.iter().map(|input| self.input(input)).collect();
        let facts = facts(&node.canvas, node.node.facts());
        let (params, version) = (node.node.canonical(), node.node.version().to_le_bytes());
        let mut parts: Vec<&[u8]> = vec![node.kind.as_bytes(), &version, &params, &facts];
        for (key, port) in inputs.iter().zip(&node.slots) {
            parts.push(port.as_bytes());
            parts.push(key.as_bytes());
        }
        // In a set of UDIM files, the key depends on the tile number of each file.
        let tiles: Vec<Option<[u8; 4]>> = files.iter().map(|file| tile(node, file)).collect();
        for (file, tile) in files.iter().zip(&tiles) {
            parts.push(file.hash());
            parts.extend(tile.as_ref().map(<[u8; 4]>::as_slice));
        }
        let key = Key::of(DOMAIN, &parts);
        let output = |name: &str| Key::of("output", &[key.as_bytes(), name.as_bytes()]);
        let mut outputs: Vec<Key> = node.node.outputs().iter().map(|o| output(o.former.unwrap_or(o.name))).collect();
        if let (Some(slot), Some(main)) = (no_op_slot(graph, node), outputs.first_mut()) {
            *main = inputs[slot];
        }
        outputs
    }

    /// The key of a slot's input.
    pub fn input(&self, input: &Input) -> Key {
        match input {
            Input::Wire { node, output } => self.output(*node, *output),
            Input::Constant(field) => field.key().unwrap_or_else(|| Key::of("constant", &[])),
        }
    }

    /// The key of an output of a node.
    pub fn output(&self, node: NodeIndex, output: usize) -> Key {
        self.outputs[node.index()][output]
    }

    /// The files of a node, if it reads any.
    pub(super) fn files(&self, node: NodeIndex) -> Option<Arc<[KeyedFile]>> {
        self.files.get(&node).cloned()
    }

    /// The files that a node reads, with the hashes of their content.
    pub fn read_files(&self, node: NodeIndex) -> impl Iterator<Item = (&Path, &[u8; 32])> {
        self.files.get(&node).into_iter().flat_map(|files| files.iter().map(|file| (file.file().path(), file.hash())))
    }

    /// All nodes, each after its inputs.
    pub fn order(&self) -> &[NodeIndex] {
        &self.order
    }
}

/// The slot whose value a node passes on unchanged as its main output, if any. A picture converted to a field is a
/// different value with its own key.
pub(super) fn no_op_slot(graph: &Graph, node: &GraphNode) -> Option<usize> {
    let port = node.node.no_op()?;
    let mut slots = node.slots.iter().enumerate().filter(|(_, name)| *name == port);
    let (slot, _) = slots.nth(node.node.no_op_item())?;
    let ty = match node.inputs.get(slot)? {
        Input::Wire { node, output } => *graph.nodes[*node].outputs.get(*output)?,
        Input::Constant(field) => field.ty(),
    };
    (node.outputs.first() == Some(&ty)).then_some(slot)
}

fn facts(canvas: &Canvas, wanted: &[Fact]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for fact in wanted {
        match fact {
            Fact::Size => bytes.extend(canvas.size_mm.to_array().iter().flat_map(|v| v.to_bits().to_le_bytes())),
            Fact::Tile => bytes.extend([u8::from(canvas.tile.x), u8::from(canvas.tile.y)]),
            Fact::Seed => bytes.extend(canvas.seed.to_le_bytes()),
        }
    }
    bytes
}

/// The UDIM tile number of a file.
fn tile(node: &GraphNode, file: &KeyedFile) -> Option<[u8; 4]> {
    let (_, set) = node.node.files().into_iter().find(|(field, _)| *field == file.field())?;
    Some(udim_file(Path::new(&set.0), file.file().path())?.number.to_le_bytes())
}

fn keyed_files(node: &GraphNode) -> Result<Vec<KeyedFile>, Vec<Diagnostic>> {
    let mut errors = Vec::new();
    let mut files = Vec::new();
    for (field, file) in &node.files {
        match KeyedFile::read(field, file) {
            Ok(file) => files.push(file),
            Err(e) => {
                let message = format!("cannot read `{}`: {e}", file.display());
                errors.push(Diagnostic::new(Code::BadFile, node.field_span(Some(field)), message));
            }
        }
    }
    if errors.is_empty() { Ok(files) } else { Err(errors) }
}
