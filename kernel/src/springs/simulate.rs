//! Runs a simulation of springs from start to end, on either path.

use super::grid::Grid;
use super::list::List;
use super::net::{Mass, Motion, Net, Outcome, SpringError};
use super::step::Stepper;
use crate::ground::real::Real;
use rayon::prelude::*;

/// Kinetic energy beyond this multiple of the initial energy counts as divergence: speeds are then a thousand times
/// those that the springs can give.
const RUNAWAY: f64 = 1e6;

/// Runs `motion` on `net` from `points` at rest. `on_step` is called with the number of each step before the step, and
/// returns whether to continue. O(steps · links).
///
/// # Errors
/// Returns an error if lengths of slices do not match, if the callback cancels the run, or if the motion diverges.
pub fn simulate<T: Real>(
    points: &[[T; 2]],
    net: &Net<'_, T>,
    motion: &Motion<T>,
    on_step: &mut dyn FnMut(u32) -> bool,
) -> Result<Outcome<T>, SpringError> {
    check(points.len(), net)?;
    let limit = 2.0 * start_energy(points, net) * largest_weight(points, net);
    let mut stepper = stepper(points, net, motion)?;
    // A run that may end at any step takes one step at a time.
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

/// Chooses the fast path if possible, else the general one.
fn stepper<'a, T: Real>(
    points: &[[T; 2]],
    net: &Net<'a, T>,
    motion: &Motion<T>,
) -> Result<Box<dyn Stepper<T> + 'a>, SpringError> {
    if let Some(shape) = net.grid.filter(|_| net.damping.is_empty() && net.pushes.is_empty())
        && let Some(numbers) = shape.numbers(net.links, net.wraps)
    {
        return Ok(Box::new(Grid::new(points, net, motion, shape, numbers)));
    }
    Ok(Box::new(List::new(points, net, motion)?))
}

/// Final length over initial length of each link; 1 where the initial length is 0.
pub fn stretch<T: Real>(before: &[[T; 2]], after: &[[T; 2]], net: &Net<'_, T>) -> Vec<T> {
    let ratio = |l| {
        let length = link_length(before, net, l);
        if length > T::default() { link_length(after, net, l) / length } else { T::ONE }
    };
    (0..net.links.len()).map(ratio).collect()
}

/// The force `|k (D - L)|` of each spring at `points`, as compared with the thresholds.
pub fn forces<T: Real>(points: &[[T; 2]], net: &Net<'_, T>) -> Vec<T> {
    let force = |l: usize| {
        let f = net.stiffness[l] * (link_length(points, net, l) - net.rest[l]);
        if f < T::default() { -f } else { f }
    };
    (0..net.links.len()).map(force).collect()
}

/// The current length of link `l`.
fn link_length<T: Real>(points: &[[T; 2]], net: &Net<'_, T>, l: usize) -> T {
    let [a, b] = net.links[l].map(|p| points[p as usize]);
    let [wx, wy] = net.wraps.get(l).map_or([0.0, 0.0], |w| w.map(f64::from));
    let dx = b[0] - a[0] + T::of(wx) * net.size[0];
    let dy = b[1] - a[1] + T::of(wy) * net.size[1];
    (dx * dx + dy * dy).sqrt()
}

/// Springs per partial sum of the energy.
const PART: usize = 1 << 14;

/// The initial energy of the springs, with a floor for rounding so that a net at rest does not "diverge".
fn start_energy<T: Real>(points: &[[T; 2]], net: &Net<'_, T>) -> f64 {
    let energy = |l: usize| {
        let (k, length) = (net.stiffness[l].wide(), link_length(points, net, l).wide());
        let stretch = length - net.rest[l].wide();
        let none = net.pushes.get(l) == Some(&true) && stretch > 0.0;
        if none { 0.0 } else { 0.5 * k * (stretch * stretch + 1e-6 * length * length) }
    };
    // Chunks of fixed size, summed in order: the same for any number of threads.
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
        // Points may move to positions with a smaller mass.
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
