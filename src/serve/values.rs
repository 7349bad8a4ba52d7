//! Values that a page sets: of parameters, and in the texts of nodes.
use serde::{Deserialize, Serialize};
use shibo_bridge::page::edits::FieldEdit;
use shibo_graph::LoadOptions;

/// Parameter values set by a page.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Values {
    /// Name of the preset.
    #[serde(default)]
    pub(crate) preset: Option<String>,
    /// Names and values, as RON.
    #[serde(default)]
    pub(crate) set: Vec<(String, String)>,
    /// Values in the texts of nodes, in the order in which they were set.
    #[serde(default)]
    pub(crate) edits: Vec<FieldEdit>,
}

impl Values {
    /// Options to load a graph with these values.
    pub(crate) fn options(self) -> LoadOptions {
        LoadOptions {
            preset: self.preset,
            set: self.set,
            working_dir: std::env::current_dir().unwrap_or_default(),
            import_paths: crate::environment::import_paths().to_vec(),
            ..LoadOptions::default()
        }
    }
}
