//! Expressions: one language for parameters (`"= $pitch * 2"`) and fields (the node `Expression`).
//!
//! `scan` splits a text into words, `parse` builds a tree, `compile` resolves names, computes constants and turns the
//! rest into steps; `program` assigns registers to the steps and finds out where the result repeats. A parameter is an
//! expression in which everything is constant. `op` defines the operations for both; the kernel runs them on rows.
//! Nothing here is recursive, and all of it takes time proportional to the length of the text.
mod compile;
mod functions;
mod manual;
mod meanings;
mod op;
mod parse;
mod program;
mod random;
mod scan;
#[cfg(test)]
mod tests;

pub use compile::{Compiled, compile, evaluate};
pub use manual::{Described, described};
pub use op::Op;
pub use program::{Instruction, Program};
pub use random::{hash, noise, random, seed_word};

use crate::diagnostics::{Code, shorten};
use std::ops::Range;

/// The most errors reported for one expression.
const MOST_ERRORS: usize = 16;

/// An error in an expression, with the faulty bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The class of the error.
    pub code: Code,
    /// The faulty bytes of the expression.
    pub range: Range<usize>,
    /// The message.
    pub message: String,
    /// How to fix it.
    pub help: Option<String>,
}

/// The value of a constant expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// True or false.
    Bool(bool),
    /// The word of a choice.
    Word(String),
    /// Two to four numbers: a vector, a colour, a matrix.
    Vector(Vec<f64>),
}

/// The meaning of a name.
#[derive(Clone, Debug, PartialEq)]
pub enum Meaning {
    /// A constant.
    Known(Value),
    /// A choice: its word, and all possible words.
    Choice(String, Vec<String>),
    /// Values that vary per pixel, in consecutive planes.
    Planes {
        /// The number of the first plane.
        first: usize,
        /// Number of planes, 1 to 4.
        count: usize,
    },
    /// An unknown name, or one that cannot be used here: code, message and help.
    Wrong(Code, String, Option<String>),
    /// The value has an error that was already reported.
    Broken,
}

/// Resolves the names of an expression.
pub trait Names {
    /// The meaning of `$name`.
    fn param(&mut self, name: &str) -> Meaning;

    /// The meaning of a name without a `$`; not called for functions and constants of the language.
    fn name(&mut self, name: &str) -> Option<Meaning>;

    /// All names without a `$`, for suggestions.
    fn all(&self) -> Vec<String>;

    /// Returns true if unknown names may be words of choices.
    fn has_words(&self) -> bool;

    /// A message and help for a name that is not a word of a choice, if there is something better than "unknown".
    fn instead(&mut self, _name: &str) -> Option<(String, String)> {
        None
    }

    /// The seed, called only for expressions with random numbers; `None` if it is not known yet.
    fn seed(&mut self) -> Option<u64>;
}

fn bad(range: Range<usize>, message: impl Into<String>) -> Fault {
    Fault { code: Code::BadExpression, range, message: message.into(), help: None }
}
