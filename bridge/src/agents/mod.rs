//! Operations for agents, which may use only some folders of the machine: list, describe, check, format, render
//! and save graphs, compare pictures, and look nodes up. Each has a request that serde can read and an answer that it can write.
mod describe;
mod folders;
mod graphs;
mod nodes;
mod pictures;
mod region;
mod roots;
mod save;
mod state;

pub use describe::{DescribeRequest, Described, describe};
pub use folders::Folders;
pub use graphs::{
    Checked, FixArgs, Fixed, Formatted, Level, ListRequest, Listed, ListedGraphs, Opened, SaveRequest, Saved, Source,
    check, findings, fix, format, list, load, open, save,
};
pub use nodes::{
    FoundKind, FoundKinds, KindManual, KindRequest, OutputManual, ParamManual, PortManual, SearchRequest,
    describe_node, search_nodes,
};
pub use pictures::{CompareArgs, NoPicture, RenderRequest, Rendered, compare_pictures, render};
pub use save::{MOST_TEXT, sha256};
pub use state::State;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The most diagnostics of an answer.
pub const MOST_DIAGNOSTICS: usize = 100;

/// The reason why an operation was not done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Refusal {
    /// The kind of reason: `outside`, `file-not-found`, `bad-file`, `bad-name`, `too-large`, `changed`, `unknown` or a code of a
    /// diagnostic.
    pub code: String,
    /// The reason, in one line.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl Refusal {
    /// A refusal.
    pub fn new(code: &str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { code: code.to_owned(), message: message.into(), help: help.into() }
    }

    /// The refusal of a path. It does not tell whether there is such a file.
    pub fn outside(path: &str) -> Self {
        let message = format!("`{path}` is outside of the folders that may be used");
        Self::new("outside", message, "paths are relative to the first folder of `--read`")
    }
}
