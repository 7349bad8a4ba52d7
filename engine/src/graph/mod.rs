//! Graph files: from text, through a checked document, to nodes that can be evaluated.
//!
//! [`load()`] reads a file and all that it imports and reports every error of all of them, each at its place:
//! 1. `files` reads the texts, and [`syntax`](crate::syntax) makes trees of them.
//! 2. `part` gives the values of a tree that know their places; `document` finds the parts of a graph file among them.
//! 3. `scope` gives the names of a file, and of every use of a sub-graph, their meanings; `subst` puts parameters and
//!    expressions ([`expression`](crate::expression)) into values and remembers where each byte came from.
//! 4. `ports` and `args` read the fields of nodes, `link` finds types and cycles and builds the nodes, `outputs` checks
//!    what is rendered.
//!
//! An error that only follows from another one is not reported: references to something in error give no messages, and what cannot
//! be read of a text is in error (`spared`). Everything else of a file with mistakes in its syntax is checked as usual.
mod args;
mod canvas;
mod channels;
mod convert;
mod defaults;
mod distances;
mod document;
mod each;
mod explain;
mod exports;
mod files;
mod imports;
mod inline;
mod instance;
mod layout;
mod link;
mod linked;
mod load;
mod outputs;
mod params;
mod part;
mod ports;
mod read;
mod remedy;
mod report;
mod room;
mod scope;
mod spared;
mod storage;
mod structs;
mod subst;
mod tiling;
mod uses;

pub use imports::import_path;
pub use linked::{Export, ExportMesh, Graph, GraphNode, GraphOutput, GraphParam, GraphUse, Input};
pub use load::{load, load_text};
pub use storage::{FileColors, Storage};

use crate::diagnostics::{Diagnostic, SourceMap};
use crate::value::Resolution;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// What the caller changes of a graph.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// The preset whose values replace the defaults.
    pub preset: Option<String>,
    /// Values of parameters: RON, or bare text for `Text`, `Path` and `Color`. They replace those of the preset. `seed` is
    /// the canvas' seed unless a parameter has that name.
    pub set: Vec<(String, String)>,
    /// The resolution to use instead of the canvas' own.
    pub resolution: Option<Resolution>,
    /// What paths in [`set`](Self::set) are relative to.
    pub working_dir: PathBuf,
    /// Further folders in which imports are looked for: after that of the graph, before those of `shibo.toml`.
    pub import_paths: Vec<PathBuf>,
    /// How large a graph may be.
    pub limits: Limits,
    /// Texts that count instead of the contents of files, such as those that an editor has not saved. The files need not
    /// exist.
    pub overlay: BTreeMap<PathBuf, Arc<str>>,
}

/// How large a graph may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The largest graph file in bytes.
    pub max_file_bytes: u64,
    /// The deepest nesting of brackets; at most 128.
    pub max_nesting: usize,
    /// The most nodes, those of sub-graphs counted at every use.
    pub max_nodes: usize,
    /// The most files imported, directly or through others.
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
    /// The texts that they point into.
    pub sources: SourceMap,
    /// Every file looked at, missing ones too: what to watch.
    pub files: Vec<PathBuf>,
}
