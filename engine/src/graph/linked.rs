//! A graph whose references are resolved: what is evaluated.
use super::storage::Storage;
use crate::diagnostics::{Diagnostic, SourceMap, Span};
use crate::export::{Colors, Program, Shading, SimpleShape};
use crate::node::DynNode;
use crate::value::{Canvas, ChannelSet, Field, Type};
use petgraph::Direction;
use petgraph::graph::{DiGraph, NodeIndex};
use std::path::PathBuf;
use std::sync::Arc;

/// A checked graph: every reference is resolved, every parameter is in range, and there are no cycles.
pub struct Graph {
    /// The graph file.
    pub path: PathBuf,
    /// The texts that spans point into: the graph file and all that it imports.
    pub sources: SourceMap,
    /// The canvas, with what the caller changed of it.
    pub canvas: Canvas,
    /// The nodes of the file and of all sub-graphs in use. An edge goes from a node to one that reads it.
    pub nodes: DiGraph<GraphNode, ()>,
    /// The sub-graphs in use, those inside of others included.
    pub uses: Vec<GraphUse>,
    /// What can be rendered, in the order of the file.
    pub outputs: Vec<GraphOutput>,
    /// The parameters with the values in force.
    pub params: Vec<GraphParam>,
    /// The names of the presets.
    pub presets: Vec<String>,
    /// Advice; errors would have left no graph.
    pub warnings: Vec<Diagnostic>,
    /// Where `canvas` is written, for problems of the picture's size.
    pub canvas_span: Span,
    /// The imports of all graph files: the place in the text, and the file that is meant.
    pub imports: Vec<(Span, PathBuf)>,
}

impl Graph {
    /// For each node whether an output depends on it: on its values, or on the mesh that it makes.
    pub fn needed(&self) -> Vec<bool> {
        self.needed_by(&self.outputs)
    }

    /// The same of some outputs.
    pub fn needed_by<'o>(&self, outputs: impl IntoIterator<Item = &'o GraphOutput>) -> Vec<bool> {
        let mut needed = vec![false; self.nodes.node_count()];
        let mut waiting: Vec<NodeIndex> = Vec::new();
        for output in outputs {
            waiting.push(output.node);
            if let Some(ExportMesh::Atlas { node, .. }) = output.mesh {
                waiting.push(node);
            }
            if let Some(Export::Pack(sources)) = output.export {
                waiting.extend(sources.into_iter().flatten().map(|(node, _)| node));
            }
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
    /// Its name; those inside of another one are `use/inner`.
    pub name: String,
    /// The file of the sub-graph.
    pub path: PathBuf,
    /// Its outputs, the main one first: the name, the node, and which output of that. One that is a literal, or that an
    /// instance is not laid out for, is left out.
    pub outputs: Vec<(String, NodeIndex, usize)>,
}

/// A node of a graph.
pub struct GraphNode {
    /// Its name; nodes inside a sub-graph are `use/inner`.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// The node itself.
    pub node: Arc<dyn DynNode>,
    /// The canvas that it works on: an instance may have a seed of its own, and a larger canvas.
    pub canvas: Canvas,
    /// What goes into its slots.
    pub inputs: Vec<Input>,
    /// For each slot, the name of the port it belongs to.
    pub slots: Vec<String>,
    /// The types of its outputs, in the order of [`DynNode::outputs`].
    pub outputs: Vec<Type>,
    /// Its files: the parameter that names each, and the path.
    pub files: Vec<(&'static str, PathBuf)>,
    /// The channels of the material that it makes; none, if it makes none.
    pub channels: ChannelSet,
    /// Where its kind is written.
    pub span: Span,
    /// Where the values of its fields are written.
    pub fields: Vec<(String, Span)>,
}

impl GraphNode {
    /// Where the value of a field is written; the kind, if it is not.
    pub fn field_span(&self, field: Option<&str>) -> Span {
        let written = field.and_then(|field| self.fields.iter().find(|(name, _)| name == field));
        written.map_or(self.span, |(_, span)| *span)
    }
}

/// What goes into a slot.
#[derive(Clone, Debug)]
pub enum Input {
    /// An output of another node.
    Wire {
        /// The node.
        node: NodeIndex,
        /// Which of its outputs.
        output: usize,
    },
    /// A literal.
    Constant(Field),
}

/// Something that can be rendered.
#[derive(Clone, Debug)]
pub struct GraphOutput {
    /// The name of the file, without extension.
    pub name: String,
    /// The node it comes from.
    pub node: NodeIndex,
    /// Which of its outputs.
    pub output: usize,
    /// What it carries.
    pub ty: Type,
    /// The file format, if it is stated: `Png`, `Tiff` or `Exr`.
    pub format: Option<crate::picture::Format>,
    /// The sample type, if it is stated.
    pub depth: Option<crate::picture::Depth>,
    /// Whether the channels of a material go into one file; only in `Exr`.
    pub combined: bool,
    /// The values that become the smallest and the largest integer, if they are stated.
    pub range: Option<(f64, f64)>,
    /// How its pictures are stored besides that.
    pub storage: Storage,
    /// What it is written as, if not as pictures.
    pub export: Option<Export>,
    /// The mesh that wears it, if it is a material in a glTF, an OBJ or a USD file.
    pub mesh: Option<ExportMesh>,
    /// Where it is written.
    pub span: Span,
}

/// Files for other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Export {
    /// A glTF file.
    Gltf {
        /// Whether it is a binary one with all in it; else its mesh and its pictures lie beside it.
        embed: bool,
        /// How its colours are stored.
        colors: Colors,
    },
    /// An OBJ file with its material library and its pictures.
    Obj(Colors),
    /// A MaterialX document with its pictures.
    MaterialX(Shading),
    /// A USD file with its pictures.
    Usd {
        /// Whether all lie in one file, a USDZ.
        packed: bool,
        /// How its colours are stored.
        colors: Colors,
    },
    /// The pictures that a program expects.
    Preset(Program),
    /// One picture: the nodes and outputs of up to four fields.
    Pack([Option<(NodeIndex, usize)>; 4]),
}

impl Export {
    /// What a whole graph can be written as, by the names that users give.
    pub const TARGETS: [(&'static str, Self); 13] = [
        ("gltf", Self::Gltf { embed: true, colors: Colors::Png }),
        ("gltf-files", Self::Gltf { embed: false, colors: Colors::Png }),
        ("obj", Self::Obj(Colors::Png)),
        ("materialx", Self::MaterialX(Shading::OpenPbr)),
        ("materialx-standard", Self::MaterialX(Shading::StandardSurface)),
        ("usd", Self::Usd { packed: false, colors: Colors::Png }),
        ("usdz", Self::Usd { packed: true, colors: Colors::Png }),
        ("unreal", Self::Preset(Program::Unreal)),
        ("unity", Self::Preset(Program::Unity)),
        ("godot", Self::Preset(Program::Godot)),
        ("blender", Self::Preset(Program::Blender)),
        ("arnold", Self::Preset(Program::Arnold)),
        ("renderman", Self::Preset(Program::RenderMan)),
    ];

    /// Whether all is in one file.
    pub const fn is_one_file(self) -> bool {
        matches!(self, Self::Gltf { embed: true, .. } | Self::Usd { packed: true, .. } | Self::Pack(_))
    }
}

impl Graph {
    /// Makes each material of the outputs such files, one under two names only once unless outputs are `named`, and leaves
    /// all other outputs out. They lie on the mesh that the graph's own glTF, OBJ or USD files have, if there is one.
    ///
    /// # Errors
    /// What to do if no output is a material.
    pub fn export_as(&mut self, export: Export, named: bool) -> Result<(), String> {
        let plane = ExportMesh::Simple(SimpleShape::Plane);
        let mesh = self.outputs.iter().find_map(|output| output.mesh.filter(|mesh| *mesh != plane));
        let mesh =
            matches!(export, Export::Gltf { .. } | Export::Obj(_) | Export::Usd { .. }).then(|| mesh.unwrap_or(plane));
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
            (output.export, output.mesh, output.combined) = (Some(export), mesh, false);
        }
        Ok(())
    }
}

/// The mesh of an exported file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportMesh {
    /// One that needs no mesh.
    Simple(SimpleShape),
    /// That of an atlas.
    Atlas {
        /// The node it comes from.
        node: NodeIndex,
        /// Which of its outputs.
        output: usize,
    },
}

impl ExportMesh {
    /// Whether textures cover it once, as those of an atlas do, and end there.
    pub const fn is_atlas(self) -> bool {
        matches!(self, Self::Atlas { .. })
    }
}

/// A parameter of a graph with the value in force.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphParam {
    /// Its name.
    pub name: String,
    /// `Number`, `Integer`, `Bool`, `Color`, `Text`, `Path` or `Choice`.
    pub ty: &'static str,
    /// The value in force, as RON.
    pub value: String,
    /// The default, as RON.
    pub default: String,
    /// The smallest and largest number allowed.
    pub range: Option<(f64, f64)>,
    /// The unit, for people.
    pub unit: Option<String>,
    /// What it does.
    pub doc: String,
    /// The words that a `Choice` may be.
    pub options: Vec<String>,
    /// Where the default is written.
    pub span: Span,
}
