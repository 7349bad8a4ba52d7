//! The syntax of graph files: any text becomes a tree that preserves every byte.
//!
//! [`Tree::parse`] accepts every text. Unreadable text becomes an [`Error`](NodeKind::Error) or
//! [`Missing`](NodeKind::Missing) node of the smallest possible size and a [`SyntaxError`]; the text around it is read
//! as usual. The loader, the formatter and the language server thus read the same tree, and a mistake in one line hides
//! nothing in the next. A text is valid RON exactly if its tree has no errors.
//!
//! ```
//! use shibo_graph::syntax::{NodeKind, Tree};
//!
//! let tree = Tree::parse("(nodes: { \"a\": Bands(pitch: , count: 3) }) // end");
//! assert_eq!(tree.errors().len(), 1);
//! // The node at an offset, and its parents.
//! let node = tree.covering(37..38);
//! assert_eq!((node.kind(), node.text()), (NodeKind::Number, "3"));
//! let entry = node.parent().unwrap();
//! assert_eq!(entry.key().unwrap().text(), "count");
//! let call = entry.parent().and_then(|body| body.parent()).unwrap();
//! assert_eq!(call.name(), Some("Bands"));
//! // The other field has no value: its node marks the place of the value.
//! let body = call.body().unwrap();
//! let pitch = body.entry("pitch").unwrap();
//! assert_eq!(pitch.value().unwrap().kind(), NodeKind::Missing);
//! ```
//!
//! # Form
//!
//! A text is a sequence of [tokens](Tree::tokens) with blanks and [comments](Tree::comments) between them;
//! [`Tree::pieces`] returns all of them in order, and their concatenation is the text. A [`Node`] covers a range of
//! tokens. The kinds of nodes, with their children in brackets:
//!
//! ```text
//! Root        (Attribute* value Error?)
//! Attribute   #![enable(…)]
//! Parens      (Entry* or value*)    ( … ), with named fields or with values
//! List        (value*)              [ … ]
//! Map         (Entry*)              { … }
//! Call        (Parens)              Kind( … )
//! Entry       (key value)           key: value
//! Word Text Number Char Range       leaves
//! Missing                           an empty run of tokens, where a value belongs
//! Error       (anything*)           tokens that could not be read, with what could be read among them
//! ```
//!
//! Nodes are stored in one array, ordered by their start, with the indices of the parent and of the first node after
//! them. This suffices for reading: a tree is never changed, edits are made to the text. (A library such as `rowan`
//! would add shared nodes and editing, at several allocations per node; this tree needs four in total.)
//!
//! # Mistakes
//!
//! Strings that do not end in their line are suspected first: a string over several lines is accepted only if it is
//! followed by something that can follow a string. Brackets are paired before parsing (`brackets`): if they do not
//! match, indentation and the numbers of opening and closing brackets decide which one is missing or superfluous. The
//! parser (`parse`) then never leaves the current bracket; after a mistake it continues at the next comma, or at the
//! next line that begins like an entry. Everything is linear in the length of the text, and the depth of brackets is
//! limited.
mod brackets;
mod conflict;
mod fault;
mod fill;
mod format;
#[cfg(test)]
mod format_tests;
pub mod formula;
mod lex;
mod literal;
mod nodes;
mod parse;
mod recover;
#[cfg(test)]
mod tests;
mod tree;

pub use conflict::{Marks, marks};
pub use fault::SyntaxError;
pub use format::{format, format_range};
pub use lex::{Token, TokenKind};
pub(crate) use literal::suffix;
pub use literal::{decode, is_infinity, is_name, number};
pub use nodes::NodeKind;
pub use tree::{Node, PieceKind, TextPiece, Tree};

/// The deepest nesting of brackets.
pub const MAX_NESTING: usize = 128;
