//! Operations on graphs as plain functions, each with a request and an answer type that serde can write.
//!
//! The command `shibo` and other transports call these functions and add only their own form of input and output. Nothing here
//! prints, reads the environment or starts a process.
//!
//! - [`check()`]: the errors and warnings of a graph, with fixes.
//! - [`compare()`]: the differences between two pictures of a material.
//! - [`diff()`]: the changes from one graph to another, without comments, layout and order.
//! - [`lock`]: the pictures of pinned graphs, and the comparison with them.
//! - [`pictures`]: the differences between the pictures of two versions.
//! - [`fix()`]: the text of a graph after fixes.
//! - [`host`]: requests of programs in other languages, for all transports.
//! - [`to_json()`] and [`to_ron()`]: graphs in the JSON form; [`schema()`]: the JSON Schema of that form.
//! - [`manual`]: the manual of nodes, and the search for nodes.
//! - [`merge()`]: the text of a graph with the changes of two sides.
//! - [`page`]: a scene as pages show it.
//! - [`scene`]: the pictures of all targets of a graph, for the page, editors and agents.
#[cfg(feature = "agents")]
pub mod agents;
#[cfg(test)]
mod cancel_tests;
pub mod check;
pub mod compare;
pub mod diff;
#[cfg(test)]
mod diff_tests;
#[cfg(test)]
mod faults;
pub mod fix;
#[cfg(test)]
mod fix_tests;
pub mod host;
pub mod json;
pub mod light;
pub mod lock;
pub mod manual;
pub mod merge;
pub mod page;
pub mod pictures;
mod renames;
pub mod scene;
pub mod schema;
mod shape;
mod side;
#[cfg(test)]
mod testing;
mod three;
pub mod write;

pub use check::{CheckRequest, check};
pub use compare::{CompareRequest, compare};
pub use diff::{DiffRequest, diff};
pub use fix::{FixRequest, fix};
pub use json::{to_json, to_ron};
pub use merge::{MergeRequest, merge};
pub use pictures::picture;
pub use schema::{kind_schema, schema};

use serde::{Deserialize, Serialize};
use shibo_engine::eval::CancelToken;
use shibo_graph::{Cancel, Gate, LoadOptions};
use shibo_node::registry::Registry;
use std::path::PathBuf;
use std::sync::Arc;

/// The kinds of nodes, and the folders in which imports are searched.
#[derive(Clone)]
pub struct Tools {
    /// The kinds of nodes and the shipped graphs.
    pub registry: Arc<Registry>,
    /// Folders for imports, searched after the folder of the graph.
    pub import_paths: Vec<PathBuf>,
    /// Decides which files graphs may read.
    pub gate: Gate,
    /// Ends [`check()`] and [`fix()`] early, and loads of graphs. Their answers are incomplete then.
    pub cancel: CancelToken,
}

impl Tools {
    /// These tools for an operation that ends early when `cancel` asks for it.
    #[must_use]
    pub fn until(&self, cancel: &CancelToken) -> Self {
        Self { cancel: cancel.clone(), ..self.clone() }
    }

    /// Options for loading a graph: import folders, files and the cancellation of these tools.
    pub(crate) fn options(&self) -> LoadOptions {
        LoadOptions {
            import_paths: self.import_paths.clone(),
            gate: self.gate.clone(),
            cancel: self.asked(),
            ..LoadOptions::default()
        }
    }

    /// The cancellation, for loads.
    pub(crate) fn asked(&self) -> Cancel {
        let cancel = self.cancel.clone();
        Cancel::new(move || cancel.is_cancelled())
    }
}

/// A graph as text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraphText {
    /// Path of the file. Imports are searched from its folder. The file need not exist.
    pub path: PathBuf,
    /// The text.
    pub text: String,
}
