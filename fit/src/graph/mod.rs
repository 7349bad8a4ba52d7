//! Fits of graph files: from a graph and a photograph to a preset. The command and the Python module share it.
//!
//! [`Fitting::of`] prepares a fit, [`Fitting::run`] renders and searches, and [`Fitted`] has the values, the preset and the reports.
//! Nothing here writes to a file or to a terminal.
mod drawn;
mod evaluate;
mod light;
mod photo;
mod preset;
mod report;
mod setup;

pub use evaluate::{Fitting, StartDistance, Watch};
pub use light::Light;
pub use photo::Photo;
pub use preset::{Preset, name_for};

use crate::{Failure, Fit};
use shibo_bridge::Tools;
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure as Failed, Session};
use shibo_value::diagnostics::SourceMap;

/// Options of a fit.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// The output that is compared; `lit` if the graph has it, else the colour of its material.
    pub output: Option<String>,
    /// The name of the preset. A preset of this name is no value to begin with, because it will be replaced.
    pub preset: String,
    /// Fit only these parameters; all if empty.
    pub only: Vec<String>,
    /// Leave these parameters as they are.
    pub fixed: Vec<String>,
    /// The preset to begin with, or several: `a+b`.
    pub start: Option<String>,
    /// Values to begin with, in the notation of the command line.
    pub set: Vec<(String, String)>,
    /// The direction of the light.
    pub light: Light,
    /// Compare 256 × 256 pixels instead of 128 × 128.
    pub fine: bool,
    /// Finish after about this many seconds. The result then depends on the speed of the machine.
    pub seconds: Option<f64>,
    /// The most renders.
    pub renders: Option<u32>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// Threads that render; one per core if 0. The result does not depend on them.
    pub threads: usize,
}

impl Request {
    /// Checks numbers. The message names the option as the command does, with `prefix` before it: `--` or nothing.
    ///
    /// # Errors
    ///
    /// Fails if a number is not above 0.
    pub fn check(&self, prefix: &str, width_mm: Option<f64>) -> Result<(), Refused> {
        let dash = if prefix.is_empty() { "_" } else { "-" };
        for (name, value) in [(format!("width{dash}mm"), width_mm), ("seconds".to_owned(), self.seconds)] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(Refused::Usage(format!("{prefix}{name} is {value}; it must be a number above 0")));
            }
        }
        Ok(())
    }
}

/// All that fits need: kinds of nodes, a session with threads and caches, and a way to stop.
#[derive(Clone, Copy)]
pub struct Bench<'b> {
    /// The kinds of nodes, and the folders of imports.
    pub tools: &'b Tools,
    /// The session that renders.
    pub session: &'b Session,
    /// Stops the fit; the best values so far are the result.
    pub cancel: &'b CancelToken,
}

/// Reasons why there is no fit.
#[derive(Debug)]
pub enum Refused {
    /// The request is wrong.
    Usage(String),
    /// The photograph or the graph cannot be used; the message has the remedy.
    Unfit(String),
    /// The graph does not load, or cannot be rendered as it is.
    Graph(Failed, SourceMap),
    /// Cancelled before the first render.
    Cancelled,
}

impl From<Failure> for Refused {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Cancelled => Self::Cancelled,
            Failure::AllRefused => Self::Unfit(
                "the graph refused all values at this size of the canvas: give a larger width, or fix some parameters"
                    .to_owned(),
            ),
        }
    }
}

/// A finished fit.
pub struct Fitted<'f> {
    /// The unknowns and the photograph.
    pub fitting: &'f Fitting<'f>,
    /// The found values of the unknowns, and their distance.
    pub fit: Fit,
    /// Seconds of processor time.
    pub cpu: f64,
}
