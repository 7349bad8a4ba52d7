//! The nodes of a tree, as it stores them.

/// Kind of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NodeKind {
    /// The whole text.
    Root,
    /// `#![…]`
    Attribute,
    /// `(a: 1)` or `(1, 2)`
    Parens,
    /// `[1, 2]`
    List,
    /// `{"a": 1}`
    Map,
    /// `Kind(a: 1)`
    Call,
    /// `key: value`
    Entry,
    /// A word by itself.
    Word,
    /// A string.
    Text,
    /// A number.
    Number,
    /// A character.
    Char,
    /// `1..2`
    Range,
    /// The place of a missing value.
    Missing,
    /// Unreadable text.
    Error,
}

/// A node in the array of a tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeData {
    pub(super) kind: NodeKind,
    /// True if the node contains a mistake.
    pub(super) broken: bool,
    /// Range of its tokens.
    pub(super) lo: u32,
    pub(super) hi: u32,
    pub(super) parent: u32,
    /// The first node after it that is not inside it.
    pub(super) next: u32,
}
