//! The manual of nodes and of the other parts of graph files, for editors, `shibo nodes` and docs/nodes.md.
pub mod doc;
pub mod elsewhere;
pub mod markdown;
pub mod spelling;
pub mod words;
