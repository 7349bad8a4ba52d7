//! The contents of a graph for agents.
use super::graphs::{Source, findings, load, open};
use super::{Checked, Folders, Refusal};
use crate::Tools;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_graph::syntax::{Node, Tree};
use shibo_graph::{Graph, Input};
use std::collections::BTreeMap;

/// A graph to describe.
pub type DescribeRequest = Source;

/// The contents of a graph.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Described {
    /// The family of its material, such as `stone`.
    pub family: Option<String>,
    /// Width and height of the canvas in mm.
    pub size_mm: [f64; 2],
    /// Width and height of the pictures in pixels.
    pub resolution: [u32; 2],
    /// The parameters.
    pub params: Vec<Param>,
    /// The presets.
    pub presets: Vec<String>,
    /// The outputs that can be rendered.
    pub outputs: Vec<Output>,
    /// The imports: names and paths, as written.
    pub imports: BTreeMap<String, String>,
    /// The nodes of the graph, without those of sub-graphs.
    pub nodes: Vec<NodeInfo>,
    /// The SHA-256 of the text, for `write`.
    pub sha256: String,
}

/// A parameter of a graph.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Param {
    /// The name.
    pub name: String,
    /// The type, such as `Number`.
    #[serde(rename = "type")]
    pub ty: String,
    /// The value, in RON.
    pub value: String,
    /// The smallest and the largest value.
    pub range: Option<(f64, f64)>,
    /// The unit.
    pub unit: Option<String>,
    /// The heading under which views show it.
    pub group: Option<String>,
    /// The words to choose from.
    pub options: Vec<String>,
    /// The manual. It was written by the author of the graph.
    pub doc: String,
}

/// An output of a graph.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Output {
    /// The name.
    pub name: String,
    /// The type, such as `Material`.
    #[serde(rename = "type")]
    pub ty: String,
    /// The node that makes it.
    pub node: String,
}

/// A node of a graph.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct NodeInfo {
    /// The name.
    pub name: String,
    /// The kind.
    pub kind: String,
    /// The types of its outputs.
    pub outputs: Vec<String>,
    /// The nodes that read it.
    pub readers: Vec<String>,
    /// The line of the text, counted from 1.
    pub line: usize,
}

/// Describes a graph.
///
/// # Errors
/// Those of [`open`]; errors and warnings of a faulty graph.
pub fn describe(
    tools: &Tools,
    folders: &Folders,
    source: &DescribeRequest,
) -> Result<Result<Described, Checked>, Refusal> {
    let opened = open(tools, folders, source)?;
    let loaded = load(tools, &opened, (&[], None), None);
    let Some(graph) = loaded.graph else {
        return Ok(Err(findings(tools, &loaded.diagnostics, &loaded.sources)));
    };
    let params = graph.params.iter().map(|param| Param {
        name: param.name.clone(),
        ty: param.ty.to_owned(),
        value: param.value.clone(),
        range: param.range,
        unit: param.unit.clone(),
        group: param.group.clone(),
        options: param.options.clone(),
        doc: param.doc.clone(),
    });
    let outputs = graph.outputs.iter().map(|output| Output {
        name: output.name.clone(),
        ty: output.ty.name().to_owned(),
        node: graph.nodes[output.node].name.clone(),
    });
    Ok(Ok(Described {
        family: graph.family.clone(),
        size_mm: graph.canvas.size_mm.to_array(),
        resolution: graph.canvas.resolution.to_array(),
        params: params.collect(),
        presets: graph.presets.clone(),
        outputs: outputs.collect(),
        imports: named(&opened.text, "imports"),
        nodes: nodes(&graph),
        sha256: super::sha256(opened.text.as_bytes()),
    }))
}

/// The texts of a section by their names.
fn named(text: &str, section: &str) -> BTreeMap<String, String> {
    let tree = Tree::parse(text);
    let section = tree.value().and_then(|top| top.entry(section)?.value());
    let entries = section.into_iter().flat_map(Node::entries);
    entries.filter_map(|entry| Some((entry.key_text()?, entry.value()?.string()?))).collect()
}

/// The nodes of the file itself.
fn nodes(graph: &Graph) -> Vec<NodeInfo> {
    let mut readers: BTreeMap<usize, Vec<String>> = BTreeMap::new();
    for reader in graph.nodes.node_weights() {
        for input in &reader.inputs {
            if let Input::Wire { node, .. } = input {
                let list = readers.entry(node.index()).or_default();
                if !list.contains(&reader.name) {
                    list.push(reader.name.clone());
                }
            }
        }
    }
    let own = graph.nodes.node_indices().filter(|index| !graph.nodes[*index].name.contains('/'));
    let mut info = |index: petgraph::graph::NodeIndex| {
        let node = &graph.nodes[index];
        NodeInfo {
            name: node.name.clone(),
            kind: node.kind.clone(),
            outputs: node.outputs.iter().map(|ty| ty.name().to_owned()).collect(),
            readers: readers.remove(&index.index()).unwrap_or_default(),
            line: graph.sources.position(node.span.file, node.span.start).line,
        }
    };
    own.map(&mut info).collect()
}
