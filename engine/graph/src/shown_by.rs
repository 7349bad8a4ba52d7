//! Outputs that show the materials of a graph by a node.
use crate::linked::{ExportMesh, Graph, GraphNode, GraphOutput, Input};
use crate::node::Arg;
use crate::registry::Registry;
use crate::value::{ChannelSet, Type};

impl Graph {
    /// Replaces the outputs by pictures of their materials, which a node of `kind` makes. Its first argument is the port
    /// for the material, the others are parameters as RON; `mesh` is the port for the mesh of the graph's exports, if one is
    /// wanted. A picture is named `OUTPUT_SUFFIX`; outputs that are no materials are dropped. `named`: the outputs to show; all if
    /// empty.
    ///
    /// # Errors
    /// A remedy if there is no such output or no such mesh, or if the node cannot be made.
    pub fn show_by(
        &mut self,
        registry: &Registry,
        (kind, port, mesh, params): (&str, &str, Option<&str>, &[(&str, &str)]),
        (suffix, named): (&str, &[String]),
    ) -> Result<(), String> {
        let atlas = self.outputs.iter().find_map(|output| match output.mesh {
            Some(ExportMesh::Atlas { node, output }) => Some((node, output)),
            _ => None,
        });
        let on_mesh = match (mesh, atlas) {
            (Some(_), None) => {
                let remedy = "a mesh is that of an output such as `Gltf(material: \"m\", mesh: \"atlas\")`";
                return Err(format!("no output of the graph has a mesh with an atlas; {remedy}"));
            }
            (mesh, atlas) => mesh.zip(atlas),
        };
        let mut seen = Vec::new();
        let mut shown = Vec::new();
        for output in std::mem::take(&mut self.outputs) {
            if output.ty != Type::Material || !(named.is_empty() || named.contains(&output.name)) {
                continue;
            }
            // A material with several names, as one that is also exported, is shown once.
            let source = (output.node, output.output);
            if named.is_empty() && seen.contains(&source) {
                continue;
            }
            seen.push(source);
            let mut args = vec![(port, Arg::Slot(0))];
            args.extend(on_mesh.map(|(mesh, _)| (mesh, Arg::Slot(1))));
            args.extend(params.iter().map(|(name, text)| (*name, Arg::Ron(text))));
            let node = match registry.build(kind, None, &args) {
                Some(Ok(node)) => node,
                Some(Err(error)) => return Err(format!("`{kind}` cannot be made: {}", error.message)),
                None => return Err(format!("there is no kind `{kind}`")),
            };
            let name = format!("{}_{suffix}", output.name);
            let mut inputs = vec![Input::Wire { node: output.node, output: output.output }];
            let mut slots = vec![port.to_owned()];
            if let Some((mesh, (node, output))) = on_mesh {
                inputs.push(Input::Wire { node, output });
                slots.push(mesh.to_owned());
            }
            let added = self.nodes.add_node(GraphNode {
                name: name.clone(),
                kind: kind.to_owned(),
                node,
                canvas: self.canvas,
                inputs,
                slots,
                outputs: vec![Type::Rgb],
                files: Vec::new(),
                channels: ChannelSet::default(),
                span: output.span,
                fields: Vec::new(),
            });
            self.nodes.add_edge(output.node, added, ());
            if let Some((_, (atlas, _))) = on_mesh {
                self.nodes.add_edge(atlas, added, ());
            }
            shown.push(GraphOutput::plain(name, (added, 0), Type::Rgb, output.span));
        }
        if shown.is_empty() {
            let message = "has that name and is a material";
            let remedy = "connect a `Material` to an output";
            return Err(match named.first() {
                Some(name) => format!("no output `{name}` {message}; {remedy}"),
                None => format!("the graph has no output that is a material; {remedy}"),
            });
        }
        self.outputs = shown;
        Ok(())
    }
}
