//! Formulas of fields and of solids. Graph files write them as texts, `"= a + b"`; the engine adds these nodes.
mod field;
mod fused;
mod solid;
#[cfg(test)]
mod tests;

pub(crate) use field::Formula;
pub(crate) use solid::SolidFormula;

use shibo_value::diagnostics::{Code, Problem};
use shibo_value::expression::Compiled;

/// The program of a formula. It comes from the engine, so it can be read.
fn program(text: &str) -> Result<Compiled, Problem> {
    let unreadable = || Problem::new(Code::BadValue, "the program of the formula cannot be read");
    Compiled::decode(text).ok_or_else(unreadable)
}

/// The warning for a result that is not finite, at a place in mm.
fn not_finite(place: &str) -> Problem {
    let message = format!("the formula is not finite at {place} mm; it counts as 0 there");
    let help = "look for a division by 0, or a root or logarithm of a negative number";
    Problem::new(Code::Advice, message).help(help)
}
