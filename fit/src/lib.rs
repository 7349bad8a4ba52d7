//! Finds the values of parameters with which a graph looks like a photograph.
//!
//! The method knows neither graphs nor files; [`graph`] applies it to them, and [`page`] does so for pages. It gets unknowns, the numbers of a photograph ([`shibo_bridge::compare::Gauge`]) and
//! something that renders values at a seed and measures the result. It models each number as a function of the unknowns and searches
//! on that model, because a render gives hundreds of numbers and each alone is nearly linear.
//!
//! 1. *Design*: the default, the presets, and points that fill the cube of unknowns evenly. Each render has another seed.
//! 2. *Model*: kernel ridge regression of all numbers (`ridge`). It averages over seeds.
//! 3. *Step*: minimise the distance of the modelled numbers by CMA-ES, and render that point and points around it.
//! 4. *Answer*: the minimum of the last model, with errors from the slope of the model.
//!
//! All random numbers come from one hashed seed, batches have fixed sizes and sums a fixed order. So the bits of the result do not
//! depend on the number of threads.
#![allow(clippy::disallowed_methods, reason = "no picture that is written is made here")]
mod answer;
mod cma;
pub mod graph;
mod linear;
pub mod page;
mod random;
mod ridge;
mod samples;
mod search;
mod sobol;
#[cfg(test)]
mod tests;
mod turns;
mod unknowns;

pub use answer::{End, Found, Level};
pub use search::{Fit, fit, fit_in_turns};
pub use unknowns::{Amount, Kind, Unknown, Unknowns};

use shibo_bridge::compare::Scale;

/// Values to begin with: those of the graph, or of a preset.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The values of the unknowns.
    pub amounts: Vec<Amount>,
    /// The combination of all that is no unknown, such as choices. Starts with the same combination have the same number.
    pub combination: usize,
}

/// A problem to solve.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The unknowns.
    pub unknowns: Unknowns,
    /// The values to begin with; the first one is the graph's own. There must be one.
    pub starts: Vec<Start>,
    /// The numbers of the photograph.
    pub target: Vec<f64>,
    /// The scale of the numbers.
    pub scale: Scale,
    /// The most renders; a default that depends on the number of unknowns if `None`.
    pub renders: Option<usize>,
    /// The seed of all random numbers.
    pub seed: u64,
}

/// A picture to render and measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Ask {
    /// The values of the unknowns.
    pub amounts: Vec<Amount>,
    /// The combination of [`Start::combination`].
    pub combination: usize,
    /// The seed of the picture.
    pub seed: u32,
}

/// The result of a render.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The numbers of the picture.
    Made(Vec<f64>),
    /// The graph does not allow these values.
    Refused,
    /// The work was cancelled: no further result will come.
    Cancelled,
}

/// The render that is nearest to the photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Best {
    /// Its distance.
    pub distance: f64,
    /// The values of the unknowns.
    pub amounts: Vec<Amount>,
    /// The combination of [`Start::combination`].
    pub combination: usize,
}

/// The state of a fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Finished renders.
    pub done: usize,
    /// All renders, if nothing stops the fit early.
    pub planned: usize,
    /// The best render so far.
    pub best: Option<Best>,
    /// Distance between seeds, once it is known.
    pub floor: Option<f64>,
}

/// Something that renders and measures.
pub trait Renders {
    /// The outcomes of some pictures, in their order.
    fn render(&self, asks: &[Ask], status: &Status) -> Vec<Outcome>;

    /// The most pictures that one call of [`render`](Self::render) gets.
    fn at_once(&self) -> usize {
        usize::MAX
    }

    /// True if the fit should finish now.
    fn is_late(&self) -> bool {
        false
    }
}

/// Reasons why there is no fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// It was cancelled before there was a picture.
    Cancelled,
    /// The graph refused all values.
    AllRefused,
}
