//! Expressions: one language for parameters (`"= $pitch * 2"`) and fields.
//!
//! A text becomes a program in these steps:
//! 1. `scan` splits it into words, `parse` builds a tree (`tree`).
//! 2. `unit` loads the functions that it calls, `resolve` finds the meanings of names.
//! 3. `compile` walks the tree. `apply` applies operators and functions to values (`term`), component by component, and
//!    `builder` computes constants and merges equal steps. The result is a `compiled` expression.
//! 4. `program` numbers constants, planes and steps; the kernel runs them on rows. `growth` finds out where the result
//!    repeats.
//!
//! A parameter is an expression in which everything is constant. Compiled expressions are data: `fuse` puts one into
//! another, and `text` gives a text that keys are made from.
//!
//! `operations` is the table of all operations; `op` defines them in double precision with the functions of `scalar`.
//! `functions` is the table of functions that are made of others. Nothing here is recursive, and all of it takes time
//! proportional to the length of the text.
mod apply;
mod builder;
mod check;
mod compile;
mod compiled;
mod components;
mod functions;
mod fuse;
mod growth;
mod names;
mod op;
mod operations;
mod parse;
mod planes;
mod program;
mod random;
mod resolve;
mod scalar;
mod scan;
mod term;
#[cfg(test)]
mod tests;
mod text;
mod tree;
mod unit;

pub use check::check_function;
pub use compile::{compile, evaluate};
pub use compiled::Compiled;
pub use functions::{Described, described};
pub use growth::Growth;
pub use names::{NameUse, UseKind, names_in};
pub use op::Op;
pub use planes::{FIRST_INPUT, ON_CANVAS, PLACES, PlaneOf};
pub use program::{Instruction, MOST_STEPS, Program};
pub use random::{hash, noise, noise3, of_piece, random, seed_word};

use crate::diagnostics::{Code, shorten};
use std::ops::Range;
use std::sync::Arc;

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
    /// The function whose body holds the faulty bytes, as it was asked for by [`Names::function`]; `None` if they are in
    /// the expression itself.
    pub function: Option<String>,
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
    /// Numbers of pieces, in one plane. They can be compared by `==` and `!=`, and are arguments of `random` and `hash`.
    Ids {
        /// The number of the plane.
        plane: usize,
    },
    /// Values that vary per pixel, and whose number of components is not known yet. Every use is accepted.
    Any {
        /// The number of the first plane. A component has the plane that it would have in a vector.
        first: usize,
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

    /// The meaning of a name without a `$`. A name with dots is asked for as it stands, then without its last parts, which
    /// are components. Not called for local names, for `true` and `false`, and for functions with brackets.
    fn name(&mut self, name: &str) -> Option<Meaning>;

    /// All names without a `$`, for suggestions.
    fn all(&self) -> Vec<String>;

    /// Returns true if unknown names may be words of choices anywhere. Beside `==` and `!=` they always may.
    fn has_words(&self) -> bool;

    /// A message and help for a name that is not a word of a choice, if there is something better than "unknown".
    fn instead(&mut self, _name: &str) -> Option<(String, String)> {
        None
    }

    /// The seed, called only for expressions with random numbers; `None` if it is not known yet.
    fn seed(&mut self) -> Option<u64>;

    /// The seed of `random(i, seed)`, which is that of a `RegionRandom` with this parameter; `None` if it is not known.
    fn seed_of(&mut self, _seed: u64) -> Option<u64> {
        None
    }

    /// The function of that name, which may have dots; called for names that are not functions of the language. A name
    /// in the body of `a.b.f` is asked for as `a.b.name` first, then as it stands.
    fn function(&mut self, _name: &str) -> Option<Arc<UserFunction>> {
        None
    }

    /// The names of all functions of the user, for suggestions.
    fn functions(&self) -> Vec<String> {
        Vec::new()
    }

    /// The meaning of a name in the body of a function, such as `canvas.width`.
    fn in_function(&mut self, _name: &str) -> Option<Meaning> {
        None
    }
}

/// A function that the user defines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UserFunction {
    /// The name.
    pub name: String,
    /// The names of the parameters.
    pub params: Vec<String>,
    /// The expression.
    pub body: String,
}

fn bad(range: Range<usize>, message: impl Into<String>) -> Fault {
    Fault { code: Code::BadExpression, range, message: message.into(), help: None, function: None }
}
