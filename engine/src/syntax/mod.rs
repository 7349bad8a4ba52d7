//! The syntax of graph files: any text becomes a tree that loses nothing.
//!
//! [`Tree::parse`] accepts every text. What it cannot read becomes a [`Error`](NodeKind::Error) or
//! [`Missing`](NodeKind::Missing) node of the smallest possible size and a [`SyntaxError`]; all around it is read as usual. So the
//! loader, the formatter and the language server read the same tree, and a mistake in one line hides nothing in the next.
//! A text is RON exactly if its tree has no errors.
//!
//! ```
//! use shibo_engine::syntax::{NodeKind, Tree};
//!
//! let tree = Tree::parse("(nodes: { \"a\": Bands(pitch: , count: 3) }) // end");
//! assert_eq!(tree.errors().len(), 1);
//! // What is at an offset: the node, and its surroundings.
//! let node = tree.covering(37..38);
//! assert_eq!((node.kind(), node.text()), (NodeKind::Number, "3"));
//! let entry = node.parent().unwrap();
//! assert_eq!(entry.key().unwrap().text(), "count");
//! let call = entry.parent().and_then(|body| body.parent()).unwrap();
//! assert_eq!(call.name(), Some("Bands"));
//! // The other field has no value. Its node is where one belongs.
//! let body = call.body().unwrap();
//! let pitch = body.entry("pitch").unwrap();
//! assert_eq!(pitch.value().unwrap().kind(), NodeKind::Missing);
//! ```
//!
//! # Form
//!
//! A text is a sequence of [tokens](Tree::tokens) with blanks and [comments](Tree::comments) between them;
//! [`Tree::pieces`] gives all of them in order, and their texts put together are the text. A [`Node`] covers a run of tokens. The
//! kinds of nodes, with their children in brackets:
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
//! Nodes lie in one array in the order of their beginnings, with the number of the parent and of the first node behind them. That is all
//! a reader needs: nothing here changes a tree, edits are made to the text. (A library such as `rowan` would add shared nodes and
//! editing, at several allocations a node; this one has four in all.)
//!
//! # Mistakes
//!
//! Strings that do not end in their line are the first suspects: one that goes on into the next lines is believed only if
//! what follows it can follow a string. Brackets are paired before anything else is read (`brackets`): if they do not pair up, indentation
//! and the numbers of opening and closing ones decide which is missing or too many. The parser (`parse`) then never leaves the bracket
//! that it is in; after a mistake it goes on at the next comma, or at the next line that begins like an entry.
//! Everything is linear in the length of the text, and the depth of brackets is limited.
mod brackets;
mod fault;
mod format;
#[cfg(test)]
mod format_tests;
mod lex;
mod literal;
mod parse;
mod recover;
#[cfg(test)]
mod tests;
mod tree;

pub use fault::SyntaxError;
pub use format::{format, format_range};
pub use lex::{Token, TokenKind};
pub(crate) use literal::suffix;
pub use literal::{decode, is_infinity, is_name, number};
pub use tree::{Node, NodeKind, Piece, PieceKind, Tree};

/// The deepest nesting of brackets.
pub const MAX_NESTING: usize = 128;
