//! The manual of the kinds of nodes: for editors, for `shibo nodes` and for the node reference.

pub mod doc;
pub mod markdown;
pub mod spelling;
pub mod words;
