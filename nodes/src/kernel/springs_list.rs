//! Springs along any links.
//!
//! Points are sorted along a Morton curve and cut into patches of fixed size; see [`super::springs_patch`] for what a
//! patch does. A patch reads the points and springs round it as well, so many rings of neighbours as there are steps in
//! a stride, and works out what happens there by itself; so it takes a whole stride in its core's cache, and writes
//! only its own points. Every spring has one owner, the same in every patch, and every point sums the pulls of the
//! springs it owns and then of those it does not, each by number: all patches that work a point out get the same bits,
//! and the result depends neither on patches nor on threads.

use super::lattice::index;
use super::springs::{Broken, Mass, Motion, Net, Real, SpringError, Stepper};
use super::springs_patch::{Patch, Scratch};
use super::springs_step::{Speed, weights};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Points from which on a stride is worth the rings: what is smaller stays in a cache.
const LARGE: usize = 1 << 18;
/// Points per patch.
const PATCH: usize = 2048;
/// Points per patch where a great many springs meet.
const FEWEST: usize = 8;
/// Points per patch of large sets: their rings are a smaller part.
const LARGE_PATCH: usize = 16_384;
/// Steps per stride of large sets.
const STRIDE: u32 = 4;
/// Points among which those with as many springs are put side by side; more would be further apart than a cache holds.
const ALIKE: usize = 1024;
/// Springs per point from which on rings hold too much.
const DENSE: usize = 5;

/// A net as patches see it: points by their place in the sorted order.
pub(super) struct Web<'n, 'a, T> {
    pub(super) net: &'n Net<'a, T>,
    /// Owner and far end of each spring.
    pub(super) ends: Vec<[u32; 2]>,
    /// Springs by owner, those without offset before the others, and by far end; else by number.
    pub(super) owned: Groups,
    pub(super) incoming: Groups,
}

/// Points in the order of the curve, with their springs.
pub(super) struct Sorted<T> {
    order: Vec<u32>,
    /// As [`share`] gives them.
    counts: Vec<(bool, u32, u32)>,
    /// Owner and far end of each spring.
    ends: Vec<[u32; 2]>,
    /// 1/m, or 0 for fixed points.
    weight: Vec<T>,
}

/// Springs in groups, one per point.
pub(super) struct Groups {
    starts: Vec<u32>,
    springs: Vec<u32>,
}

impl Groups {
    /// Groups springs by one of their ends, some of them behind the others.
    fn new(points: usize, ends: &[[u32; 2]], end: usize, last: impl Fn(u32) -> bool) -> Self {
        let mut starts = vec![0; points + 1];
        for ends in ends {
            starts[ends[end] as usize + 1] += 1;
        }
        for i in 0..points {
            starts[i + 1] += starts[i];
        }
        let (mut next, mut springs) = (starts.clone(), vec![0; ends.len()]);
        for late in [false, true] {
            for (id, ends) in (0..).zip(ends).filter(|&(id, _)| last(id) == late) {
                let place = &mut next[ends[end] as usize];
                springs[*place as usize] = id;
                *place += 1;
            }
        }
        Self { starts, springs }
    }

    /// The springs of a point.
    pub(super) fn of(&self, point: u32) -> &[u32] {
        let point = point as usize;
        &self.springs[self.starts[point] as usize..self.starts[point + 1] as usize]
    }
}

impl<T: Real> Web<'_, '_, T> {
    /// Whether a spring has an offset.
    pub(super) fn wraps(&self, spring: u32) -> bool {
        offset(self.net, spring)
    }
}

/// Whether a spring has an offset.
fn offset<T: Real>(net: &Net<'_, T>, spring: u32) -> bool {
    net.wraps.get(spring as usize).is_some_and(|&w| w != [0, 0])
}

/// A lattice of springs in motion.
pub(super) struct List<'a, T> {
    motion: Motion<T>,
    mass: Mass<'a, T>,
    order: Vec<u32>,
    patches: Vec<Patch<T>>,
    /// Points per patch.
    patch: usize,
    stride: u32,
    /// Springs that have not broken; empty where none can.
    whole: Vec<bool>,
    /// Whether some broke in the last stride.
    snapped: bool,
    /// Positions, and those after the stride.
    position: [Vec<[T; 2]>; 2],
    /// Velocities, where patches need those of others, and those after the stride.
    velocity: [Vec<[T; 2]>; 2],
    /// Memory of workers that wait.
    idle: Mutex<Vec<Box<Scratch<T>>>>,
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

/// Gives each spring to the end that owns fewer so far, in place of the order of its ends. Returns for each point
/// whether it owns a spring with an offset, how many it owns, and how many others it has.
fn share<T: Real>(points: usize, net: &Net<'_, T>, ends: &mut [[u32; 2]]) -> Vec<(bool, u32, u32)> {
    let mut counts = vec![(false, 0u32, 0u32); points];
    for (id, ends) in (0..).zip(ends) {
        let lead = |p: u32| i64::from(counts[p as usize].1) - i64::from(counts[p as usize].2);
        // The offset is that of the second end from the first.
        let wraps = offset(net, id);
        if !wraps && lead(ends[1]) < lead(ends[0]) {
            ends.reverse();
        }
        let [owner, far] = ends.map(|p| p as usize);
        counts[owner].0 |= wraps;
        counts[owner].1 += 1;
        counts[far].2 += 1;
    }
    counts
}

impl<T: Real> Sorted<T> {
    /// Sorts points and gives springs their owners.
    pub(super) fn new(points: &[[T; 2]], net: &Net<'_, T>) -> Self {
        let code = morton(points);
        let mut order: Vec<u32> = (0..index(points.len())).collect();
        order.par_sort_unstable_by_key(|&p| (code[p as usize], p));
        let mut ends = net.links.to_vec();
        let counts = share(points.len(), net, &mut ends);
        Self { order, counts, ends, weight: weights(points, net) }
    }
}

impl<'a, T: Real> List<'a, T> {
    /// Sorts the points and hands out the springs; slices have been checked.
    pub(super) fn new(points: &[[T; 2]], net: &Net<'a, T>, motion: &Motion<T>) -> Result<Self, SpringError> {
        let sorted = Sorted::new(points, net);
        let large = points.len() >= LARGE && net.links.len() < points.len() * DENSE;
        // Half as many have room where a point has four springs and not three.
        let patch = if net.links.len() * 10 < points.len() * 32 { LARGE_PATCH } else { LARGE_PATCH / 2 };
        if large && let Ok(list) = Self::cut(points, net, motion, &sorted, patch, STRIDE) {
            return Ok(list);
        }
        // The more springs meet, the fewer points a patch has room for.
        let mut patch = PATCH;
        loop {
            match Self::cut(points, net, motion, &sorted, patch, 1) {
                Err(SpringError::Crowded { .. }) if patch > FEWEST => patch /= 4,
                result => return result,
            }
        }
    }

    /// Cuts sorted points into patches that take so many steps at a time.
    pub(super) fn cut(
        points: &[[T; 2]],
        net: &Net<'a, T>,
        motion: &Motion<T>,
        sorted: &Sorted<T>,
        patch: usize,
        stride: u32,
    ) -> Result<Self, SpringError> {
        let mut order = sorted.order.clone();
        // Points with as many springs side by side.
        let alike = |&p: &u32| {
            let (wraps, owned, incoming) = sorted.counts[p as usize];
            (wraps, u32::MAX - owned, u32::MAX - incoming)
        };
        order.par_chunks_mut(ALIKE.min(patch)).for_each(|part| part.sort_by_key(alike));
        let mut rank = vec![0u32; order.len()];
        for (to, &from) in (0u32..).zip(&order) {
            rank[from as usize] = to;
        }
        let ends: Vec<_> = sorted.ends.par_iter().map(|ends| ends.map(|p| rank[p as usize])).collect();
        drop(rank);
        let group = |end| Groups::new(order.len(), &ends, end, |id| end == 0 && offset(net, id));
        let (owned, incoming) = rayon::join(|| group(0), || group(1));
        let web = Web { net, ends, owned, incoming };
        let weight: Vec<T> = order.iter().map(|&p| sorted.weight[p as usize]).collect();
        let build = |p: usize| Patch::new(range(p, patch, order.len()), stride as usize, &web, &weight);
        let patches: Result<Vec<_>, u32> = (0..order.len().div_ceil(patch)).into_par_iter().map(build).collect();
        let patches = patches.map_err(|at| SpringError::Crowded { point: order[at as usize] as usize })?;
        let position: Vec<[T; 2]> = order.iter().map(|&p| points[p as usize]).collect();
        let shared = if stride > 1 || !net.damping.is_empty() { order.len() } else { 0 };
        let velocity = vec![[T::default(); 2]; shared];
        Ok(Self {
            motion: *motion,
            mass: net.mass,
            order,
            patches,
            patch,
            stride,
            whole: if net.threshold.is_empty() { Vec::new() } else { vec![true; net.links.len()] },
            snapped: false,
            position: [position.clone(), position],
            velocity: [velocity.clone(), velocity],
            idle: Mutex::default(),
        })
    }

    /// Lends a worker's memory to `work`.
    fn with_scratch<R>(idle: &Mutex<Vec<Box<Scratch<T>>>>, work: impl FnOnce(&mut Scratch<T>) -> R) -> R {
        let take = || idle.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = take().pop();
        let mut scratch = waiting.unwrap_or_default();
        let result = work(&mut scratch);
        take().push(scratch);
        result
    }
}

/// A patch, and where its positions and velocities go.
type Part<'a, T> = ((&'a mut Patch<T>, &'a mut [[T; 2]]), &'a mut [[T; 2]]);

/// The points of a patch.
fn range(patch: usize, size: usize, points: usize) -> Range<usize> {
    patch * size..((patch + 1) * size).min(points)
}

impl<T: Real> Stepper<T> for List<'_, T> {
    fn stride(&self) -> u32 {
        self.stride
    }

    fn advance(&mut self, step: u32, steps: u32, broken: &mut Vec<Broken>) -> Vec<Speed<T>> {
        let [x0, x1] = &mut self.position;
        let [v0, v1] = &mut self.velocity;
        let (points, size, idle) = (x0.len(), self.patch, &self.idle);
        let whole = if self.snapped { &self.whole[..] } else { &[] };
        let (motion, mass) = (&self.motion, self.mass);
        let mut velocities: Vec<&mut [[T; 2]]> = v1.chunks_mut(size).collect();
        velocities.resize_with(self.patches.len(), || &mut []);
        let parts = self.patches.par_iter_mut().zip(x1.par_chunks_mut(size)).zip(velocities);
        let advance = |(p, ((patch, x), v)): (usize, Part<'_, T>)| {
            Self::with_scratch(idle, |scratch| {
                patch.mend(whole);
                patch.collect(x0, v0, range(p, size, points), steps as usize, scratch);
                let report = patch.advance(motion, mass, steps as usize, scratch);
                x.copy_from_slice(&scratch.position[..x.len()]);
                v.copy_from_slice(&patch.velocity()[..v.len()]);
                report
            })
        };
        let reports: Vec<_> = parts.enumerate().map(advance).collect();
        self.position.swap(0, 1);
        self.velocity.swap(0, 1);
        let mut totals = vec![Speed::default(); steps as usize];
        self.snapped = false;
        for report in reports {
            for (total, speed) in totals.iter_mut().zip(report.speeds) {
                total.merge(speed);
            }
            for (after, link) in report.snapped {
                broken.push(Broken { step: step + after, link });
                self.whole[link as usize] = false;
                self.snapped = true;
            }
        }
        totals
    }

    fn finish(self: Box<Self>) -> [Vec<[T; 2]>; 2] {
        let back = |sorted: &mut dyn Iterator<Item = [T; 2]>| {
            let mut out = vec![[T::default(); 2]; self.order.len()];
            for (&to, value) in self.order.iter().zip(sorted) {
                out[to as usize] = value;
            }
            out
        };
        let velocities = &mut self.patches.iter().flat_map(Patch::velocity).copied();
        [back(&mut self.position[0].iter().copied()), back(velocities)]
    }
}
