//! `render --as`: writes the materials of a graph for another program, instead of the graph's own outputs.
use crate::quit::Quit;
use clap::ValueEnum;
use shibo_engine::graph::{Export, Graph};

/// Format of the materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Target {
    /// A binary glTF file.
    Gltf,
    /// A glTF file with its mesh and its pictures beside it.
    GltfFiles,
    /// An OBJ file with its material library and its pictures.
    Obj,
    /// A MaterialX document, `open_pbr_surface`.
    #[value(name = "materialx")]
    MaterialX,
    /// A MaterialX document, `standard_surface`.
    #[value(name = "materialx-standard")]
    MaterialXStandard,
    /// A USD file.
    Usd,
    /// A USD file with its pictures in it.
    Usdz,
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
        let name = self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default();
        Export::TARGETS.iter().find(|(known, _)| *known == name).map_or(Export::TARGETS[0].1, |(_, export)| *export)
    }

    /// Replaces the outputs of the graph by its materials in this format.
    pub(crate) fn replace_outputs(self, graph: &mut Graph, named: bool) -> Result<(), Quit> {
        graph.export_as(self.export(), named).map_err(Quit::Usage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_match_engine_targets() {
        let names: Vec<String> = Target::value_variants()
            .iter()
            .filter_map(|target| Some(target.to_possible_value()?.get_name().to_owned()))
            .collect();
        assert_eq!(names, Export::TARGETS.map(|(name, _)| name.to_owned()));
    }
}
