//! One row of a grid of springs, see [`super::grid`]. One vectorised loop computes the forces of the springs that start
//! there, all directions at once; a second loop sums the forces at each point and moves it.
//!
//! Row lengths are multiples of [`LANES`], so that no loop has a remainder; springs of columns beyond the lattice have
//! stiffness 0 and so no force.

use super::net::Motion;
use super::step::{pull, size};
use crate::ground::real::Real;
use crate::leather::links::DIRECTIONS;

/// Row lengths are multiples of this.
pub(super) const LANES: usize = 8;

/// Padding columns at either end of a row of positions or pulls.
pub(super) const PAD: usize = LANES;

/// The forces of the springs that start in a row, by direction and axis, with `PAD` more columns at either end.
pub(super) type Pulls<T> = [[Vec<T>; 2]; 4];

/// A row of points, the springs that start there, and the row below.
pub(super) struct Springs<'s, T> {
    /// Positions along x and y, with `PAD` more columns at either end.
    pub(super) place: [&'s mut [T]; 2],
    /// The same of the row below, as continued from this row.
    pub(super) below: [&'s [T]; 2],
    pub(super) velocity: [&'s mut [T]; 2],
    pub(super) weight: &'s [T],
    /// By direction; so are the next two. Entries of directions that the lattice does not have are not read.
    pub(super) stiffness: [&'s mut [T]; 4],
    pub(super) rest: [&'s [T]; 4],
    /// Empty if no spring can break.
    pub(super) threshold: [&'s [T]; 4],
    pub(super) motion: &'s Motion<T>,
    /// True if there are diagonals.
    pub(super) eight: bool,
    /// Number of columns of the lattice.
    pub(super) columns: usize,
}

impl<T: Real> Springs<'_, T> {
    /// Computes the forces and, if `moves`, moves the points. By axis, `carry` holds the forces on this row from the
    /// springs of the row above, and afterwards those on the row below. `snap` is called with direction and column of
    /// the springs that break.
    #[inline(always)]
    pub(super) fn advance(
        &mut self,
        pulls: &mut Pulls<T>,
        carry: &mut [Vec<T>; 2],
        moves: bool,
        mut snap: impl FnMut(usize, usize),
    ) {
        if self.pull_all(pulls) {
            self.snap(&mut snap);
            self.pull_all(pulls);
        }
        // Forces wrap around the ends; on a lattice that is not periodic these springs have no stiffness.
        for row in pulls.iter_mut().take(if self.eight { 4 } else { 1 }).flatten() {
            (row[PAD - 1], row[PAD + self.columns]) = (row[PAD + self.columns - 1], row[PAD]);
        }
        for (axis, carry) in carry.iter_mut().enumerate() {
            let pulls = [&pulls[0][axis][..], &pulls[1][axis][..], &pulls[2][axis][..], &pulls[3][axis][..]];
            let (x, v, weight) = (&mut *self.place[axis], &mut *self.velocity[axis], self.weight);
            match (self.eight, moves) {
                (true, true) => settle::<T, true, true>(self.motion, pulls, weight, carry, x, v),
                (true, false) => settle::<T, true, false>(self.motion, pulls, weight, carry, x, v),
                (false, true) => settle::<T, false, true>(self.motion, pulls, weight, carry, x, v),
                (false, false) => settle::<T, false, false>(self.motion, pulls, weight, carry, x, v),
            }
        }
    }

    /// Computes the forces; returns whether any is beyond its threshold.
    #[inline(always)]
    fn pull_all(&self, pulls: &mut Pulls<T>) -> bool {
        let [[x0, y0], [x1, y1], [x2, y2], [x3, y3]] = pulls;
        match (self.eight, !self.threshold[0].is_empty()) {
            (true, false) => pull_row::<T, true, false>(self, x0, y0, x1, y1, x2, y2, x3, y3),
            (true, true) => pull_row::<T, true, true>(self, x0, y0, x1, y1, x2, y2, x3, y3),
            (false, false) => pull_row::<T, false, false>(self, x0, y0, x1, y1, x2, y2, x3, y3),
            (false, true) => pull_row::<T, false, true>(self, x0, y0, x1, y1, x2, y2, x3, y3),
        }
    }

    /// Breaks the springs that are beyond their thresholds, by setting their stiffness to 0.
    #[inline(always)]
    fn snap(&mut self, snap: &mut impl FnMut(usize, usize)) {
        for (dir, (dx, down)) in DIRECTIONS.into_iter().enumerate().take(if self.eight { 4 } else { 2 }) {
            for i in 0..self.columns {
                let to = (i + PAD).wrapping_add_signed(isize::from(dx));
                let end = |axis: usize| if down { self.below[axis][to] } else { self.place[axis][to] };
                let along = [0, 1].map(|axis| end(axis) - self.place[axis][i + PAD]);
                let k = &mut self.stiffness[dir][i];
                let force = pull(along, *k, self.rest[dir][i]).1;
                if size(force, self.motion.push_sign()) > self.threshold[dir][i] && *k != T::default() {
                    *k = T::default();
                    snap(dir, i);
                }
            }
        }
    }
}

/// Computes the forces of the springs of a row along x and y, for four directions at once, like [`super::step::pull`].
/// Returns whether any force is beyond its threshold. Every output is a separate argument: only then does the compiler
/// know that they do not overlap.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "see above")]
fn pull_row<T: Real, const EIGHT: bool, const BREAK: bool>(
    row: &Springs<'_, T>,
    x0: &mut [T],
    y0: &mut [T],
    x1: &mut [T],
    y1: &mut [T],
    x2: &mut [T],
    y2: &mut [T],
    x3: &mut [T],
    y3: &mut [T],
) -> bool {
    let n = row.weight.len() / LANES * LANES;
    // Written out: array methods with closures would not be inlined into functions with the vector instructions.
    let ([x, y], [below_x, below_y]) = (&row.place, row.below);
    let (hx, hy) = (&x[PAD..][..n], &y[PAD..][..n]);
    let (ex, ey) = (&x[PAD + 1..][..n], &y[PAD + 1..][..n]);
    let (lx, ly) = (&below_x[PAD - 1..][..n], &below_y[PAD - 1..][..n]);
    let (mx, my) = (&below_x[PAD..][..n], &below_y[PAD..][..n]);
    let (rx, ry) = (&below_x[PAD + 1..][..n], &below_y[PAD + 1..][..n]);
    let [k0, k1, k2, k3] = &row.stiffness;
    let diagonals = if EIGHT { n } else { 0 };
    let k = [&k0[..n], &k1[..n], &k2[..diagonals], &k3[..diagonals]];
    let [l0, l1, l2, l3] = row.rest;
    let rest = [&l0[..n], &l1[..n], &l2[..n], &l3[..n]];
    let limits = if BREAK { n } else { 0 };
    let [t0, t1, t2, t3] = row.threshold;
    let threshold = [&t0[..limits], &t1[..limits], &t2[..limits], &t3[..limits]];
    let (x0, y0, x1, y1) = (&mut x0[PAD..][..n], &mut y0[PAD..][..n], &mut x1[PAD..][..n], &mut y1[PAD..][..n]);
    let (x2, y2, x3, y3) = (&mut x2[PAD..][..n], &mut y2[PAD..][..n], &mut x3[PAD..][..n], &mut y3[PAD..][..n]);
    let (zero, sign) = (T::default(), row.motion.push_sign());
    let directions = if EIGHT { 4 } else { 2 };
    let mut any = 0u32;
    for i in 0..n {
        let (x, y) = (hx[i], hy[i]);
        let dx = [ex[i] - x, mx[i] - x, if EIGHT { rx[i] - x } else { zero }, if EIGHT { lx[i] - x } else { zero }];
        let dy = [ey[i] - y, my[i] - y, if EIGHT { ry[i] - y } else { zero }, if EIGHT { ly[i] - y } else { zero }];
        let (mut d, mut s) = ([zero; 4], [zero; 4]);
        for dir in 0..directions {
            d[dir] = dx[dir] * dx[dir] + dy[dir] * dy[dir];
        }
        for d in &mut d {
            *d = d.sqrt();
        }
        for dir in 0..directions {
            let force = k[dir][i] * (d[dir] - rest[dir][i]);
            if BREAK {
                any |= u32::from((size(force, sign) > threshold[dir][i]) & (d[dir] > zero));
            }
            s[dir] = force / if d[dir] > zero { d[dir] } else { T::ONE };
        }
        (x0[i], y0[i]) = (s[0] * dx[0], s[0] * dy[0]);
        (x1[i], y1[i]) = (s[1] * dx[1], s[1] * dy[1]);
        if EIGHT {
            (x2[i], y2[i]) = (s[2] * dx[2], s[2] * dy[2]);
            (x3[i], y3[i]) = (s[3] * dx[3], s[3] * dy[3]);
        }
    }
    any != 0
}

/// Sums the forces of the springs of a row along one axis at its points and at those of the row below; `carry` holds
/// those of the row above. Moves the points if `MOVE`.
#[inline(always)]
fn settle<T: Real, const EIGHT: bool, const MOVE: bool>(
    motion: &Motion<T>,
    pulls: [&[T]; 4],
    weight: &[T],
    carry: &mut [T],
    x: &mut [T],
    v: &mut [T],
) {
    let n = weight.len() / LANES * LANES;
    let (e, s) = (&pulls[0][PAD..][..n], &pulls[1][PAD..][..n]);
    let (se, sw) = (&pulls[2][PAD..][..n], &pulls[3][PAD..][..n]);
    let (e_left, se_left) = (&pulls[0][PAD - 1..][..n], &pulls[2][PAD - 1..][..n]);
    let sw_right = &pulls[3][PAD + 1..][..n];
    let (weight, carry) = (&weight[..n], &mut carry[..n]);
    let (x, v) = if MOVE { (&mut x[PAD..][..n], &mut v[..n]) } else { (x, v) };
    for i in 0..n {
        if MOVE {
            let starting = if EIGHT { e[i] + s[i] + (se[i] + sw[i]) } else { e[i] + s[i] };
            let (mut place, mut velocity) = (x[i], v[i]);
            motion.advance(carry[i] + (starting - e_left[i]), weight[i], &mut place, &mut velocity);
            (x[i], v[i]) = (place, velocity);
        }
        carry[i] = -if EIGHT { s[i] + (se_left[i] + sw_right[i]) } else { s[i] };
    }
}
