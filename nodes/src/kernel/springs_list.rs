//! Springs along any links.
//!
//! Points are sorted along a Morton curve and cut into patches of fixed size. A patch keeps, with local indices, all
//! springs that touch its points; those that lead out of it are computed by both patches, from the same numbers in the
//! same order and hence with the same bits. So a patch works in its core's cache, writes only its own points, and the
//! result depends neither on threads nor on which patch runs first. Per block of springs the differences are gathered,
//! then the forces computed, vectorised, then added to both ends in the order of the list. That order keeps springs of
//! the same point apart, so that one addition need not wait for the last.

use super::lattice::index;
use super::springs::{Broken, Integrator, Mass, Motion, Net, Real, SpringError, Stepper};
use super::springs_step::{Speed, pull, size, weights};
use rayon::prelude::*;

/// Points per patch.
const PATCH: usize = 2048;
/// Springs per block: its differences and forces stay in the first-level cache.
const BLOCK: usize = 256;

/// The springs that touch the points of one patch.
struct Patch<T> {
    /// Points of other patches at the far ends of springs, in the sorted order.
    ghosts: Vec<u32>,
    /// The two ends by local index: own points first, then ghosts.
    ends: Vec<[u16; 2]>,
    /// Springs from here on have an offset.
    wrapped: usize,
    offsets: Vec<[T; 2]>,
    stiffness: Vec<T>,
    rest: Vec<T>,
    damping: Vec<T>,
    threshold: Vec<T>,
    /// Springs that only push; empty if none do.
    pushes: Vec<bool>,
    /// Index into the links; asked only when a spring breaks.
    ids: Vec<u32>,
}

/// Memory of a worker.
struct Scratch<T> {
    position: Vec<[T; 2]>,
    velocity: Vec<[T; 2]>,
    force: Vec<[T; 2]>,
    dx: [T; BLOCK],
    dy: [T; BLOCK],
    grow: [[T; BLOCK]; 2],
    size: [T; BLOCK],
}

impl<T: Real> Scratch<T> {
    fn new() -> Self {
        let zeros = [T::default(); BLOCK];
        let (position, velocity, force) = (Vec::new(), Vec::new(), Vec::new());
        Self { position, velocity, force, dx: zeros, dy: zeros, grow: [zeros; 2], size: zeros }
    }
}

/// A lattice of springs in motion.
pub(super) struct List<'a, T> {
    motion: Motion<T>,
    mass: Mass<'a, T>,
    order: Vec<u32>,
    patches: Vec<Patch<T>>,
    weight: Vec<T>,
    /// Positions and velocities, and those of the next step.
    position: [Vec<[T; 2]>; 2],
    velocity: [Vec<[T; 2]>; 2],
}

/// A point's place on a Morton curve through the bounds of all points.
fn morton<T: Real>(points: &[[T; 2]]) -> Vec<u32> {
    let fold =
        |axis: usize, pick: fn(f64, f64) -> f64| points.iter().map(|p| p[axis].wide()).reduce(pick).unwrap_or_default();
    let low = [fold(0, f64::min), fold(1, f64::min)];
    let extent = (fold(0, f64::max) - low[0]).max(fold(1, f64::max) - low[1]).max(1e-300);
    let spread = |v: u32| {
        let mut v = v & 0xFFFF;
        v = (v | (v << 8)) & 0x00FF_00FF;
        v = (v | (v << 4)) & 0x0F0F_0F0F;
        v = (v | (v << 2)) & 0x3333_3333;
        (v | (v << 1)) & 0x5555_5555
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the quotient is 0 to 1")]
    let cell = |p: &[T; 2], axis: usize| ((p[axis].wide() - low[axis]) / extent * 65535.0) as u32;
    points.par_iter().map(|p| spread(cell(p, 0)) | (spread(cell(p, 1)) << 1)).collect()
}

impl<'a, T: Real> List<'a, T> {
    /// Sorts the points and hands out the springs; slices have been checked.
    pub(super) fn new(points: &[[T; 2]], net: &Net<'a, T>, motion: &Motion<T>) -> Result<Self, SpringError> {
        let code = morton(points);
        let mut order: Vec<u32> = (0..index(points.len())).collect();
        order.par_sort_unstable_by_key(|&p| (code[p as usize], p));
        let mut rank = vec![0u32; order.len()];
        for (to, &from) in (0u32..).zip(&order) {
            rank[from as usize] = to;
        }
        let mut springs = vec![Vec::new(); order.len().div_ceil(PATCH)];
        for (id, pair) in (0u32..).zip(net.links) {
            let [a, b] = pair.map(|p| rank[p as usize] as usize / PATCH);
            springs[a].push(id);
            if b != a {
                springs[b].push(id);
            }
        }
        let count = order.len();
        let build = |(p, ids): (usize, Vec<u32>)| Patch::new(p * PATCH..((p + 1) * PATCH).min(count), ids, net, &rank);
        let patches = springs.into_par_iter().enumerate().map(build).collect::<Result<Vec<_>, usize>>();
        let patches = patches.map_err(|at| SpringError::Crowded { point: order[at] as usize })?;
        let weight = weights(points, net);
        let position: Vec<[T; 2]> = order.iter().map(|&p| points[p as usize]).collect();
        let rest = vec![[T::default(); 2]; count];
        Ok(Self {
            motion: *motion,
            mass: net.mass,
            weight: order.iter().map(|&p| weight[p as usize]).collect(),
            order,
            patches,
            position: [position.clone(), position],
            velocity: [rest.clone(), rest],
        })
    }
}

impl<T: Real> Patch<T> {
    /// The patch of sorted points `own` with springs `ids`; fails with a sorted point when there are too many ghosts.
    fn new(own: std::ops::Range<usize>, mut ids: Vec<u32>, net: &Net<'_, T>, rank: &[u32]) -> Result<Self, usize> {
        let ends_of = |id: u32| net.links[id as usize].map(|p| rank[p as usize]);
        let inside = |p: u32| own.contains(&(p as usize));
        let mut ghosts: Vec<u32> = ids.iter().flat_map(|&id| ends_of(id)).filter(|&p| !inside(p)).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        if own.len() + ghosts.len() > usize::from(u16::MAX) {
            return Err(own.start);
        }
        let local = |p: u32| {
            let ghost = || own.len() + ghosts.binary_search(&p).expect("ghosts are all far ends");
            let local = if inside(p) { p as usize - own.start } else { ghost() };
            u16::try_from(local).expect("counted above")
        };
        let is_wrapped = |id: u32| net.wraps.get(id as usize).is_some_and(|&w| w != [0, 0]);
        // How many springs of the same first point come before: the first of every point, then the second …; within
        // these points that are 16 apart in the sorted order follow each other.
        let mut seen = vec![0u32; own.len() + ghosts.len()];
        let mut keyed: Vec<_> = Vec::with_capacity(ids.len());
        for id in ids.drain(..) {
            let first = local(ends_of(id)[0]);
            let slot = &mut seen[usize::from(first)];
            keyed.push((is_wrapped(id), *slot, first % 16, first, id));
            *slot += 1;
        }
        keyed.sort_unstable();
        let ids: Vec<u32> = keyed.iter().map(|k| k.4).collect();
        let wrapped = keyed.partition_point(|k| !k.0);
        let gather = |values: &[T]| ids.iter().filter_map(|&id| values.get(id as usize).copied()).collect();
        let offset = |&id: &u32| {
            let w = net.wraps[id as usize];
            [T::of(f64::from(w[0])) * net.size[0], T::of(f64::from(w[1])) * net.size[1]]
        };
        Ok(Self {
            ends: ids.iter().map(|&id| ends_of(id).map(local)).collect(),
            wrapped,
            offsets: ids[wrapped..].iter().map(offset).collect(),
            stiffness: gather(net.stiffness),
            rest: gather(net.rest),
            damping: gather(net.damping),
            threshold: gather(net.threshold),
            pushes: ids.iter().filter_map(|&id| net.pushes.get(id as usize).copied()).collect(),
            ghosts,
            ids,
        })
    }

    /// Copies what the patch reads into the scratch memory, where local indices count.
    #[inline(always)]
    fn collect(&self, all: [&[[T; 2]]; 2], own: &Own<'_, T>, scratch: &mut Scratch<T>) {
        let copy = |from: &[[T; 2]], own: &[[T; 2]], into: &mut Vec<[T; 2]>| {
            into.clear();
            into.extend_from_slice(own);
            into.extend(self.ghosts.iter().map(|&p| from[p as usize]));
        };
        copy(all[0], own.before[0], &mut scratch.position);
        if !self.damping.is_empty() {
            copy(all[1], own.before[1], &mut scratch.velocity);
        }
    }

    /// The sum of the forces on each of the patch's points, into `scratch.force`.
    #[inline(always)]
    fn forces(&mut self, motion: &Motion<T>, scratch: &mut Scratch<T>, mut snapped: impl FnMut(u32, [u16; 2])) {
        scratch.force.clear();
        scratch.force.resize(scratch.position.len(), [T::default(); 2]);
        let count = self.ends.len();
        let mut start = 0;
        while start < count {
            let limit = if start < self.wrapped { self.wrapped } else { count };
            let block = start..(start + BLOCK).min(limit);
            let n = block.len();
            gather(&self.ends[block.clone()], &scratch.position, &mut scratch.dx, &mut scratch.dy);
            if start >= self.wrapped {
                let offsets = &self.offsets[start - self.wrapped..][..n];
                for (i, offset) in offsets.iter().enumerate() {
                    scratch.dx[i] += offset[0];
                    scratch.dy[i] += offset[1];
                }
            }
            if !self.damping.is_empty() {
                let [gx, gy] = &mut scratch.grow;
                gather(&self.ends[block.clone()], &scratch.velocity, gx, gy);
                dampen(&self.damping[block.clone()], &scratch.dx, &scratch.dy, &mut scratch.grow);
            }
            let (k, rest) = (&self.stiffness[block.clone()], &self.rest[block.clone()]);
            if !self.threshold.is_empty() {
                sizes(k, rest, motion.push_sign(), &scratch.dx, &scratch.dy, &mut scratch.size);
            }
            if self.pushes.is_empty() {
                pulls(k, rest, &mut scratch.dx, &mut scratch.dy);
            } else {
                let mut apart = [false; BLOCK];
                for i in 0..n {
                    let (dx, dy) = (scratch.dx[i], scratch.dy[i]);
                    apart[i] = self.pushes[block.start + i] && (dx * dx + dy * dy).sqrt() >= rest[i];
                }
                pulls(k, rest, &mut scratch.dx, &mut scratch.dy);
                for i in (0..n).filter(|&i| apart[i]) {
                    (scratch.dx[i], scratch.dy[i]) = (T::default(), T::default());
                }
            }
            if !self.threshold.is_empty() {
                self.snap(block.clone(), scratch, &mut snapped);
            }
            if !self.damping.is_empty() {
                for i in 0..n {
                    scratch.dx[i] += scratch.grow[0][i];
                    scratch.dy[i] += scratch.grow[1][i];
                }
            }
            scatter(&self.ends[block], &scratch.dx, &scratch.dy, &mut scratch.force);
            start += n;
        }
    }

    /// Takes the springs of a block that broke out of the sum, for good.
    #[inline(always)]
    fn snap(
        &mut self,
        block: std::ops::Range<usize>,
        scratch: &mut Scratch<T>,
        snapped: &mut impl FnMut(u32, [u16; 2]),
    ) {
        let n = block.len();
        let (size, threshold) = (&scratch.size[..n], &self.threshold[block.clone()]);
        let mut any = 0;
        for i in 0..n {
            any |= u32::from(size[i] > threshold[i]);
        }
        if any == 0 {
            return;
        }
        for i in 0..n {
            let l = block.start + i;
            if size[i] > threshold[i] && self.stiffness[l] != T::default() {
                snapped(self.ids[l], self.ends[l]);
                self.stiffness[l] = T::default();
                (scratch.dx[i], scratch.dy[i]) = (T::default(), T::default());
                if let Some(damping) = self.damping.get_mut(l) {
                    *damping = T::default();
                    (scratch.grow[0][i], scratch.grow[1][i]) = (T::default(), T::default());
                }
            }
        }
    }
}

/// Differences between the two ends.
#[inline(always)]
fn gather<T: Real>(ends: &[[u16; 2]], from: &[[T; 2]], dx: &mut [T; BLOCK], dy: &mut [T; BLOCK]) {
    for ((ends, dx), dy) in ends.iter().zip(dx).zip(dy) {
        let [a, b] = ends.map(|e| from[usize::from(e)]);
        (*dx, *dy) = (b[0] - a[0], b[1] - a[1]);
    }
}

/// The force along each link, in place of the difference.
#[inline(always)]
fn pulls<T: Real>(k: &[T], rest: &[T], dx: &mut [T; BLOCK], dy: &mut [T; BLOCK]) {
    let n = k.len().min(BLOCK);
    let (dx, dy, rest) = (&mut dx[..n], &mut dy[..n], &rest[..n]);
    for i in 0..n {
        [dx[i], dy[i]] = pull([dx[i], dy[i]], k[i], rest[i]).0;
    }
}

/// What is compared with the thresholds: see [`super::springs_step::size`].
#[inline(always)]
fn sizes<T: Real>(k: &[T], rest: &[T], sign: T, dx: &[T; BLOCK], dy: &[T; BLOCK], sizes: &mut [T; BLOCK]) {
    let n = k.len().min(BLOCK);
    let (dx, dy, rest, sizes) = (&dx[..n], &dy[..n], &rest[..n], &mut sizes[..n]);
    for i in 0..n {
        sizes[i] = size(pull([dx[i], dy[i]], k[i], rest[i]).1, sign);
    }
}

/// The force of dampers, in place of the differences of velocity.
#[inline(always)]
fn dampen<T: Real>(damping: &[T], dx: &[T; BLOCK], dy: &[T; BLOCK], grow: &mut [[T; BLOCK]; 2]) {
    let [gx, gy] = grow;
    for (i, &damping) in damping.iter().enumerate() {
        let square = dx[i] * dx[i] + dy[i] * dy[i];
        let along = gx[i] * dx[i] + gy[i] * dy[i];
        let s = if square > T::default() { damping * along / square } else { T::default() };
        (gx[i], gy[i]) = (s * dx[i], s * dy[i]);
    }
}

/// Adds forces at the first ends and takes them from the second.
#[inline(always)]
fn scatter<T: Real>(ends: &[[u16; 2]], dx: &[T; BLOCK], dy: &[T; BLOCK], force: &mut [[T; 2]]) {
    for ((ends, dx), dy) in ends.iter().zip(dx).zip(dy) {
        let a = &mut force[usize::from(ends[0])];
        *a = [a[0] + *dx, a[1] + *dy];
        let b = &mut force[usize::from(ends[1])];
        *b = [b[0] - *dx, b[1] - *dy];
    }
}

/// The points of a patch before and after a step.
struct Own<'a, T> {
    before: [&'a [[T; 2]]; 2],
    after: [&'a mut [[T; 2]]; 2],
    weight: &'a mut [T],
}

/// Moves the points of a patch.
#[inline(always)]
fn move_points<T: Real>(motion: &Motion<T>, mass: Mass<'_, T>, own: Own<'_, T>, force: &[[T; 2]]) -> Speed<T> {
    let (step, drag) = (motion.step, motion.drag);
    let count = own.weight.len();
    let [x0, v0] = own.before.map(|s| &s[..count]);
    let [x1, v1] = own.after.map(|s| &mut s[..count]);
    let force = &force[..count];
    if let Mass::Live(mass) = mass {
        for (weight, &x) in own.weight.iter_mut().zip(x0) {
            *weight = if *weight > T::default() { T::ONE / mass(x) } else { *weight };
        }
    }
    let (mut sums, mut max) = ([T::default(); 4], T::default());
    for i in 0..count {
        let (x, v, f, w) = (x0[i], v0[i], force[i], own.weight[i]);
        let a = [(f[0] - drag * v[0]) * w, (f[1] - drag * v[1]) * w];
        let v_new = [v[0] + a[0] * step, v[1] + a[1] * step];
        let half = T::HALF;
        x1[i] = match motion.integrator {
            Integrator::Explicit => {
                [x[0] + (v[0] * step + half * a[0] * step * step), x[1] + (v[1] * step + half * a[1] * step * step)]
            }
            Integrator::SemiImplicit => [x[0] + v_new[0] * step, x[1] + v_new[1] * step],
        };
        v1[i] = v_new;
        let square = v_new[0] * v_new[0] + v_new[1] * v_new[1];
        sums[i % 4] += square;
        max = if square > max { square } else { max };
    }
    Speed { sum: sums.iter().map(|s| s.wide()).sum(), max }
}

/// A patch, its next positions and velocities, its weights.
type Parts<'a, T> = (((&'a mut Patch<T>, &'a mut [[T; 2]]), &'a mut [[T; 2]]), &'a mut [T]);

impl<T: Real> Stepper<T> for List<'_, T> {
    fn stride(&self) -> u32 {
        1
    }

    fn advance(&mut self, step: u32, _: u32, broken: &mut Vec<Broken>) -> Vec<Speed<T>> {
        let (motion, mass) = (&self.motion, self.mass);
        let [x0, x1] = &mut self.position;
        let [v0, v1] = &mut self.velocity;
        let (x0, v0) = (&*x0, &*v0);
        let arch = pulp::Arch::new();
        let parts = self.patches.par_iter_mut().zip(x1.par_chunks_mut(PATCH)).zip(v1.par_chunks_mut(PATCH));
        let parts = parts.zip(self.weight.par_chunks_mut(PATCH)).enumerate();
        let advance = |scratch: &mut Scratch<T>, (p, (((patch, x1), v1), weight)): (usize, Parts<'_, T>)| {
            let range = p * PATCH..p * PATCH + weight.len();
            let own = Own { before: [&x0[range.clone()], &v0[range]], after: [x1, v1], weight };
            let mut snapped = Vec::new();
            let speed = arch.dispatch(
                #[inline(always)]
                || {
                    patch.collect([x0, v0], &own, scratch);
                    let count = own.weight.len();
                    let record = |id: u32, ends: [u16; 2]| {
                        if usize::from(ends[0]) < count {
                            snapped.push(id);
                        }
                    };
                    patch.forces(motion, scratch, record);
                    move_points(motion, mass, own, &scratch.force)
                },
            );
            (speed, snapped)
        };
        let reports: Vec<_> = parts.map_init(Scratch::new, advance).collect();
        self.position.swap(0, 1);
        self.velocity.swap(0, 1);
        let mut total = Speed::default();
        for (speed, snapped) in reports {
            total.merge(speed);
            broken.extend(snapped.iter().map(|&link| Broken { step, link }));
        }
        vec![total]
    }

    fn finish(self: Box<Self>) -> [Vec<[T; 2]>; 2] {
        let back = |sorted: &[[T; 2]]| {
            let mut out = vec![[T::default(); 2]; sorted.len()];
            for (&to, &value) in self.order.iter().zip(sorted) {
                out[to as usize] = value;
            }
            out
        };
        [back(&self.position[0]), back(&self.velocity[0])]
    }
}
