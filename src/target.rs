//! `render --as`: the materials of a graph as files for another program, whatever its outputs say.
use crate::quit::Quit;
use clap::ValueEnum;
use shibo_engine::export::{Program, Shading};
use shibo_engine::graph::{Export, ExportMesh, Graph};
use shibo_engine::value::Type;

/// What materials are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Target {
    /// A binary glTF file.
    Gltf,
    /// A MaterialX document, `open_pbr_surface`.
    #[value(name = "materialx")]
    MaterialX,
    /// A MaterialX document, `standard_surface`.
    #[value(name = "materialx-standard")]
    MaterialXStandard,
    /// A USD file.
    Usd,
    /// The pictures that Unreal Engine expects.
    Unreal,
    /// The pictures that Unity expects.
    Unity,
    /// The pictures that Godot expects.
    Godot,
    /// Pictures, and a script that builds the material in Blender.
    Blender,
    /// EXR pictures for Arnold.
    Arnold,
    /// EXR pictures for `RenderMan`.
    #[value(name = "renderman")]
    RenderMan,
}

impl Target {
    fn export(self) -> Export {
        match self {
            Self::Gltf => Export::Gltf,
            Self::MaterialX => Export::MaterialX(Shading::OpenPbr),
            Self::MaterialXStandard => Export::MaterialX(Shading::StandardSurface),
            Self::Usd => Export::Usd,
            Self::Unreal => Export::Preset(Program::Unreal),
            Self::Unity => Export::Preset(Program::Unity),
            Self::Godot => Export::Preset(Program::Godot),
            Self::Blender => Export::Preset(Program::Blender),
            Self::Arnold => Export::Preset(Program::Arnold),
            Self::RenderMan => Export::Preset(Program::RenderMan),
        }
    }

    /// Makes each material of the graph's outputs such files, one under two names only once unless outputs are `named`, and
    /// leaves all other outputs out. They lie on the mesh that the graph's own glTF or USD files have, if there is one.
    pub(crate) fn replace_outputs(self, graph: &mut Graph, named: bool) -> Result<(), Quit> {
        let export = self.export();
        let mesh = graph.outputs.iter().find_map(|output| output.mesh.filter(|mesh| *mesh != ExportMesh::Plane));
        let mesh = matches!(export, Export::Gltf | Export::Usd).then(|| mesh.unwrap_or(ExportMesh::Plane));
        graph.outputs.retain(|output| output.ty == Type::Material);
        let mut seen = Vec::new();
        graph.outputs.retain(|output| {
            let source = (output.node, output.output);
            let new = !seen.contains(&source);
            seen.push(source);
            new || named
        });
        if graph.outputs.is_empty() {
            let message = "the graph has no output that is a material, which --as could write";
            return Err(Quit::Usage(format!("{message}; connect a `Material` to an output")));
        }
        for output in &mut graph.outputs {
            (output.export, output.mesh, output.combined) = (Some(export), mesh, false);
        }
        Ok(())
    }
}
