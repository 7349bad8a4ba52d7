//! A graph with resolved references, ready for evaluation.
use super::storage::Storage;
use crate::diagnostics::{Diagnostic, SourceMap, Span};
use crate::export::{Chosen, SimpleShape};
use crate::node::DynNode;
use crate::value::files::FileHandle;
use crate::value::{Canvas, ChannelSet, Field, Type};
use petgraph::Direction;
use petgraph::graph::{DiGraph, NodeIndex};
use std::path::PathBuf;
use std::sync::Arc;

/// A checked graph: every reference is resolved, every parameter is in range, and there are no cycles.
pub struct Graph {
    /// The graph file.
    pub path: PathBuf,
    /// The family of its material, such as `stone`, if the file names one.
    pub family: Option<String>,
    /// The texts that spans point into: the graph file and all that it imports.
    pub sources: SourceMap,
    /// The canvas, with the caller's changes.
    pub canvas: Canvas,
    /// The nodes of the file and of all used sub-graphs. An edge goes from a node to its reader.
    pub nodes: DiGraph<GraphNode, ()>,
    /// The used sub-graphs, including nested ones.
    pub uses: Vec<GraphUse>,
    /// The outputs that can be rendered, in the order of the file.
    pub outputs: Vec<GraphOutput>,
    /// The parameters with their current values.
    pub params: Vec<GraphParam>,
    /// The names of the presets.
    pub presets: Vec<String>,
    /// Warnings; a graph with errors does not exist.
    pub warnings: Vec<Diagnostic>,
    /// The place of `canvas`, for problems with the picture's size.
    pub canvas_span: Span,
    /// The imports of all graph files: the place in the text, and the imported file.
    pub imports: Vec<(Span, PathBuf)>,
    /// The formulas that call a function of a shipped graph, directly or by way of other functions: the place, and that graph.
    pub calls: Vec<(Span, PathBuf)>,
}

impl Graph {
    /// For each node, true if an output depends on its values or on the mesh it makes.
    pub fn needed(&self) -> Vec<bool> {
        self.needed_by(&self.outputs)
    }

    /// For each node, true if one of these outputs depends on it.
    pub fn needed_by<'o>(&self, outputs: impl IntoIterator<Item = &'o GraphOutput>) -> Vec<bool> {
        let mut needed = vec![false; self.nodes.node_count()];
        let mut waiting: Vec<NodeIndex> = Vec::new();
        for output in outputs {
            waiting.push(output.node);
            if let Some(ExportMesh::Atlas { node, .. }) = output.mesh {
                waiting.push(node);
            }
            let fields = output.export.iter().flat_map(|export| &export.fields);
            waiting.extend(fields.map(|(_, (node, _))| *node));
        }
        while let Some(index) = waiting.pop() {
            if !std::mem::replace(&mut needed[index.index()], true) {
                waiting.extend(self.nodes.neighbors_directed(index, Direction::Incoming));
            }
        }
        needed
    }
}

/// The use of a sub-graph.
#[derive(Clone, Debug)]
pub struct GraphUse {
    /// Its name; `use/inner` for nested uses.
    pub name: String,
    /// The file of the sub-graph.
    pub path: PathBuf,
    /// Its outputs, the main one first: name, node, and the index of the node's output. Omits literals, and outputs
    /// that no layout node was made for.
    pub outputs: Vec<(String, NodeIndex, usize)>,
}

/// A node of a graph.
pub struct GraphNode {
    /// Its name; `use/inner` for nodes of a sub-graph.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// The node itself.
    pub node: Arc<dyn DynNode>,
    /// The canvas of the node: an instance may have its own seed, and a larger canvas.
    pub canvas: Canvas,
    /// The inputs of its slots.
    pub inputs: Vec<Input>,
    /// For each slot, the name of its port.
    pub slots: Vec<String>,
    /// The types of its outputs, in the order of [`DynNode::outputs`].
    pub outputs: Vec<Type>,
    /// Its files, with the parameter that names each.
    pub files: Vec<(&'static str, FileHandle)>,
    /// The channels of the node's material; empty if it makes none.
    pub channels: ChannelSet,
    /// The place of its kind.
    pub span: Span,
    /// The places of its field values.
    pub fields: Vec<(String, Span)>,
}

impl GraphNode {
    /// The place of a field's value, or of the kind if the field is not written.
    pub fn field_span(&self, field: Option<&str>) -> Span {
        let written = field.and_then(|field| self.fields.iter().find(|(name, _)| name == field));
        written.map_or(self.span, |(_, span)| *span)
    }
}

/// The input of a slot.
#[derive(Clone, Debug)]
pub enum Input {
    /// An output of another node.
    Wire {
        /// The node.
        node: NodeIndex,
        /// Index of the output.
        output: usize,
    },
    /// A literal.
    Constant(Field),
}

/// An output that can be rendered.
#[derive(Clone, Debug)]
pub struct GraphOutput {
    /// The name of the file, without extension.
    pub name: String,
    /// The node that computes the output.
    pub node: NodeIndex,
    /// Index of the node's output.
    pub output: usize,
    /// Type of the output.
    pub ty: Type,
    /// The file format, if stated: `Png`, `Tiff` or `Exr`.
    pub format: Option<crate::picture::Format>,
    /// The sample type, if stated.
    pub depth: Option<crate::picture::Depth>,
    /// The channels of a material go into one file; only in `Exr`.
    pub combined: bool,
    /// The values mapped to the smallest and the largest integer, if stated.
    pub range: Option<(f64, f64)>,
    /// Other options for stored pictures.
    pub storage: Storage,
    /// The export, if the output is not written as pictures.
    pub export: Option<Export>,
    /// The mesh that shows the material in an export that has one.
    pub mesh: Option<ExportMesh>,
    /// The place in the text.
    pub span: Span,
}

impl GraphOutput {
    /// True if the output shows the canvas. A mesh does not, so it need not tile.
    pub(super) fn is_on_canvas(&self) -> bool {
        self.export.as_ref().is_none_or(|export| !export.target.target.info().has_body())
    }

    /// The value of a node's output, written with default options.
    pub fn plain(name: String, (node, output): (NodeIndex, usize), ty: Type, span: Span) -> Self {
        Self {
            name,
            node,
            output,
            ty,
            format: None,
            depth: None,
            combined: false,
            range: None,
            storage: Storage::default(),
            export: None,
            mesh: None,
            span,
        }
    }
}

/// Files for another program.
#[derive(Clone, Debug)]
pub struct Export {
    /// The format with its options.
    pub target: Chosen,
    /// The fields that it takes besides the output's material, by the names of the target's fields: node, and index of
    /// the node's output.
    pub fields: Vec<(&'static str, (NodeIndex, usize))>,
    /// The places of the values that are written, by the names of the target's fields.
    pub places: Vec<(&'static str, Span)>,
}

impl Graph {
    /// Exports the materials of all outputs and drops all other outputs. A material with two names is exported once,
    /// unless outputs are `named`. The files use the mesh of the graph's own exports, if there is one.
    ///
    /// # Errors
    /// A remedy if no output is a material.
    pub fn export_as(&mut self, target: &Chosen, named: bool) -> Result<(), String> {
        let plane = ExportMesh::Simple(SimpleShape::Plane);
        let mesh = self.outputs.iter().find_map(|output| output.mesh.filter(|mesh| *mesh != plane));
        let mesh = target.target.info().has_mesh().then(|| mesh.unwrap_or(plane));
        self.outputs.retain(|output| output.ty == Type::Material);
        let mut seen = Vec::new();
        self.outputs.retain(|output| {
            let source = (output.node, output.output);
            let new = !seen.contains(&source);
            seen.push(source);
            new || named
        });
        if self.outputs.is_empty() {
            return Err("the graph has no output that is a material; connect a `Material` to an output".to_owned());
        }
        for output in &mut self.outputs {
            let export = Export { target: target.clone(), fields: Vec::new(), places: Vec::new() };
            (output.export, output.mesh, output.combined) = (Some(export), mesh, false);
        }
        Ok(())
    }
}

/// The mesh of an exported file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportMesh {
    /// A simple shape without a mesh input.
    Simple(SimpleShape),
    /// The mesh of an atlas.
    Atlas {
        /// The node of the atlas.
        node: NodeIndex,
        /// Index of the node's output.
        output: usize,
    },
}

impl ExportMesh {
    /// Returns true if the textures cover the mesh once, without tiling, as with an atlas.
    pub const fn is_atlas(self) -> bool {
        matches!(self, Self::Atlas { .. })
    }
}

/// A parameter of a graph with its current value.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphParam {
    /// Its name.
    pub name: String,
    /// `Number`, `Integer`, `Bool`, `Color`, `Text`, `Path` or `Choice`.
    pub ty: &'static str,
    /// The current value, as RON.
    pub value: String,
    /// The default, as RON.
    pub default: String,
    /// The smallest and largest number allowed.
    pub range: Option<(f64, f64)>,
    /// The unit to display.
    pub unit: Option<String>,
    /// The heading under which views show the parameter.
    pub group: Option<String>,
    /// Description.
    pub doc: String,
    /// The possible words of a `Choice`.
    pub options: Vec<String>,
    /// The place of the default.
    pub span: Span,
}
