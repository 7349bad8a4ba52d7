//! Reasons why computations end early.
use crate::diagnostics::Problem;
use std::fmt;

/// Reason why a computation ended without a result.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// The work was cancelled.
    Cancelled,
    /// The computation is impossible.
    Failed(Box<Problem>),
}

impl From<Problem> for Stop {
    fn from(problem: Problem) -> Self {
        Self::Failed(Box::new(problem))
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cancelled => f.write_str("cancelled"),
            Self::Failed(problem) => problem.fmt(f),
        }
    }
}

impl std::error::Error for Stop {}
