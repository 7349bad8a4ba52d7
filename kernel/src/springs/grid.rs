//! Springs on a grid: the same motion as [`super::list`] without index lists.
//!
//! Positions, velocities and spring constants are stored in arrays by row. Bands of rows are computed in parallel, in
//! place. A band takes several steps at a time (a stride), to use the data read from memory several times: as soon as a
//! row and the one below it have taken a step, the row takes the next one, so the steps move down the band one row
//! apart. For this a band has a halo: copies of the adjacent rows, made before the stride. The band moves them too, one
//! row fewer at either end in each step. The copies get the same numbers as in their own band, so the result does not
//! depend on the division of rows. [`super::rows`] computes a single row.
//!
//! Lattices of four neighbours, hexagons among them, that are higher than wide are transposed: each row has a fixed
//! cost, so few long rows are faster.

use super::net::{Broken, Mass, Motion, Net};
use super::rows::{LANES, PAD, Pulls, Springs};
use super::step::{Speed, Stepper, weights};
use super::tables::{Table, fill, part, rows};
use crate::ground::number::index_u32;
use crate::ground::real::Real;
use crate::ground::simd::dispatch_op;
use crate::leather::links::GridShape;
use rayon::prelude::*;

/// Maximum number of rows per band.
const BAND: usize = 64;

/// Maximum number of steps per stride, and of copied rows at either end of a band.
const STRIDE: usize = 4;

/// Transposes values by rows to values by columns.
fn transpose<V: Copy>(values: &[V], shape: GridShape) -> Vec<V> {
    (0..shape.nx).flat_map(|x| values.iter().skip(x).step_by(shape.nx)).copied().collect()
}

/// Data shared by all bands.
struct Shared<'a, T> {
    shape: GridShape,
    /// True if columns and rows, and x and y, are exchanged.
    transposed: bool,
    size: [T; 2],
    rest: Vec<Table<T>>,
    threshold: Option<Vec<Table<T>>>,
    motion: Motion<T>,
    mass: Mass<'a, T>,
    /// Copied rows at either end of a band.
    halo: usize,
}

impl<T: Real> Shared<'_, T> {
    /// Row index of a band's row `e`, if its first own row has index `first`.
    fn row(&self, first: usize, e: usize) -> usize {
        (first + e + self.shape.ny - self.halo) % self.shape.ny
    }

    /// Length of a row without the padding at its ends.
    fn wide(&self) -> usize {
        self.shape.nx.next_multiple_of(LANES)
    }

    /// Sets the columns beyond both ends of a row of positions to the periodic continuation.
    #[inline(always)]
    fn continue_row(&self, axis: usize, row: &mut [T]) {
        let n = self.shape.nx;
        let size = if axis == 0 { self.size[0] } else { T::default() };
        row[PAD - 1] = row[PAD + n - 1] - size;
        row[PAD + n] = row[PAD] + size;
    }
}

/// Rows of a band, from `halo` rows above its own to as many below, each a multiple of [`LANES`] long.
struct Band<T> {
    /// Index of the first own row.
    first: usize,
    /// Number of own rows.
    own: usize,
    /// Positions along x and y, with `PAD` more columns at either end.
    place: [Vec<T>; 2],
    velocity: [Vec<T>; 2],
    weight: Vec<T>,
    /// By direction; empty for directions that the lattice does not have.
    stiffness: [Vec<T>; 4],
}

/// Copies of the first and the last own rows of a band: positions, velocities, and the stiffness if springs can break.
struct Edges<T>([Vec<Vec<T>>; 2]);

impl<T: Real> Edges<T> {
    fn of(band: &Band<T>, shared: &Shared<'_, T>) -> Self {
        let room = || band.changing(shared).map(|rows| vec![T::default(); shared.halo * band.length(rows, shared)]);
        let mut edges = Self([room().collect(), room().collect()]);
        edges.update(band, shared);
        edges
    }

    /// Updates the copies.
    fn update(&mut self, band: &Band<T>, shared: &Shared<'_, T>) {
        for (edge, first) in self.0.iter_mut().zip([shared.halo, band.own]) {
            for (to, from) in edge.iter_mut().zip(band.changing(shared)) {
                let start = first * band.length(from, shared);
                to.copy_from_slice(&from[start..start + shared.halo * band.length(from, shared)]);
            }
        }
    }
}

impl<T: Real> Band<T> {
    /// Length of one of the rows in `rows`.
    fn length(&self, rows: &[T], shared: &Shared<'_, T>) -> usize {
        rows.len() / (self.own + 2 * shared.halo)
    }

    /// The arrays that change from step to step and that neighbours read.
    fn changing(&self, shared: &Shared<'_, T>) -> impl Iterator<Item = &Vec<T>> {
        let stiffness = &self.stiffness[..if shared.threshold.is_some() { shared.shape.directions() } else { 0 }];
        self.place.iter().chain(&self.velocity).chain(stiffness)
    }

    /// Copies the rows above and below from the edges of the adjacent bands.
    fn receive(&mut self, shared: &Shared<'_, T>, above: &Edges<T>, below: &Edges<T>) {
        let stiffness = &mut self.stiffness[..if shared.threshold.is_some() { shared.shape.directions() } else { 0 }];
        let all = self.place.iter_mut().chain(&mut self.velocity).chain(stiffness);
        for ((to, above), below) in all.zip(&above.0[1]).zip(&below.0[0]) {
            let end = to.len() - below.len();
            to[..above.len()].copy_from_slice(above);
            to[end..].copy_from_slice(below);
        }
    }
}

/// Memory of a worker.
struct Scratch<T> {
    pulls: Pulls<T>,
    /// By step of a stride and axis: forces on a row from the springs of the row above.
    carry: [[Vec<T>; 2]; STRIDE],
    /// The first row's positions along y, continued below the last row.
    under: Vec<T>,
}

/// Report of a band on a stride.
struct Report<T> {
    /// By step: speeds of its own rows.
    speed: [Speed<T>; STRIDE],
    /// Broken springs of its own rows: step of the stride, direction and point.
    snapped: Vec<(u32, usize, usize)>,
}

/// A grid of springs in motion.
pub(super) struct Grid<'a, T> {
    shared: Shared<'a, T>,
    bands: Vec<Band<T>>,
    /// By band: the present edges, and room for the next ones.
    edges: [Vec<Edges<T>>; 2],
    /// Indices of the links by direction and point.
    numbers: Vec<Vec<u32>>,
}

impl<'a, T: Real> Grid<'a, T> {
    /// Takes points by rows and the indices of links by direction and point ([`GridShape::numbers`]); lengths have been
    /// checked.
    pub(super) fn new(
        points: &[[T; 2]],
        net: &Net<'a, T>,
        motion: &Motion<T>,
        shape: GridShape,
        numbers: Vec<Vec<u32>>,
    ) -> Self {
        let weight = weights(points, net);
        if shape.eight || shape.ny <= shape.nx {
            return Self::by_rows(points, weight, net, motion, shape, numbers, false);
        }
        // Few long rows are faster than many short ones.
        let points: Vec<_> = transpose(points, shape).into_iter().map(|[x, y]| [y, x]).collect();
        let numbers = numbers.iter().rev().map(|numbers| transpose(numbers, shape)).collect();
        let net = Net { size: [net.size[1], net.size[0]], ..*net };
        let transposed = GridShape { nx: shape.ny, ny: shape.nx, ..shape };
        Self::by_rows(&points, transpose(&weight, shape), &net, motion, transposed, numbers, true)
    }

    /// Like [`new`](Self::new), with points in the order of computation, and 1/m of all points.
    fn by_rows(
        points: &[[T; 2]],
        weight: Vec<T>,
        net: &Net<'a, T>,
        motion: &Motion<T>,
        shape: GridShape,
        numbers: Vec<Vec<u32>>,
        transposed: bool,
    ) -> Self {
        let (nx, ny) = (shape.nx, shape.ny);
        let table =
            |values: &[T]| numbers.par_iter().map(|numbers| Table::new(values, numbers, nx)).collect::<Vec<_>>();
        let threshold = (!net.threshold.is_empty()).then(|| table(net.threshold));
        let (count, rest) = (ny.div_ceil(BAND), table(net.rest));
        // Every band must have at least as many own rows as other bands copy.
        let halo = STRIDE.min(ny.checked_div(count).unwrap_or(0));
        let shared =
            Shared { shape, transposed, size: net.size, rest, threshold, motion: *motion, mass: net.mass, halo };
        let band = |b: usize| {
            let (first, end) = (b * ny / count, (b + 1) * ny / count);
            let rows = end - first + 2 * halo;
            let by_row = |pad: usize, value: &dyn Fn(usize, &mut [T])| {
                let wide = shared.wide() + 2 * pad;
                let mut all = vec![T::default(); rows * wide];
                for (e, into) in all.chunks_exact_mut(wide).enumerate() {
                    value(shared.row(first, e) * nx, &mut into[pad..][..nx]);
                }
                all
            };
            let stiffness = |dir: usize| {
                let of = |numbers: &Vec<u32>| by_row(0, &|from, into| fill(into, net.stiffness, &numbers[from..]));
                numbers.get(dir).map_or_else(Vec::new, of)
            };
            let place = |axis: usize| {
                let mut place = by_row(PAD, &|from, into| {
                    into.iter_mut().zip(&points[from..]).for_each(|(into, point)| *into = point[axis]);
                });
                let rows = place.chunks_exact_mut(shared.wide() + 2 * PAD);
                rows.for_each(|row| shared.continue_row(axis, row));
                place
            };
            let rest = vec![T::default(); rows * shared.wide()];
            Band {
                first,
                own: end - first,
                place: [place(0), place(1)],
                velocity: [rest.clone(), rest],
                weight: by_row(0, &|from, into| into.copy_from_slice(&weight[from..][..nx])),
                stiffness: std::array::from_fn(stiffness),
            }
        };
        let bands: Vec<Band<T>> = if nx == 0 { Vec::new() } else { (0..count).into_par_iter().map(band).collect() };
        let edges = || bands.iter().map(|band| Edges::of(band, &shared)).collect();
        Self { edges: [edges(), edges()], bands, numbers, shared }
    }
}

impl<T: Real> Stepper<T> for Grid<'_, T> {
    fn stride(&self) -> u32 {
        index_u32(self.shared.halo.max(1))
    }

    fn advance(&mut self, step: u32, steps: u32, broken: &mut Vec<Broken>) -> Vec<Speed<T>> {
        let (shared, numbers, wide) = (&self.shared, &self.numbers, self.shared.wide());
        let [now, next] = &mut self.edges;
        let (now, count, steps) = (&*now, self.bands.len(), steps as usize);
        let advance = |scratch: &mut Scratch<T>, (b, (band, edges)): (usize, (&mut Band<T>, &mut Edges<T>))| {
            band.receive(shared, &now[(b + count - 1) % count], &now[(b + 1) % count]);
            let mut report = Report { speed: [Speed::default(); STRIDE], snapped: Vec::new() };
            dispatch_op(Advance { shared, band, scratch, steps, report: &mut report });
            edges.update(band, shared);
            report
        };
        let new_scratch = || Scratch {
            pulls: std::array::from_fn(|_| std::array::from_fn(|_| vec![T::default(); wide + 2 * PAD])),
            carry: std::array::from_fn(|_| std::array::from_fn(|_| vec![T::default(); wide])),
            under: vec![T::default(); wide + 2 * PAD],
        };
        let bands = self.bands.par_iter_mut().zip(next).enumerate();
        let reports: Vec<_> = bands.map_init(new_scratch, advance).collect();
        self.edges.swap(0, 1);
        let mut total = vec![Speed::default(); steps];
        for report in reports {
            total.iter_mut().zip(report.speed).for_each(|(total, speed)| total.merge(speed));
            let broke = report.snapped.into_iter();
            broken.extend(broke.map(|(n, dir, point)| Broken { step: step + n, link: numbers[dir][point] }));
        }
        total
    }

    fn finish(self: Box<Self>) -> [Vec<[T; 2]>; 2] {
        let (nx, wide, halo) = (self.shared.shape.nx, self.shared.wide(), self.shared.halo);
        let gather = |of: fn(&Band<T>) -> &[Vec<T>; 2], pad: usize| {
            let mut all = Vec::with_capacity(nx * self.shared.shape.ny);
            for band in &self.bands {
                let [x, y] = of(band);
                for e in halo..halo + band.own {
                    let at = e * (wide + 2 * pad) + pad;
                    all.extend(x[at..][..nx].iter().zip(&y[at..][..nx]).map(|(x, y)| [*x, *y]));
                }
            }
            all
        };
        let (shape, transposed) = (self.shared.shape, self.shared.transposed);
        [gather(|band| &band.place, PAD), gather(|band| &band.velocity, 0)]
            .map(|all| if transposed { transpose(&all, shape).into_iter().map(|[x, y]| [y, x]).collect() } else { all })
    }
}

/// A stride of a band, for [`dispatch_op`]: a closure would not be inlined into the function with the vector
/// instructions.
struct Advance<'j, 'a, T> {
    shared: &'j Shared<'a, T>,
    band: &'j mut Band<T>,
    scratch: &'j mut Scratch<T>,
    steps: usize,
    report: &'j mut Report<T>,
}

impl<T: Real> pulp::WithSimd for Advance<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) {
        let spare = self.shared.halo - self.steps;
        let rows = self.band.own + 2 * self.shared.halo;
        // Step `n` is one row behind step `n - 1`, starts one row later and ends one row earlier.
        for wave in spare..rows - 1 - spare {
            for n in 0..self.steps.min((wave - spare) / 2 + 1) {
                self.advance_row(n, wave - n, wave - n > spare + n);
            }
        }
    }
}

impl<T: Real> Advance<'_, '_, T> {
    /// Computes the forces of the springs that start in the band's row `e`, in step `n` of the stride, and moves the
    /// row if the forces of the row above are known (`moves`).
    #[inline(always)]
    fn advance_row(&mut self, n: usize, e: usize, moves: bool) {
        let Self { shared, band, scratch, report, .. } = self;
        let (shape, nx, wide) = (shared.shape, shared.shape.nx, shared.wide());
        let (padded, row) = (wide + 2 * PAD, shared.row(band.first, e));
        let last = row + 1 == shape.ny;
        if last {
            for (to, from) in scratch.under.iter_mut().zip(&band.place[1][(e + 1) * padded..]) {
                *to = *from + shared.size[1];
            }
        }
        let [x, y] = &mut band.place;
        let (x, below_x) = x[e * padded..].split_at_mut(padded);
        let (y, below_y) = y[e * padded..].split_at_mut(padded);
        let below_y = if last { &scratch.under } else { &below_y[..padded] };
        let range = e * wide..(e + 1) * wide;
        let [vx, vy] = &mut band.velocity;
        let (vx, vy) = (&mut vx[range.clone()], &mut vy[range.clone()]);
        let weight = &mut band.weight[range.clone()];
        if moves {
            let (x, y) = (&x[PAD..], &y[PAD..]);
            let [x, y] = if shared.transposed { [y, x] } else { [x, y] };
            shared.mass.refresh(weight, x, y);
        }
        // Placeholders for the directions that the lattice does not have; they are not read.
        let directions = if shape.eight { [0, 1, 2, 3] } else { [0, 1, 0, 1] };
        let [right, down, down_right, down_left] = &mut band.stiffness;
        let mut springs = Springs {
            place: [x, y],
            below: [&below_x[..padded], below_y],
            velocity: [vx, vy],
            weight,
            stiffness: [part(right, &range), part(down, &range), part(down_right, &range), part(down_left, &range)],
            rest: rows(&shared.rest, directions, row, wide),
            threshold: shared.threshold.as_ref().map_or([&[]; 4], |tables| rows(tables, directions, row, wide)),
            motion: &shared.motion,
            eight: shape.eight,
            columns: nx,
        };
        let own = (shared.halo..shared.halo + band.own).contains(&e);
        let snapped = &mut report.snapped;
        springs.advance(&mut scratch.pulls, &mut scratch.carry[n], moves, |dir, i| {
            if own {
                snapped.push((index_u32(n), dir, row * nx + i));
            }
        });
        if moves {
            shared.continue_row(0, x);
            shared.continue_row(1, y);
        }
        if own {
            let speed = &mut report.speed[n];
            // Nothing moves beyond the last column.
            speed.add(vx);
            speed.add(vy);
            if shared.motion.settle > T::default() {
                speed.fastest(vx[..nx].iter().zip(&vy[..nx]).map(|(&x, &y)| [x, y]));
            }
        }
    }
}
