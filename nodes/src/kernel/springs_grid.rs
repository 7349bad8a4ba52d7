//! Springs on a grid: the same motion as [`super::springs_list`] without index lists.
//!
//! Positions, velocities and spring constants lie in arrays by row; the springs of a row to its right and to the row
//! below are computed once, all directions in one vectorised loop, and a second loop sums what pulls at each point and
//! moves it. Rows are worked through in bands in parallel. A band updates its rows in place, which saves memory traffic: it reads copies of the rows next to it,
//! taken before the step, and computes the springs that come down from the row above it for itself. Those are the same
//! numbers as in that row's own band, so the result does not depend on the cut.

use super::lattice::{DIRECTIONS, GridShape};
use super::springs::{Broken, Mass, Motion, Net, Real, Stepper};
use super::springs_step::{Speed, pull, size, weights};
use rayon::prelude::*;

/// Rows per band.
const BAND: usize = 32;

/// A quantity of the springs of one direction, by point: the spring that starts there.
enum Table<T> {
    /// The same for all, stored as one row.
    Uniform(Vec<T>),
    /// Rows from the top.
    Each(Vec<T>),
}

impl<T: Real> Table<T> {
    fn new(values: Vec<T>, real: &[bool], nx: usize) -> Self {
        let mut of_springs = values.iter().zip(real).filter(|&(_, &real)| real).map(|(v, _)| *v);
        let first = of_springs.next().unwrap_or_default();
        if of_springs.all(|v| v == first) { Self::Uniform(vec![first; nx]) } else { Self::Each(values) }
    }

    fn row(&self, row: usize, nx: usize) -> &[T] {
        match self {
            Self::Uniform(row) => row,
            Self::Each(rows) => &rows[row * nx..][..nx],
        }
    }
}

/// What all bands read.
struct Shared<'a, T> {
    shape: GridShape,
    size: [T; 2],
    rest: Vec<Table<T>>,
    threshold: Option<Vec<Table<T>>>,
    motion: Motion<T>,
    mass: Mass<'a, T>,
}

/// The rows that a band owns, and copies of its neighbours.
struct Band<T> {
    first: usize,
    x: Vec<T>,
    y: Vec<T>,
    vx: Vec<T>,
    vy: Vec<T>,
    weight: Vec<T>,
    /// Stiffness by direction; the first row is that of the row above the band, whose springs reach into it.
    stiffness: Vec<Vec<T>>,
    /// x and y of the row above and of the row below, from before the step.
    above: [Vec<T>; 2],
    below: [Vec<T>; 2],
}

/// The rows that are being worked on; positions and pulls have a column more at either end.
struct Scratch<T> {
    here: [Vec<T>; 2],
    next: [Vec<T>; 2],
    /// By direction and axis: how the springs that start in the row pull there.
    pull: [[Vec<T>; 2]; 4],
    /// By axis: how the springs from the row above pull at the row.
    carry: [Vec<T>; 2],
    size: Vec<T>,
}

/// A grid of springs in motion.
pub(super) struct Grid<'a, T> {
    shared: Shared<'a, T>,
    bands: Vec<Band<T>>,
    /// Index into the links by direction and point.
    ids: Vec<Vec<u32>>,
}

impl<'a, T: Real> Grid<'a, T> {
    /// Points by rows and links in the order of [`super::lattice::grid_links`]; lengths have been checked.
    pub(super) fn new(points: &[[T; 2]], net: &Net<'a, T>, motion: &Motion<T>, shape: GridShape) -> Self {
        let (nx, ny, dirs) = (shape.nx, shape.ny, shape.directions());
        let mut ids = vec![vec![u32::MAX; nx * ny]; dirs];
        for (id, (point, dir)) in (0u32..).zip(shape.slots()) {
            ids[dir][point] = id;
        }
        let spread = |values: &[T], dir: usize| -> Vec<T> {
            ids[dir].iter().map(|&id| values.get(id as usize).copied().unwrap_or_default()).collect()
        };
        let table = |values: &[T]| -> Vec<Table<T>> {
            let real = |dir: usize| ids[dir].iter().map(|&id| id != u32::MAX).collect::<Vec<_>>();
            (0..dirs).map(|dir| Table::new(spread(values, dir), &real(dir), nx)).collect()
        };
        let stiffness: Vec<Vec<T>> = (0..dirs).map(|dir| spread(net.stiffness, dir)).collect();
        let weight = weights(points, net);
        let band = |first: usize| {
            let (from, to) = (first * nx, (first + BAND).min(ny) * nx);
            let above = (first + ny - 1) % ny * nx;
            let with_above = |k: &Vec<T>| [&k[above..][..nx], &k[from..to]].concat();
            Band {
                first,
                x: points[from..to].iter().map(|p| p[0]).collect(),
                y: points[from..to].iter().map(|p| p[1]).collect(),
                vx: vec![T::default(); to - from],
                vy: vec![T::default(); to - from],
                weight: weight[from..to].to_vec(),
                stiffness: stiffness.iter().map(with_above).collect(),
                above: [vec![T::default(); nx], vec![T::default(); nx]],
                below: [vec![T::default(); nx], vec![T::default(); nx]],
            }
        };
        let bands = (0..ny).step_by(BAND).map(band).collect();
        let threshold = (!net.threshold.is_empty()).then(|| table(net.threshold));
        let shared =
            Shared { shape, size: net.size, rest: table(net.rest), threshold, motion: *motion, mass: net.mass };
        Self { shared, bands, ids }
    }

    /// Hands every band copies of the rows above and below it.
    fn exchange(&mut self) {
        let (count, nx) = (self.bands.len(), self.shared.shape.nx);
        for b in 0..count {
            let (up, down) = ((b + count - 1) % count, (b + 1) % count);
            let last = self.bands[up].x.len() - nx;
            for axis in 0..2 {
                let mut above = std::mem::take(&mut self.bands[b].above[axis]);
                let mut below = std::mem::take(&mut self.bands[b].below[axis]);
                let of = |band: usize| if axis == 0 { &self.bands[band].x } else { &self.bands[band].y };
                above.copy_from_slice(&of(up)[last..]);
                below.copy_from_slice(&of(down)[..nx]);
                (self.bands[b].above[axis], self.bands[b].below[axis]) = (above, below);
            }
        }
    }
}

impl<T: Real> Stepper<T> for Grid<'_, T> {
    fn advance(&mut self, step: u32, broken: &mut Vec<Broken>) -> Speed<T> {
        self.exchange();
        let (shared, ids, nx) = (&self.shared, &self.ids, self.shared.shape.nx);
        let arch = pulp::Arch::new();
        let advance = |scratch: &mut Scratch<T>, band: &mut Band<T>| {
            let mut snapped = Vec::new();
            let speed = arch.dispatch(Advance { shared, band, scratch, snapped: &mut snapped });
            (speed, snapped)
        };
        let new_scratch = || Scratch::new(nx);
        let reports: Vec<_> = self.bands.par_iter_mut().map_init(new_scratch, advance).collect();
        let mut total = Speed::default();
        for (speed, snapped) in reports {
            total.merge(speed);
            broken.extend(snapped.iter().map(|&(dir, point)| Broken { step, link: ids[dir][point] }));
        }
        total
    }

    fn finish(self: Box<Self>) -> [Vec<[T; 2]>; 2] {
        let pair = |(x, y): (&T, &T)| [*x, *y];
        let positions = self.bands.iter().flat_map(|b| b.x.iter().zip(&b.y).map(pair)).collect();
        let velocities = self.bands.iter().flat_map(|b| b.vx.iter().zip(&b.vy).map(pair)).collect();
        [positions, velocities]
    }
}

impl<T: Real> Scratch<T> {
    fn new(nx: usize) -> Self {
        let row = |_| vec![T::default(); nx + 2];
        let pair = |_| std::array::from_fn(row);
        Self { here: pair(0), next: pair(0), pull: std::array::from_fn(pair), carry: pair(0), size: row(0) }
    }
}

/// Copies a row, adding `offset`, and its periodic continuation by a column at either end.
#[inline(always)]
fn load_row<T: Real>(into: &mut [T], row: &[T], offset: T, size: T) {
    let n = row.len();
    for (to, from) in into[1..=n].iter_mut().zip(row) {
        *to = *from + offset;
    }
    into[0] = into[n] - size;
    into[n + 1] = into[1] + size;
}

/// A call of [`advance_band`] for [`pulp::Arch::dispatch`]: a closure would not be inlined into the function that has
/// the vector instructions.
struct Advance<'j, 'a, T> {
    shared: &'j Shared<'a, T>,
    band: &'j mut Band<T>,
    scratch: &'j mut Scratch<T>,
    snapped: &'j mut Vec<(usize, usize)>,
}

impl<T: Real> pulp::WithSimd for Advance<'_, '_, T> {
    type Output = Speed<T>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Speed<T> {
        advance_band(self.shared, self.band, self.scratch, self.snapped)
    }
}

/// Advances one band by a step; `snapped` receives direction and point of the springs that break in its own rows.
#[inline(always)]
fn advance_band<T: Real>(
    shared: &Shared<'_, T>,
    band: &mut Band<T>,
    scratch: &mut Scratch<T>,
    snapped: &mut Vec<(usize, usize)>,
) -> Speed<T> {
    let (nx, ny) = (shared.shape.nx, shared.shape.ny);
    let rows = band.x.len() / nx;
    let mut speed = Speed::default();
    let size = |axis: usize| if axis == 0 { shared.size[0] } else { T::default() };
    for axis in 0..2 {
        load_row(&mut scratch.next[axis], &band.above[axis], T::default(), size(axis));
    }
    for line in 0..=rows {
        let row = (band.first + line + ny - 1) % ny;
        std::mem::swap(&mut scratch.here, &mut scratch.next);
        for axis in 0..2 {
            let own = if axis == 0 { &band.x } else { &band.y };
            let below = if line < rows { &own[line * nx..][..nx] } else { &band.below[axis][..] };
            let offset = if axis == 1 && row + 1 == ny { shared.size[1] } else { T::default() };
            load_row(&mut scratch.next[axis], below, offset, size(axis));
        }
        if line == 1 && row == 0 {
            // The first row was loaded as what lies below the last; in its own right it is at its own place.
            for axis in 0..2 {
                let own = if axis == 0 { &band.x } else { &band.y };
                load_row(&mut scratch.here[axis], &own[..nx], T::default(), size(axis));
            }
        }
        if pull_row(shared, (row, line), band, scratch) {
            snap(shared, (row, line), band, scratch, snapped);
            pull_row(shared, (row, line), band, scratch);
        }
        if line > 0 {
            settle_row::<T, true>(shared, band, scratch, line - 1);
            let range = (line - 1) * nx..line * nx;
            speed.add(&band.vx[range.clone()], &band.vy[range]);
        } else {
            settle_row::<T, false>(shared, band, scratch, 0);
        }
    }
    speed
}

/// The pull along a link, whose force is compared with `[threshold, sign]` if it may break.
#[inline(always)]
fn link<T: Real, const BREAK: bool>(
    from: [T; 2],
    to: [T; 2],
    [k, rest]: [T; 2],
    [threshold, sign]: [T; 2],
    any: &mut u32,
) -> [T; 2] {
    let (pull, force) = pull([to[0] - from[0], to[1] - from[1]], k, rest);
    if BREAK {
        *any |= u32::from(size(force, sign) > threshold);
    }
    pull
}

/// The springs that start in a row: positions of their ends, and by direction what they are like.
struct Row<'s, T> {
    here: [&'s [T]; 2],
    next: [&'s [T]; 2],
    stiffness: [&'s [T]; 4],
    rest: [&'s [T]; 4],
    threshold: [&'s [T]; 4],
    sign: T,
}

/// How the springs that start in a row pull there, by direction along x and y, and whether any is beyond its
/// threshold. What is written are arguments of their own: only then does the compiler see that nothing overlaps.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "see above")]
fn pulls<T: Real, const EIGHT: bool, const BREAK: bool>(
    row: &Row<'_, T>,
    n: usize,
    x0: &mut [T],
    y0: &mut [T],
    x1: &mut [T],
    y1: &mut [T],
    x2: &mut [T],
    y2: &mut [T],
    x3: &mut [T],
    y3: &mut [T],
) -> bool {
    let [hx, hy] = row.here.map(|row| &row[1..][..n]);
    let [ex, ey] = row.here.map(|row| &row[2..][..n]);
    let [lx, ly] = row.next.map(|row| &row[..n]);
    let [mx, my] = row.next.map(|row| &row[1..][..n]);
    let [rx, ry] = row.next.map(|row| &row[2..][..n]);
    let (k, rest) = (row.stiffness.map(|k| &k[..n]), row.rest.map(|rest| &rest[..n]));
    let threshold = row.threshold.map(|threshold| if BREAK { &threshold[..n] } else { threshold });
    let (x0, y0, x1, y1) = (&mut x0[..n], &mut y0[..n], &mut x1[..n], &mut y1[..n]);
    let (x2, y2, x3, y3) = (&mut x2[..n], &mut y2[..n], &mut x3[..n], &mut y3[..n]);
    let limit = |dir: usize, i: usize| if BREAK { [threshold[dir][i], row.sign] } else { [T::default(); 2] };
    let mut any = 0u32;
    for i in 0..n {
        let here = [hx[i], hy[i]];
        [x0[i], y0[i]] = link::<T, BREAK>(here, [ex[i], ey[i]], [k[0][i], rest[0][i]], limit(0, i), &mut any);
        [x1[i], y1[i]] = link::<T, BREAK>(here, [mx[i], my[i]], [k[1][i], rest[1][i]], limit(1, i), &mut any);
        if EIGHT {
            [x2[i], y2[i]] = link::<T, BREAK>(here, [rx[i], ry[i]], [k[2][i], rest[2][i]], limit(2, i), &mut any);
            [x3[i], y3[i]] = link::<T, BREAK>(here, [lx[i], ly[i]], [k[3][i], rest[3][i]], limit(3, i), &mut any);
        }
    }
    any != 0
}

/// Fills `scratch.pull` with the springs that start in `row`, the band's own number `line`. Says whether any is beyond
/// its threshold.
#[inline(always)]
fn pull_row<T: Real>(
    shared: &Shared<'_, T>,
    (row, line): (usize, usize),
    band: &Band<T>,
    scratch: &mut Scratch<T>,
) -> bool {
    let (n, eight) = (shared.shape.nx, shared.shape.eight);
    // What stands for directions that the lattice does not have is not read.
    let directions = if eight { [0, 1, 2, 3] } else { [0, 1, 0, 1] };
    let springs = Row {
        here: scratch.here.each_ref().map(|row| &row[..]),
        next: scratch.next.each_ref().map(|row| &row[..]),
        stiffness: directions.map(|dir| &band.stiffness[dir][line * n..][..n]),
        rest: directions.map(|dir| shared.rest[dir].row(row, n)),
        threshold: directions.map(|dir| shared.threshold.as_ref().map_or(&[][..], |tables| tables[dir].row(row, n))),
        sign: shared.motion.push_sign(),
    };
    let pull = &mut scratch.pull;
    let [[x0, y0], [x1, y1], [x2, y2], [x3, y3]] = pull.each_mut().map(|p| p.each_mut().map(|p| &mut p[1..=n]));
    let any = match (eight, shared.threshold.is_some()) {
        (true, false) => pulls::<T, true, false>(&springs, n, x0, y0, x1, y1, x2, y2, x3, y3),
        (true, true) => pulls::<T, true, true>(&springs, n, x0, y0, x1, y1, x2, y2, x3, y3),
        (false, false) => pulls::<T, false, false>(&springs, n, x0, y0, x1, y1, x2, y2, x3, y3),
        (false, true) => pulls::<T, false, true>(&springs, n, x0, y0, x1, y1, x2, y2, x3, y3),
    };
    // What falls off one end belongs to the other: on a lattice that is not periodic these springs have no k.
    for row in pull.iter_mut().flatten() {
        (row[0], row[n + 1]) = (row[n], row[1]);
    }
    any
}

/// What the springs of one direction are compared with their thresholds by.
#[inline(always)]
fn sizes<T: Real>(here: [&[T]; 2], to: [&[T]; 2], [k, rest]: [&[T]; 2], sign: T, sizes: &mut [T]) {
    let n = sizes.len();
    let ([hx, hy], [tx, ty]) = (here.map(|row| &row[..n]), to.map(|row| &row[..n]));
    let (k, rest) = (&k[..n], &rest[..n]);
    for i in 0..n {
        sizes[i] = size(pull([tx[i] - hx[i], ty[i] - hy[i]], k[i], rest[i]).1, sign);
    }
}

/// Breaks the springs that start in a row and are beyond their thresholds: no stiffness from now on.
#[inline(always)]
fn snap<T: Real>(
    shared: &Shared<'_, T>,
    (row, line): (usize, usize),
    band: &mut Band<T>,
    scratch: &mut Scratch<T>,
    snapped: &mut Vec<(usize, usize)>,
) {
    let Some(tables) = &shared.threshold else { return };
    let nx = shared.shape.nx;
    let Scratch { here, next, size, .. } = scratch;
    for dir in 0..shared.shape.directions() {
        let (dx, down) = DIRECTIONS[dir];
        let from = usize::from((1 + dx).unsigned_abs());
        let to = if down { &*next } else { &*here };
        let k = &mut band.stiffness[dir][line * nx..][..nx];
        let like = [&*k, shared.rest[dir].row(row, nx)];
        let ends = [&to[0][from..], &to[1][from..]];
        sizes([&here[0][1..], &here[1][1..]], ends, like, shared.motion.push_sign(), &mut size[..nx]);
        for (i, (k, threshold)) in k.iter_mut().zip(tables[dir].row(row, nx)).enumerate() {
            if size[i] > *threshold && *k != T::default() {
                *k = T::default();
                if line > 0 {
                    snapped.push((dir, row * nx + i));
                }
            }
        }
    }
}

/// How the springs of a row pull at its points and at those of the row below, given what the row above has left in
/// `carry`, and moves the points along one axis.
#[inline(always)]
fn settle<T: Real, const EIGHT: bool, const MOVE: bool>(
    motion: &Motion<T>,
    pull: [&[T]; 4],
    weight: &[T],
    carry: &mut [T],
    x: &mut [T],
    v: &mut [T],
) {
    let n = carry.len();
    let [e, s, se, sw] = pull.map(|p| &p[1..][..n]);
    let (e_left, se_left, sw_right) = (&pull[0][..n], &pull[2][..n], &pull[3][2..][..n]);
    let (weight, x, v) = if MOVE { (&weight[..n], &mut x[..n], &mut v[..n]) } else { (weight, x, v) };
    for i in 0..n {
        if MOVE {
            let starting = if EIGHT { e[i] + s[i] + (se[i] + sw[i]) } else { e[i] + s[i] };
            let force = carry[i] + (starting - e_left[i]);
            motion.advance(force, weight[i], &mut x[i], &mut v[i]);
        }
        carry[i] = -if EIGHT { s[i] + (se_left[i] + sw_right[i]) } else { s[i] };
    }
}

/// Moves the points of a row under the forces on them, or only hands on what pulls at the next row.
#[inline(always)]
fn settle_row<T: Real, const MOVE: bool>(
    shared: &Shared<'_, T>,
    band: &mut Band<T>,
    scratch: &mut Scratch<T>,
    line: usize,
) {
    let nx = shared.shape.nx;
    let range = if MOVE { line * nx..(line + 1) * nx } else { 0..0 };
    let weight = &mut band.weight[range.clone()];
    let x = [&mut band.x[range.clone()], &mut band.y[range.clone()]];
    let v = [&mut band.vx[range.clone()], &mut band.vy[range]];
    shared.mass.refresh(weight, x[0], x[1]);
    for (axis, (x, v)) in x.into_iter().zip(v).enumerate() {
        let pull = scratch.pull.each_ref().map(|pull| &pull[axis][..]);
        let carry = &mut scratch.carry[axis][..nx];
        if shared.shape.eight {
            settle::<T, true, MOVE>(&shared.motion, pull, weight, carry, x, v);
        } else {
            settle::<T, false, MOVE>(&shared.motion, pull, weight, carry, x, v);
        }
    }
}
