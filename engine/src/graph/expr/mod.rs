//! Expressions in parameters: `"= $pitch * 2"`.
//!
//! `scan` cuts a text into words, `parse` makes a tree of them, `evaluate` looks the parameters up and computes. `+ - * / % ^`,
//! brackets and the names of [`functions`]; angles are degrees, as everywhere in graph files. Nothing here is recursive, and
//! all of it takes time proportional to the length of the text.
mod evaluate;
mod functions;
mod parse;
mod scan;
#[cfg(test)]
mod tests;

pub(super) use evaluate::evaluate;

use super::read::shorten;
use crate::diagnostics::Code;
use std::ops::Range;

/// The most errors of an expression that are reported.
const MOST_ERRORS: usize = 16;

/// Something wrong in an expression: the bytes at fault.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ExprError {
    /// The class of the error.
    pub(super) code: Code,
    /// Where, in bytes of the expression.
    pub(super) range: Range<usize>,
    /// What is wrong.
    pub(super) message: String,
    /// What to do about it.
    pub(super) help: Option<String>,
}

/// What the name of a parameter stands for.
pub(super) enum Lookup {
    /// A number.
    Number(f64),
    /// There is none of that name, or it is no number.
    Wrong(Code, String, Option<String>),
    /// Its value is in error, which was reported.
    Broken,
}

fn bad(range: Range<usize>, message: impl Into<String>) -> ExprError {
    ExprError { code: Code::BadExpression, range, message: message.into(), help: None }
}
