//! Graph files: from text, by way of a checked document, to nodes that can be evaluated.
mod linked;

pub use linked::{Graph, GraphNode, GraphOutput, GraphParam, Input};
