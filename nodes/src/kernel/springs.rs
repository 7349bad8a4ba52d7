//! Virtual springs: points pulled about by springs along the links of a lattice.
//!
//! Source: JP4905282B2 §4 to §6, claims 13 to 16. A spring of stiffness k and natural length L between points D apart
//! pulls both with the force `F = k (D - L)` along the link and pushes when `D < L` (A34); `a = ΣF / m`; all points
//! start at rest and move from the same instant (A36). Beyond the plain case: masses, dampers, drag, breakage and
//! periodic lattices. Lengths are mm; stiffness, mass, drag and step only have meaning in the groups `k δ²/m` and
//! `drag δ/m`.
//!
//! Two paths give the same motion but sum the forces of a point in different orders: `springs_grid` for
//! lattices that are grids, with no index lists, and `springs_list` for all others. Each is deterministic for
//! any number of threads: work is cut into parts of fixed size and each part sums in a fixed order. Everything is
//! generic over [`Real`] so that the tests run the shipped code in double precision; only the inner loops of lists have a
//! variant for `f32` in wide instructions, `springs_wide`, which a test compares with the plain loops bit for bit.

use super::lattice::GridShape;
pub use super::real::Real;
use super::springs_step::Speed;
use rayon::prelude::*;

/// How position and velocity advance by one step δ (L-6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// The source's: `x += v δ + a δ²/2; v += a δ`. Gains energy, a factor `√(1 + ω²δ²/2)` a step.
    #[default]
    Explicit,
    /// `v += a δ; x += v δ`: keeps the energy while `ω δ < 2`.
    SemiImplicit,
}

/// Which springs can break (L-7).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BreakOn {
    /// Pulled and pushed springs: `|F| > threshold`.
    #[default]
    Either,
    /// Pulled springs only: `F > threshold`.
    Tension,
}

/// The masses of the points, each greater than 0.
#[derive(Clone, Copy, Default)]
pub enum Mass<'a, T> {
    /// 1 everywhere (A35).
    #[default]
    One,
    /// One mass per point, fixed at the start (A30).
    Each(&'a [T]),
    /// Read at the point's place in every step (A31); places may lie outside the canvas.
    Live(&'a (dyn Fn([T; 2]) -> T + Sync)),
}

/// A net of springs. Slices that are optional may be empty.
#[derive(Clone, Copy, Default)]
pub struct Net<'a, T> {
    /// The two ends of each spring, indices of points.
    pub links: &'a [[u32; 2]],
    /// Per spring the canvas offset of its second end, in canvases; optional.
    pub wraps: &'a [[i8; 2]],
    /// Size of the canvas in mm; used with `wraps`.
    pub size: [T; 2],
    /// Stiffness k per spring, ≥ 0.
    pub stiffness: &'a [T],
    /// Natural length L per spring in mm; may be negative.
    pub rest: &'a [T],
    /// Damper per spring: a force against the speed at which the link grows (A38); optional.
    pub damping: &'a [T],
    /// Force beyond which a spring breaks, ≥ 0 (A44, A45); infinity for never; optional.
    pub threshold: &'a [T],
    /// True for springs that only push: contacts between bodies (A40), whose rest length is the sum of their radii;
    /// optional.
    pub pushes: &'a [bool],
    /// True for points that stay (A42); optional.
    pub fixed: &'a [bool],
    /// Masses.
    pub mass: Mass<'a, T>,
    /// Set when points lie by rows of this shape: takes the fast path if all links are among those of
    /// [`super::lattice::grid_links`], in whatever order, and neither `damping` nor `pushes` is given.
    pub grid: Option<GridShape>,
}

/// How to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<T> {
    /// The step δ, > 0.
    pub step: T,
    /// Steps to run, K.
    pub steps: u32,
    /// The integrator.
    pub integrator: Integrator,
    /// Drag: a force `-drag v` on every point (A39), ≥ 0.
    pub drag: T,
    /// Which springs may break.
    pub break_on: BreakOn,
    /// Stops when no point is faster than this (A41); 0 runs all steps.
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

/// Where the points are after the run.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome<T> {
    /// Positions in mm, not wrapped into the canvas.
    pub positions: Vec<[T; 2]>,
    /// Velocities in mm per unit of time.
    pub velocities: Vec<[T; 2]>,
    /// Broken springs by step, then link.
    pub broken: Vec<Broken>,
    /// Steps that were run.
    pub steps: u32,
    /// Largest kinetic energy over the energy that the springs held at the start. Above 1 the integrator has made
    /// energy; above 1000 the picture hardly means anything.
    pub energy_growth: f64,
}

/// Why a run has no outcome.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SpringError {
    /// Numbers ran away.
    #[error("the motion diverged in step {step}: reduce the step or the stiffness, or add drag")]
    Diverged {
        /// The step, from 0.
        step: u32,
    },
    /// The callback said to stop.
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

/// Kinetic energy beyond this multiple of the energy at the start counts as divergence: speeds a thousand times
/// above any that the springs can give.
const RUNAWAY: f64 = 1e6;

/// A set of points and springs that can advance by a step.
pub(super) trait Stepper<T> {
    /// How many steps are best taken in one go.
    fn stride(&self) -> u32;
    /// Advances by so many steps, at most a stride, of which `step` is the first, adding what breaks. Returns what each
    /// step reports.
    fn advance(&mut self, step: u32, steps: u32, broken: &mut Vec<Broken>) -> Vec<Speed<T>>;
    /// Positions and velocities in the order of the input.
    fn finish(self: Box<Self>) -> [Vec<[T; 2]>; 2];
}

/// Runs `motion` on `net` from `points` at rest. `on_step` hears the number of each step before it runs and says
/// whether to go on. O(steps · links).
///
/// # Errors
/// When slices do not fit, when the callback stops the run, when the motion diverges.
pub fn simulate<T: Real>(
    points: &[[T; 2]],
    net: &Net<'_, T>,
    motion: &Motion<T>,
    on_step: &mut dyn FnMut(u32) -> bool,
) -> Result<Outcome<T>, SpringError> {
    check(points.len(), net)?;
    let limit = 2.0 * start_energy(points, net) * largest_weight(points, net);
    let mut stepper = stepper(points, net, motion)?;
    // A run that may end at any step takes one at a time.
    let stride = if motion.settle > T::default() { 1 } else { stepper.stride() };
    let (mut broken, mut done, mut fastest) = (Vec::new(), 0, 0.0f64);
    'run: while done < motion.steps {
        let steps = stride.min(motion.steps - done);
        if let Some(step) = (done..done + steps).find(|&step| !on_step(step)) {
            return Err(SpringError::Cancelled { step });
        }
        let start = broken.len();
        let speeds = stepper.advance(done, steps, &mut broken);
        broken[start..].sort_unstable();
        for speed in speeds {
            let sum = speed.sum();
            fastest = fastest.max(sum);
            // Written so that NaN counts as divergence.
            if !(sum.is_finite() && sum <= RUNAWAY * limit) {
                return Err(SpringError::Diverged { step: done });
            }
            done += 1;
            if speed.max().sqrt() < motion.settle.wide() {
                break 'run;
            }
        }
    }
    let [positions, velocities] = stepper.finish();
    let energy_growth = if limit > 0.0 { fastest / limit } else { 0.0 };
    Ok(Outcome { positions, velocities, broken, steps: done, energy_growth })
}

/// The fast path where it can be taken, or else the general one.
fn stepper<'a, T: Real>(
    points: &[[T; 2]],
    net: &Net<'a, T>,
    motion: &Motion<T>,
) -> Result<Box<dyn Stepper<T> + 'a>, SpringError> {
    if let Some(shape) = net.grid.filter(|_| net.damping.is_empty() && net.pushes.is_empty())
        && let Some(numbers) = shape.numbers(net.links, net.wraps)
    {
        return Ok(Box::new(super::springs_grid::Grid::new(points, net, motion, shape, numbers)));
    }
    Ok(Box::new(super::springs_list::List::new(points, net, motion)?))
}

/// Final length over initial length of each link; 1 where the initial length is 0.
pub fn stretch<T: Real>(before: &[[T; 2]], after: &[[T; 2]], net: &Net<'_, T>) -> Vec<T> {
    let ratio = |l| {
        let length = link_length(before, net, l);
        if length > T::default() { link_length(after, net, l) / length } else { T::ONE }
    };
    (0..net.links.len()).map(ratio).collect()
}

/// The force `|k (D - L)|` of each spring at `points`: what breakage thresholds are compared with.
pub fn forces<T: Real>(points: &[[T; 2]], net: &Net<'_, T>) -> Vec<T> {
    let force = |l: usize| {
        let f = net.stiffness[l] * (link_length(points, net, l) - net.rest[l]);
        if f < T::default() { -f } else { f }
    };
    (0..net.links.len()).map(force).collect()
}

/// The present length of link `l`.
fn link_length<T: Real>(points: &[[T; 2]], net: &Net<'_, T>, l: usize) -> T {
    let [a, b] = net.links[l].map(|p| points[p as usize]);
    let [wx, wy] = net.wraps.get(l).map_or([0.0, 0.0], |w| w.map(f64::from));
    let dx = b[0] - a[0] + T::of(wx) * net.size[0];
    let dy = b[1] - a[1] + T::of(wy) * net.size[1];
    (dx * dx + dy * dy).sqrt()
}

/// Springs whose energy is summed in one go.
const PART: usize = 1 << 14;

/// The energy of the springs at the start, with a floor for rounding so that a net at rest does not "diverge".
fn start_energy<T: Real>(points: &[[T; 2]], net: &Net<'_, T>) -> f64 {
    let energy = |l: usize| {
        let (k, length) = (net.stiffness[l].wide(), link_length(points, net, l).wide());
        let stretch = length - net.rest[l].wide();
        let none = net.pushes.get(l) == Some(&true) && stretch > 0.0;
        if none { 0.0 } else { 0.5 * k * (stretch * stretch + 1e-6 * length * length) }
    };
    // Parts of fixed size, summed in order: the same for any number of threads.
    let parts = (0..net.links.len().div_ceil(PART)).into_par_iter();
    let sum = |part: usize| -> f64 { (part * PART..((part + 1) * PART).min(net.links.len())).map(energy).sum() };
    parts.map(sum).collect::<Vec<_>>().into_iter().sum()
}

/// The largest 1/m.
fn largest_weight<T: Real>(points: &[[T; 2]], net: &Net<'_, T>) -> f64 {
    let of = |masses: &mut dyn Iterator<Item = T>| masses.map(|m| 1.0 / m.wide()).fold(0.0, f64::max);
    match net.mass {
        Mass::One => 1.0,
        Mass::Each(masses) => of(&mut masses.iter().copied()),
        // Points may come to lie on lighter places.
        Mass::Live(mass) => 10.0 * of(&mut points.iter().map(|&p| mass(p))),
    }
}

/// Checks the lengths of the slices and the ends of the links.
fn check<T: Real>(points: usize, net: &Net<'_, T>) -> Result<(), SpringError> {
    let links = net.links.len();
    let masses = if let Mass::Each(masses) = net.mass { masses.len() } else { points };
    let optional = |len: usize, expected| if len == 0 { expected } else { len };
    let rows = [
        ("stiffness", net.stiffness.len(), links),
        ("rest", net.rest.len(), links),
        ("wraps", optional(net.wraps.len(), links), links),
        ("damping", optional(net.damping.len(), links), links),
        ("threshold", optional(net.threshold.len(), links), links),
        ("pushes", optional(net.pushes.len(), links), links),
        ("fixed", optional(net.fixed.len(), points), points),
        ("mass", masses, points),
        ("grid", net.grid.map_or(points, |g| g.nx * g.ny), points),
    ];
    for (what, found, expected) in rows {
        if found != expected {
            return Err(SpringError::Length { what, found, expected });
        }
    }
    match net.links.iter().position(|l| l.iter().any(|&p| p as usize >= points)) {
        Some(link) => Err(SpringError::Link { link }),
        None => Ok(()),
    }
}
