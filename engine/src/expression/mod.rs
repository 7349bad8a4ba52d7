//! Expressions: the one language of parameters (`"= $pitch * 2"`) and of fields (the node `Expression`).
//!
//! `scan` cuts a text into words, `parse` makes a tree of them, `compile` gives the names their meanings, computes what is
//! constant and keeps the rest as steps; `program` gives the steps registers and finds out where the result repeats. A parameter
//! is an expression in which everything is constant. What the operations are is in `op`, once for both; the kernel runs
//! them on rows. Nothing here is recursive, and all of it takes time proportional to the length of the text.
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

use crate::diagnostics::Code;
use std::ops::Range;

/// The most errors of an expression that are reported.
const MOST_ERRORS: usize = 16;

/// Something wrong in an expression: the bytes at fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The class of the error.
    pub code: Code,
    /// Where, in bytes of the expression.
    pub range: Range<usize>,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

/// The value of an expression in which everything is constant.
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

/// What a name stands for.
#[derive(Clone, Debug, PartialEq)]
pub enum Meaning {
    /// A constant.
    Known(Value),
    /// A choice: its word, and all the words that it may be.
    Choice(String, Vec<String>),
    /// Values that change from pixel to pixel: so many planes, beginning with this one.
    Planes {
        /// The number of the first plane.
        first: usize,
        /// How many there are, 1 to 4.
        count: usize,
    },
    /// There is none of that name, or it cannot be used here.
    Wrong(Code, String, Option<String>),
    /// Its value is in error, which was reported.
    Broken,
}

/// What names in an expression stand for.
pub trait Names {
    /// What `$name` stands for.
    fn param(&mut self, name: &str) -> Meaning;

    /// What a name without a `$` stands for; functions and constants of the language are not asked for.
    fn name(&mut self, name: &str) -> Option<Meaning>;

    /// All names without a `$`, for suggestions.
    fn all(&self) -> Vec<String>;

    /// Whether other names are the words of choices.
    fn has_words(&self) -> bool;

    /// What to say of a name that is no word of a choice: a message and what to do, if there is something better than that it is
    /// unknown.
    fn instead(&mut self, _name: &str) -> Option<(String, String)> {
        None
    }

    /// The seed of random numbers, if the expression has some; `None` where there is none yet.
    fn seed(&mut self) -> Option<u64>;
}

fn bad(range: Range<usize>, message: impl Into<String>) -> Fault {
    Fault { code: Code::BadExpression, range, message: message.into(), help: None }
}

/// A text that fits into a line of a message.
fn shorten(text: &str) -> String {
    let line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(60).collect();
    if line.chars().count() < text.chars().count() { format!("{line}…") } else { line }
}
