//! What both paths of [`super::springs`] do alike: the pull of a link, the motion of a point, the sums of a step.

use super::springs::{BreakOn, Integrator, Mass, Motion, Net, Real};

/// Lanes of sums; fixed, whatever the machine has.
const LANES: usize = 8;
/// Speeds that are squared in one go.
const BLOCK: usize = 256;

/// What a step reports: `Σ v²`, and the square of the highest speed.
#[derive(Clone, Copy, Default)]
pub(super) struct Speed<T> {
    pub(super) sum: f64,
    pub(super) max: T,
}

impl<T: Real> Speed<T> {
    /// Takes in the speeds of more points.
    #[inline(always)]
    pub(super) fn add(&mut self, vx: &[T], vy: &[T]) {
        let mut squares = [T::default(); BLOCK];
        for (vx, vy) in vx.chunks(BLOCK).zip(vy.chunks(BLOCK)) {
            for ((square, &x), &y) in squares.iter_mut().zip(vx).zip(vy) {
                *square = x * x + y * y;
            }
            self.add_squares(&squares[..vx.len()]);
        }
    }

    /// Takes in the speeds of more points.
    #[inline(always)]
    pub(super) fn add_pairs(&mut self, v: &[[T; 2]]) {
        let mut squares = [T::default(); BLOCK];
        for v in v.chunks(BLOCK) {
            for (square, [x, y]) in squares.iter_mut().zip(v) {
                *square = *x * *x + *y * *y;
            }
            self.add_squares(&squares[..v.len()]);
        }
    }

    /// Takes in squares of speeds.
    #[inline(always)]
    fn add_squares(&mut self, squares: &[T]) {
        let (mut sum, mut max) = ([T::default(); LANES], [self.max; LANES]);
        let (chunks, rest) = squares.as_chunks::<LANES>();
        let mut add = |squares: &[T]| {
            for ((&square, sum), max) in squares.iter().zip(&mut sum).zip(&mut max) {
                *sum += square;
                *max = if square > *max { square } else { *max };
            }
        };
        for squares in chunks {
            add(squares);
        }
        add(rest);
        for lane in 0..LANES {
            self.sum += sum[lane].wide();
            self.max = if max[lane] > self.max { max[lane] } else { self.max };
        }
    }

    /// Takes in what another part of the points reports.
    pub(super) fn merge(&mut self, other: Self) {
        self.sum += other.sum;
        self.max = if other.max > self.max { other.max } else { self.max };
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

    /// What a push counts against a threshold, as a factor: as much as a pull, or nothing.
    pub(super) fn push_sign(&self) -> T {
        if self.break_on == BreakOn::Tension { T::ONE } else { -T::ONE }
    }
}

impl<T: Real> Mass<'_, T> {
    /// Reads the masses at the points' places, if they are to be read in every step; fixed points stay.
    pub(super) fn refresh(&self, weight: &mut [T], x: &[T], y: &[T]) {
        if let Self::Live(mass) = self {
            for (weight, (&x, &y)) in weight.iter_mut().zip(x.iter().zip(y)) {
                *weight = if *weight > T::default() { T::ONE / mass([x, y]) } else { *weight };
            }
        }
    }
}

/// The pull along a link whose second end is `(dx, dy)` from the first, and its force `k (D - L)`; none between points
/// in the same place (L-8).
#[inline(always)]
pub(super) fn pull<T: Real>([dx, dy]: [T; 2], k: T, rest: T) -> ([T; 2], T) {
    let d = (dx * dx + dy * dy).sqrt();
    let force = k * (d - rest);
    let s = force / if d > T::default() { d } else { T::ONE };
    ([s * dx, s * dy], if d > T::default() { force } else { T::default() })
}

/// What is compared with the thresholds, given a force and [`Motion::push_sign`].
#[inline(always)]
pub(super) fn size<T: Real>(force: T, sign: T) -> T {
    force.larger(sign * force)
}

/// Per point 1/m, or 0 for fixed points.
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
