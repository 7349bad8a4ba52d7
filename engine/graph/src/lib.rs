//! Graph files: from text, through a checked document, to nodes that can be evaluated.
//!
//! [`load()`] reads a file and all its imports, and reports all errors, each at its place:
//! 1. `files` reads the texts, and [`syntax`] parses them into trees.
//! 2. `part` wraps the values of a tree with their places; `document` reads the sections of a graph file.
//! 3. `linker` has the data of a graph while its nodes are connected. `scope` resolves the names of a file and of every
//!    use of a sub-graph; `subst` substitutes parameters and expressions ([`expression`]) in values and records the
//!    origin of each byte.
//! 4. `ports` and `args` read the fields of nodes, `link` finds types and cycles and builds the nodes, `outputs` checks
//!    the outputs.
//!
//! Consequences of an error are not reported: references to faulty names give no messages, and unreadable text counts
//! as faulty (`spared`). The rest of a file with syntax errors is checked as usual.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]
pub mod syntax;

mod args;
mod calls;
mod cancel;
mod canvas;
mod channels;
mod color_names;
mod command_line;
mod convert;
mod defaults;
mod distances;
mod document;
mod each;
mod explain;
mod export_links;
mod exports;
mod files;
mod formula_names;
mod formula_text;
mod formulas;
mod functions;
mod gate;
mod imports;
mod inline;
mod instance;
mod layout;
mod link;
mod linked;
mod linker;
mod load;
mod output_decl;
mod outputs;
mod params;
mod part;
mod paths;
mod pins;
mod ports;
mod presets;
mod read;
mod remedy;
mod report;
mod resolve;
mod ron_text;
mod room;
pub mod schema;
mod scope;
mod shown_by;
mod spaces;
mod spared;
mod storage;
mod structs;
mod subst;
mod text_file;
mod tiling;
mod uses;
mod versions;

pub use cancel::Cancel;
pub use document::{GRAPH_FILE, NO_NODES};
pub use gate::Gate;
pub use imports::import_path;
pub use linked::{Export, ExportMesh, Graph, GraphNode, GraphOutput, GraphParam, GraphUse, Input};
pub use load::{load, load_text};
pub use storage::{FileColors, Storage};

use shibo_node::{self as node, registry};
use shibo_picture::{self as picture, export};
use shibo_value::diagnostics::{self, Diagnostic, SourceMap};
use shibo_value::{self as value, Resolution, expression};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// The fingerprint of this crate's code and of the libraries that it uses.
pub const CODE: &str = env!("CODE_FINGERPRINT");

/// Options that change a graph on loading.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// The preset whose values replace the defaults.
    pub preset: Option<String>,
    /// Values of parameters: RON, or bare text for `Text`, `Path` and `Color`. They override the preset. `seed` is the
    /// canvas seed unless a parameter has that name.
    pub set: Vec<(String, String)>,
    /// The resolution, instead of that of the canvas.
    pub resolution: Option<Resolution>,
    /// The base of relative paths in [`set`](Self::set).
    pub working_dir: PathBuf,
    /// Additional folders for imports, searched after the graph's folder and before those of `shibo.toml`.
    pub import_paths: Vec<PathBuf>,
    /// True to take the newest versions of all kinds, whatever `pins` say.
    pub newest: bool,
    /// Limits on the size of a graph.
    pub limits: Limits,
    /// Texts that replace the content of files, such as unsaved texts of an editor. The files need not exist.
    pub overlay: BTreeMap<PathBuf, Arc<str>>,
    /// Decides which files may be read: imports, files that nodes read, and `shibo.toml`.
    pub gate: Gate,
    /// True to leave suggestions out of the help of errors, as they take most of the time where names are wrong.
    pub brief: bool,
    /// Ends the load early. The result has neither a graph nor diagnostics then.
    pub cancel: Cancel,
}

/// Limits on the size of a graph.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The largest graph file in bytes.
    pub max_file_bytes: u64,
    /// The deepest nesting of brackets; at most 128.
    pub max_nesting: usize,
    /// The most nodes; nodes of sub-graphs count at every use.
    pub max_nodes: usize,
    /// The most imported files, direct and indirect.
    pub max_imports: usize,
    /// The longest chain of imports.
    pub max_import_depth: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { max_file_bytes: 8 << 20, max_nesting: 128, max_nodes: 100_000, max_imports: 256, max_import_depth: 32 }
    }
}

/// The result of loading a graph file.
pub struct Loaded {
    /// The graph, unless there is an error.
    pub graph: Option<Graph>,
    /// Errors and warnings in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
    /// The texts that the diagnostics refer to.
    pub sources: SourceMap,
    /// Every file that was looked for, including missing ones; to be watched for changes.
    pub files: Vec<PathBuf>,
}
