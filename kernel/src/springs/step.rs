//! Shared by both paths of [`super::simulate`]: the force of a spring, the motion of a point, the sums of a step.

use super::net::{BreakOn, Broken, Integrator, Mass, Motion, Net};
use crate::ground::real::Real;

/// A set of points and springs that can advance by steps.
pub(super) trait Stepper<T> {
    /// Best number of steps per call.
    fn stride(&self) -> u32;
    /// Advances by `steps` steps, at most a stride, of which `step` is the first, and adds broken springs. Returns the
    /// speeds of each step.
    fn advance(&mut self, step: u32, steps: u32, broken: &mut Vec<Broken>) -> Vec<Speed<T>>;
    /// Positions and velocities in the order of the input.
    fn finish(self: Box<Self>) -> [Vec<[T; 2]>; 2];
}

/// Number of lanes of sums; the same on every machine.
const LANES: usize = 8;
/// Number of independent sums of lanes, so that no addition waits for the one before.
const SUMS: usize = 4;
/// Count of numbers that are summed before the sums are widened.
const BLOCK: usize = 1024;

/// Report of a step: `Σ v²`, and the square of the highest speed if the run may end by it.
#[derive(Clone, Copy)]
pub(super) struct Speed<T> {
    sums: [f64; LANES],
    max: T,
}

impl<T: Real> Default for Speed<T> {
    fn default() -> Self {
        Self { sums: [0.0; LANES], max: T::default() }
    }
}

impl<T: Real> Speed<T> {
    /// Adds velocities, as components in any order, to the sum.
    #[inline(always)]
    pub(super) fn add(&mut self, v: &[T]) {
        for v in v.chunks(BLOCK) {
            let mut sums = [[T::default(); LANES]; SUMS];
            let (chunks, rest) = v.as_chunks::<LANES>();
            let (many, chunks) = chunks.as_chunks::<SUMS>();
            for v in many {
                for s in 0..SUMS {
                    for l in 0..LANES {
                        sums[s][l] += v[s][l] * v[s][l];
                    }
                }
            }
            for (sums, v) in sums.iter_mut().zip(chunks.iter().map(|v| &v[..]).chain([rest])) {
                for (sum, &v) in sums.iter_mut().zip(v) {
                    *sum += v * v;
                }
            }
            for (l, total) in self.sums.iter_mut().enumerate() {
                *total += ((sums[0][l] + sums[1][l]) + (sums[2][l] + sums[3][l])).wide();
            }
        }
    }

    /// Adds velocities to the maximum.
    #[inline(always)]
    pub(super) fn fastest(&mut self, velocities: impl Iterator<Item = [T; 2]>) {
        for [x, y] in velocities {
            self.max = (x * x + y * y).larger(self.max);
        }
    }

    /// Adds the report of another part of the points.
    pub(super) fn merge(&mut self, other: Self) {
        for (total, sum) in self.sums.iter_mut().zip(other.sums) {
            *total += sum;
        }
        self.max = other.max.larger(self.max);
    }

    /// `Σ v²`.
    pub(super) fn sum(&self) -> f64 {
        self.sums.iter().sum()
    }

    /// The square of the highest speed.
    pub(super) fn max(&self) -> f64 {
        self.max.wide()
    }
}

impl<T: Real> Motion<T> {
    /// Advances one coordinate of a point by a step.
    #[inline(always)]
    pub(super) fn advance(&self, force: T, weight: T, x: &mut T, v: &mut T) {
        let a = (force - self.drag * *v) * weight;
        let faster = *v + a * self.step;
        *x += match self.integrator {
            Integrator::Explicit => *v * self.step + T::HALF * a * self.step * self.step,
            Integrator::SemiImplicit => faster * self.step,
        };
        *v = faster;
    }

    /// The factor for [`size`]: with -1 a push counts against a threshold as much as a pull, with 1 not at all.
    pub(super) fn push_sign(&self) -> T {
        if self.break_on == BreakOn::Tension { T::ONE } else { -T::ONE }
    }
}

impl<T: Real> Mass<'_, T> {
    /// Reads the masses at the points' positions, if they are to be read in every step; fixed points keep theirs.
    pub(super) fn refresh(&self, weight: &mut [T], x: &[T], y: &[T]) {
        if let Self::Live(mass) = self {
            for (weight, (&x, &y)) in weight.iter_mut().zip(x.iter().zip(y)) {
                *weight = if *weight > T::default() { T::ONE / mass([x, y]) } else { *weight };
            }
        }
    }
}

/// The pull along a link whose second end is `(dx, dy)` from the first, and its force `k (D - L)`. The pull is 0
/// between points at the same position, for which the source gives no direction.
#[inline(always)]
pub(super) fn pull<T: Real>([dx, dy]: [T; 2], k: T, rest: T) -> ([T; 2], T) {
    let d = (dx * dx + dy * dy).sqrt();
    let force = k * (d - rest);
    let s = force / if d > T::default() { d } else { T::ONE };
    ([s * dx, s * dy], if d > T::default() { force } else { T::default() })
}

/// The value compared with the thresholds, from a force and [`Motion::push_sign`].
#[inline(always)]
pub(super) fn size<T: Real>(force: T, sign: T) -> T {
    force.larger(sign * force)
}

/// 1/m of each point, or 0 for fixed points.
pub(super) fn weights<T: Real>(points: &[[T; 2]], net: &Net<'_, T>) -> Vec<T> {
    let weight = |(i, &p): (usize, &[T; 2])| {
        if net.fixed.get(i) == Some(&true) {
            return T::default();
        }
        match net.mass {
            Mass::One => T::ONE,
            Mass::Each(masses) => T::ONE / masses[i],
            Mass::Live(mass) => T::ONE / mass(p),
        }
    };
    points.iter().enumerate().map(weight).collect()
}
