//! Input and output of a simulation of springs.

use crate::leather::links::GridShape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_macros::choice;

/// Integrator: advances position and velocity by a step.
#[choice]
pub enum Integrator {
    /// The rule of the source. Gains energy with every step: needs few steps, or drag.
    // The source's: `x += v δ + a δ²/2; v += a δ`. Gains energy, a factor `√(1 + ω²δ²/2)` a step.
    #[default]
    Explicit,
    /// Velocity first, then position: energy stays about the same, even with larger steps.
    // `v += a δ; x += v δ`: keeps the energy while `ω δ < 2`.
    SemiImplicit,
}

/// Rest length of a spring, before `rest_length` is added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Rest {
    /// As in the source: every spring starts stretched by the pitch. The rest length is 0 for links along the rows and
    /// columns of a grid and (√2-1) · pitch for its diagonals; elsewhere it is the length at the start minus the mean
    /// of all lengths.
    #[default]
    Source,
    /// The length at the start minus the pitch times this factor.
    InitialMinus(f64),
    /// 0: the force at the start is stiffness times length, different for every link.
    Zero,
}

/// Springs that can break.
#[choice]
pub enum BreakOn {
    /// Pulled and pushed springs.
    // Pulled and pushed springs: `|F| > threshold`.
    #[default]
    Either,
    /// Pulled springs only.
    Tension,
}

/// The masses of the points, each greater than 0.
#[derive(Clone, Copy, Default)]
pub enum Mass<'a, T> {
    /// 1 everywhere.
    #[default]
    One,
    /// One mass per point, fixed at the start.
    Each(&'a [T]),
    /// Read at the point's position in every step; positions may be outside the canvas.
    Live(&'a (dyn Fn([T; 2]) -> T + Sync)),
}

/// A net of springs. Optional slices may be empty.
#[derive(Clone, Copy, Default)]
pub struct Net<'a, T> {
    /// The two ends of each spring, indices of points.
    pub links: &'a [[u32; 2]],
    /// Canvas offset of the second end of each spring, in canvases; optional.
    pub wraps: &'a [[i8; 2]],
    /// Size of the canvas in mm; used with `wraps`.
    pub size: [T; 2],
    /// Stiffness k per spring, ≥ 0.
    pub stiffness: &'a [T],
    /// Natural length L per spring in mm; may be negative.
    pub rest: &'a [T],
    /// Damper per spring: a force against the speed at which the link grows; optional.
    pub damping: &'a [T],
    /// Force beyond which a spring breaks, ≥ 0; infinity for never; optional.
    pub threshold: &'a [T],
    /// True for springs that only push: contacts between bodies, whose rest length is the sum of their radii; optional.
    pub pushes: &'a [bool],
    /// True for fixed points; optional.
    pub fixed: &'a [bool],
    /// Masses.
    pub mass: Mass<'a, T>,
    /// Set if points lie by rows of this shape: takes the fast path if all links are among those of
    /// [`crate::leather::links::grid_links`], in any order, and neither `damping` nor `pushes` is given.
    pub grid: Option<GridShape>,
}

/// Settings of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<T> {
    /// The step δ, > 0.
    pub step: T,
    /// Number of steps K.
    pub steps: u32,
    /// The integrator.
    pub integrator: Integrator,
    /// Drag: a force `-drag v` on every point, ≥ 0.
    pub drag: T,
    /// Springs that may break.
    pub break_on: BreakOn,
    /// Stops when no point is faster than this; 0 runs all steps.
    pub settle: T,
}

/// A spring that broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Broken {
    /// The step at whose start it broke, from 0.
    pub step: u32,
    /// Index into `links`.
    pub link: u32,
}

/// The result of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome<T> {
    /// Positions in mm, not wrapped into the canvas.
    pub positions: Vec<[T; 2]>,
    /// Velocities in mm per unit of time.
    pub velocities: Vec<[T; 2]>,
    /// Broken springs by step, then link.
    pub broken: Vec<Broken>,
    /// Number of steps that were run.
    pub steps: u32,
    /// Largest kinetic energy over the initial energy of the springs. Above 1 the integrator has gained energy; above
    /// 1000 the picture is hardly meaningful.
    pub energy_growth: f64,
}

/// Errors of a run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SpringError {
    /// The motion diverges: numbers become too large or are not finite.
    #[error("the motion diverged in step {step}: reduce the step or the stiffness, or add drag")]
    Diverged {
        /// The step, from 0.
        step: u32,
    },
    /// The callback cancelled the run.
    #[error("cancelled in step {step}")]
    Cancelled {
        /// The step, from 0.
        step: u32,
    },
    /// A slice has the wrong length.
    #[error("`{what}` has {found} entries; it must have {expected}")]
    Length {
        /// The field of [`Net`].
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length it must have.
        expected: usize,
    },
    /// A link names a point that does not exist.
    #[error("link {link} names a point that does not exist")]
    Link {
        /// Index into `links`.
        link: usize,
    },
    /// Too many links meet in one part of the lattice.
    #[error("too many links meet near point {point}: use a smaller radius")]
    Crowded {
        /// A point of that part.
        point: usize,
    },
}
