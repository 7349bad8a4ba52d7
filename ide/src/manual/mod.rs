//! The manual of the kinds of nodes: for editors, for `shibo nodes` and for the node reference.
pub mod composition;
pub mod doc;
pub mod markdown;
pub mod spelling;
