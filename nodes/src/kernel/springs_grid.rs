//! Springs on a grid: the same motion as [`super::springs_list`] without index lists.
//!
//! Positions, velocities and spring constants lie in arrays by row; the springs of a row to its right and to the row
//! below are computed once, vectorised, and their forces are added to both rows. Rows are worked through in bands in
//! parallel. A band updates its rows in place, which saves memory traffic: it reads copies of the rows next to it,
//! taken before the step, and computes the springs that come down from the row above it for itself. Those are the same
//! numbers as in that row's own band, so the result does not depend on the cut.

use super::lattice::{DIRECTIONS, GridShape};
use super::springs::{BreakOn, Broken, Integrator, Mass, Motion, Net, Real, Speed, Stepper, weights};
use rayon::prelude::*;

/// Rows per band.
const BAND: usize = 32;
/// Lanes of sums; fixed, whatever the machine has.
const LANES: usize = 8;

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

/// The rows that are being worked on; positions have a column more at either end.
struct Scratch<T> {
    here: [Vec<T>; 2],
    next: [Vec<T>; 2],
    force: [Vec<T>; 2],
    force_next: [Vec<T>; 2],
    pull: [Vec<T>; 2],
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
            total.sum += speed.sum;
            total.max = if speed.max > total.max { speed.max } else { total.max };
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
        let pair = || [vec![T::default(); nx + 2], vec![T::default(); nx + 2]];
        Self {
            here: pair(),
            next: pair(),
            force: pair(),
            force_next: pair(),
            pull: pair(),
            size: vec![T::default(); nx + 2],
        }
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
        scratch.force_next[axis].fill(T::default());
    }
    for line in 0..=rows {
        let row = (band.first + line + ny - 1) % ny;
        std::mem::swap(&mut scratch.here, &mut scratch.next);
        std::mem::swap(&mut scratch.force, &mut scratch.force_next);
        for axis in 0..2 {
            let own = if axis == 0 { &band.x } else { &band.y };
            let below = if line < rows { &own[line * nx..][..nx] } else { &band.below[axis][..] };
            let offset = if axis == 1 && row + 1 == ny { shared.size[1] } else { T::default() };
            load_row(&mut scratch.next[axis], below, offset, size(axis));
            scratch.force_next[axis].fill(T::default());
        }
        if line == 1 && row == 0 {
            // The first row was loaded as what lies below the last; in its own right it is at its own place.
            for axis in 0..2 {
                let own = if axis == 0 { &band.x } else { &band.y };
                load_row(&mut scratch.here[axis], &own[..nx], T::default(), size(axis));
            }
        }
        let first = if line == 0 { 1 } else { 0 };
        for dir in first..shared.shape.directions() {
            spring_row(shared, (dir, row), &band.stiffness[dir][line * nx..][..nx], scratch);
            if shared.threshold.is_some() {
                let record = |x: usize| {
                    if line > 0 {
                        snapped.push((dir, row * nx + x))
                    }
                };
                snap(shared, (dir, row), &mut band.stiffness[dir][line * nx..][..nx], scratch, record);
            }
            add_forces(dir, scratch, nx);
        }
        if line > 0 {
            move_row(shared, band, scratch, line - 1, &mut speed);
        }
    }
    speed
}

/// The forces along links from `a` to `b` (x and y each), stiffness and length given; none between points in the same
/// place (L-8). What is written are arguments of their own: only then does the compiler see that nothing overlaps.
#[inline(always)]
fn pulls<T: Real>(a: [&[T]; 2], b: [&[T]; 2], [k, rest]: [&[T]; 2], px: &mut [T], py: &mut [T]) {
    let n = px.len();
    let (xa, ya, xb, yb) = (&a[0][..n], &a[1][..n], &b[0][..n], &b[1][..n]);
    let (k, rest, py) = (&k[..n], &rest[..n], &mut py[..n]);
    for i in 0..n {
        let (dx, dy) = (xb[i] - xa[i], yb[i] - ya[i]);
        let d = (dx * dx + dy * dy).sqrt();
        let s = k[i] * (d - rest[i]) / if d > T::default() { d } else { T::ONE };
        (px[i], py[i]) = (s * dx, s * dy);
    }
}

/// The forces `k (D - L)` of the same links.
#[inline(always)]
fn sizes<T: Real>(a: [&[T]; 2], b: [&[T]; 2], [k, rest]: [&[T]; 2], tension: bool, size: &mut [T]) {
    let n = size.len();
    let (xa, ya, xb, yb) = (&a[0][..n], &a[1][..n], &b[0][..n], &b[1][..n]);
    let (k, rest) = (&k[..n], &rest[..n]);
    let sign = if tension { T::ONE } else { -T::ONE };
    for i in 0..n {
        let (dx, dy) = (xb[i] - xa[i], yb[i] - ya[i]);
        let d = (dx * dx + dy * dy).sqrt();
        let f = if d > T::default() { k[i] * (d - rest[i]) } else { T::default() };
        size[i] = if f < T::default() { sign * f } else { f };
    }
}

/// The forces of the springs of one direction that start in a row, into `scratch.pull`; with thresholds also what
/// is compared with them, into `scratch.size`.
#[inline(always)]
fn spring_row<T: Real>(shared: &Shared<'_, T>, (dir, row): (usize, usize), k: &[T], scratch: &mut Scratch<T>) {
    let nx = k.len();
    let (dx, down) = DIRECTIONS[dir];
    let from = usize::from((1 + dx).unsigned_abs());
    let rest = shared.rest[dir].row(row, nx);
    let Scratch { here, next, pull: [px, py], size, .. } = scratch;
    let to = if down { &*next } else { &*here };
    let a = [&here[0][1..=nx], &here[1][1..=nx]];
    let b = [&to[0][from..][..nx], &to[1][from..][..nx]];
    if shared.threshold.is_some() {
        sizes(a, b, [k, rest], shared.motion.break_on == BreakOn::Tension, &mut size[..nx]);
    }
    pulls(a, b, [k, rest], &mut px[1..=nx], &mut py[1..=nx]);
}

/// Breaks the springs whose force is beyond its threshold: no stiffness and no force from now on.
#[inline(always)]
fn snap<T: Real>(
    shared: &Shared<'_, T>,
    (dir, row): (usize, usize),
    k: &mut [T],
    scratch: &mut Scratch<T>,
    mut record: impl FnMut(usize),
) {
    let Some(tables) = &shared.threshold else { return };
    let nx = k.len();
    let threshold = &tables[dir].row(row, nx)[..nx];
    let size = &scratch.size[..nx];
    let mut any = 0u32;
    for i in 0..nx {
        any |= u32::from(size[i] > threshold[i]);
    }
    if any == 0 {
        return;
    }
    for i in 0..nx {
        if size[i] > threshold[i] && k[i] != T::default() {
            record(i);
            k[i] = T::default();
            scratch.pull[0][i + 1] = T::default();
            scratch.pull[1][i + 1] = T::default();
        }
    }
}

/// Adds the forces of one direction to the row where the springs start and takes them from where they end.
#[inline(always)]
fn add_forces<T: Real>(dir: usize, scratch: &mut Scratch<T>, nx: usize) {
    let (dx, down) = DIRECTIONS[dir];
    let from = usize::from((1 + dx).unsigned_abs());
    for axis in 0..2 {
        let pull = &scratch.pull[axis][1..=nx];
        for (force, pull) in scratch.force[axis][1..=nx].iter_mut().zip(pull) {
            *force += *pull;
        }
        let ends = if down { &mut scratch.force_next[axis] } else { &mut scratch.force[axis] };
        for (force, pull) in ends[from..][..nx].iter_mut().zip(pull) {
            *force -= *pull;
        }
        // What fell off one end belongs to the other: on a lattice that is not periodic these springs have no k.
        let (left, right) = (ends[0], ends[nx + 1]);
        ends[nx] += left;
        ends[1] += right;
        (ends[0], ends[nx + 1]) = (T::default(), T::default());
    }
}

/// Moves the points of a row under the forces on them.
#[inline(always)]
fn move_row<T: Real>(
    shared: &Shared<'_, T>,
    band: &mut Band<T>,
    scratch: &Scratch<T>,
    line: usize,
    speed: &mut Speed<T>,
) {
    let nx = shared.shape.nx;
    let range = line * nx..(line + 1) * nx;
    let (x, y) = (&mut band.x[range.clone()], &mut band.y[range.clone()]);
    let (vx, vy) = (&mut band.vx[range.clone()], &mut band.vy[range.clone()]);
    let weight = &mut band.weight[range];
    if let Mass::Live(mass) = shared.mass {
        for i in 0..nx {
            if weight[i] > T::default() {
                weight[i] = T::ONE / mass([x[i], y[i]]);
            }
        }
    }
    move_axis(&shared.motion, x, vx, &scratch.force[0][1..=nx], weight);
    move_axis(&shared.motion, y, vy, &scratch.force[1][1..=nx], weight);
    let (mut sum, mut max) = ([T::default(); LANES], [speed.max; LANES]);
    let (vx, rest_x) = vx.as_chunks::<LANES>();
    let (vy, rest_y) = vy.as_chunks::<LANES>();
    let add = |x: T, y: T, lane: usize, sum: &mut [T; LANES], max: &mut [T; LANES]| {
        let square = x * x + y * y;
        sum[lane] += square;
        max[lane] = if square > max[lane] { square } else { max[lane] };
    };
    for (x, y) in vx.iter().zip(vy) {
        for lane in 0..LANES {
            add(x[lane], y[lane], lane, &mut sum, &mut max);
        }
    }
    for (lane, (x, y)) in rest_x.iter().zip(rest_y).enumerate() {
        add(*x, *y, lane, &mut sum, &mut max);
    }
    for lane in 0..LANES {
        speed.sum += sum[lane].wide();
        speed.max = if max[lane] > speed.max { max[lane] } else { speed.max };
    }
}

/// Moves one coordinate of a row.
#[inline(always)]
fn move_axis<T: Real>(motion: &Motion<T>, x: &mut [T], v: &mut [T], force: &[T], weight: &[T]) {
    let n = x.len();
    let (v, force, weight) = (&mut v[..n], &force[..n], &weight[..n]);
    let (step, drag) = (motion.step, motion.drag);
    match motion.integrator {
        Integrator::Explicit => {
            for i in 0..n {
                let a = (force[i] - drag * v[i]) * weight[i];
                x[i] += v[i] * step + T::HALF * a * step * step;
                v[i] += a * step;
            }
        }
        Integrator::SemiImplicit => {
            for i in 0..n {
                v[i] += (force[i] - drag * v[i]) * weight[i] * step;
                x[i] += v[i] * step;
            }
        }
    }
}
