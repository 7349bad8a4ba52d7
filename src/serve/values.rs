//! Values that a page sets: of parameters, and in the texts of nodes.
use serde::{Deserialize, Serialize};
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

/// A value in the text of a node.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FieldEdit {
    /// The node.
    pub(crate) node: String,
    /// The field; empty for a node that is a formula.
    pub(crate) field: String,
    /// The number of a formula, counted from 0; without it, the whole value.
    #[serde(default)]
    pub(crate) index: Option<usize>,
    /// The new value, as RON.
    pub(crate) value: String,
}
