//! Springs along any links.
//!
//! Points are cut into patches of as many points, part by part across the longer side; see [`super::patch`] for
//! what a patch does. A patch reads the points and springs round it as well, so many rings of neighbours as there are
//! steps in a stride, and works out what happens there by itself; so it takes a whole stride in its core's cache, and
//! writes only its own points. Every spring has one owner ([`super::owners`]), the same in every patch, and every point
//! sums the pulls of the springs it owns and then of those it does not, each by number: all patches that work a point out
//! get the same bits, and the result depends neither on patches nor on threads.

use super::layout::{Locals, longer_axis};
use super::net::{Broken, Mass, Motion, Net, SpringError};
use super::owners::{Count, offset, share};
use super::patch::{GROUP, PART, Patch, Scratch};
use super::step::Stepper;
use super::step::{Speed, weights};
use super::web::{Groups, Web};
use crate::ground::number::index_u32;
use crate::ground::real::Real;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Points from which on a stride is worth the rings: what is smaller stays in a cache.
const LARGE: usize = 1 << 18;
/// Points per patch, at most.
const PATCH: usize = 2048;
/// Points per patch where a great many springs meet.
const FEWEST: usize = 8;
/// Points per patch of large sets, at most: their rings are a smaller part.
const LARGE_PATCH: usize = 32_768;
/// Steps per stride of large sets.
const STRIDE: u32 = 6;
/// Cores among which many patches can be shared out evenly.
const CORES: usize = 4;
/// Springs per point from which on rings hold too much.
const DENSE: usize = 5;

/// Points along a curve that keeps what is near together, with their springs.
pub(super) struct Sorted<T> {
    /// Points, and where they are.
    order: Vec<u32>,
    places: Vec<[T; 2]>,
    counts: Vec<Count>,
    /// Owner and far end of each spring.
    ends: Vec<[u32; 2]>,
    /// 1/m, or 0 for fixed points.
    weight: Vec<T>,
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
    /// Places and velocities of the points that patches read of others, by patch, and those after the stride.
    border: [Vec<[T; 4]>; 2],
    /// Memory of workers that wait.
    idle: Mutex<Vec<Scratch<T>>>,
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

/// Cuts points into patches of `size`, each as square as can be: part by part across the longer side.
fn divide<T: Real>(places: &[[T; 2]], part: &mut [u32], size: usize) {
    if part.len() <= size {
        return;
    }
    let axis = longer_axis(part.iter().map(|&p| places[p as usize]));
    let along = |&p: &u32| places[p as usize][axis].wide();
    let half = part.len().div_ceil(size) / 2 * size;
    part.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
    let (a, b) = part.split_at_mut(half);
    rayon::join(|| divide(places, a, size), || divide(places, b, size));
}

impl<T: Real> Sorted<T> {
    /// Sorts points and gives springs their owners.
    pub(super) fn new(points: &[[T; 2]], net: &Net<'_, T>) -> Self {
        let code = morton(points);
        let mut order: Vec<u32> = (0..index_u32(points.len())).collect();
        order.par_sort_unstable_by_key(|&p| (code[p as usize], p));
        let rank = ranks(&order);
        let mut ends: Vec<_> = net.links.par_iter().map(|ends| ends.map(|p| rank[p as usize])).collect();
        let counts = share(points.len(), net, &mut ends);
        let weight = weights(points, net);
        Self {
            places: order.iter().map(|&p| points[p as usize]).collect(),
            weight: order.iter().map(|&p| weight[p as usize]).collect(),
            order,
            counts,
            ends,
        }
    }
}

/// Where each point is in an order.
fn ranks(order: &[u32]) -> Vec<u32> {
    let mut ranks = vec![0u32; order.len()];
    for (rank, &p) in (0..).zip(order) {
        ranks[p as usize] = rank;
    }
    ranks
}

impl<'a, T: Real> List<'a, T> {
    /// Sorts the points and hands out the springs; slices have been checked.
    pub(super) fn new(points: &[[T; 2]], net: &Net<'a, T>, motion: &Motion<T>) -> Result<Self, SpringError> {
        let sorted = Sorted::new(points, net);
        if points.len() >= LARGE && net.links.len() < points.len() * DENSE {
            for most in [LARGE_PATCH, LARGE_PATCH / 2] {
                if let Ok(list) = Self::cut(net, motion, &sorted, patch_size(points.len(), most), STRIDE) {
                    return Ok(list);
                }
            }
        }
        // The more springs meet, the fewer points a patch has room for.
        let mut patch = patch_size(points.len(), PATCH);
        loop {
            match Self::cut(net, motion, &sorted, patch, 1) {
                Err(SpringError::Crowded { .. }) if patch > FEWEST => patch = (patch / 4).max(FEWEST),
                result => return result,
            }
        }
    }

    /// Cuts sorted points into patches that take so many steps at a time.
    pub(super) fn cut(
        net: &Net<'a, T>,
        motion: &Motion<T>,
        sorted: &Sorted<T>,
        patch: usize,
        stride: u32,
    ) -> Result<Self, SpringError> {
        let mut order: Vec<u32> = (0..index_u32(sorted.order.len())).collect();
        divide(&sorted.places, &mut order, patch);
        // Parts follow each other across the longer side of a patch; in each, points with as many springs do.
        order.par_chunks_mut(patch).for_each(|own| {
            let axis = longer_axis(own.iter().map(|&p| sorted.places[p as usize]));
            let place = |p: u32| sorted.places[p as usize][axis].wide();
            own.sort_unstable_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
            let springs = |&p: &u32| {
                let Count { wraps, owned, incoming } = sorted.counts[p as usize];
                (wraps, u32::MAX - owned, u32::MAX - incoming)
            };
            own.chunks_mut(PART).for_each(|part| part.sort_by_key(springs));
        });
        let rank = ranks(&order);
        let ends: Vec<_> = sorted.ends.par_iter().map(|ends| ends.map(|p| rank[p as usize])).collect();
        drop(rank);
        let group = |end| Groups::new(order.len(), &ends, end, |id| end == 0 && offset(net, id));
        let (owned, incoming) = rayon::join(|| group(0), || group(1));
        let web = Web { net, ends, owned, incoming };
        let weight: Vec<T> = order.iter().map(|&p| sorted.weight[p as usize]).collect();
        let places: Vec<[T; 2]> = order.iter().map(|&p| sorted.places[p as usize]).collect();
        let locals = Mutex::<Vec<Locals>>::default();
        let build = |p: usize| {
            let take = || locals.lock().unwrap_or_else(PoisonError::into_inner);
            let waiting = take().pop();
            let mut mine = waiting.unwrap_or_else(|| Locals::new(order.len()));
            let patch = Patch::new(range(p, patch, order.len()), stride as usize, &web, &places, &weight, &mut mine);
            take().push(mine);
            patch
        };
        let patches: Result<Vec<_>, u32> = (0..order.len().div_ceil(patch)).into_par_iter().map(build).collect();
        let patches =
            patches.map_err(|at| SpringError::Crowded { point: sorted.order[order[at as usize] as usize] as usize })?;
        order.par_iter_mut().for_each(|p| *p = sorted.order[*p as usize]);
        let (patches, border) = introduce(patches, patch, &places);
        Ok(Self {
            motion: *motion,
            mass: net.mass,
            order,
            patches,
            patch,
            stride,
            whole: if net.threshold.is_empty() { Vec::new() } else { vec![true; net.links.len()] },
            snapped: false,
            border: [border.clone(), border],
            idle: Mutex::default(),
        })
    }

    /// Lends a worker's memory to `work`.
    fn with_scratch<R>(idle: &Mutex<Vec<Scratch<T>>>, work: impl FnOnce(&mut Scratch<T>) -> R) -> R {
        let take = || idle.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = take().pop();
        let mut scratch = waiting.unwrap_or_default();
        let result = work(&mut scratch);
        take().push(scratch);
        result
    }
}

/// Numbers the points that patches read of others: the ghosts of patches name points before, and afterwards what is
/// published. Returns that as well.
fn introduce<T: Real>(mut patches: Vec<Patch<T>>, size: usize, places: &[[T; 2]]) -> (Vec<Patch<T>>, Vec<[T; 4]>) {
    const READ: u32 = 1;
    let mut number = vec![0; places.len()];
    for &p in patches.iter().flat_map(|patch| &patch.ghosts) {
        number[p as usize] = READ;
    }
    let mut border = Vec::new();
    for (p, patch) in patches.iter_mut().enumerate() {
        for (local, p) in (0..).zip(range(p, size, places.len())) {
            if number[p] == READ {
                number[p] = index_u32(border.len());
                border.push([places[p][0], places[p][1], T::default(), T::default()]);
                patch.published.push(local);
            }
        }
    }
    for p in patches.iter_mut().flat_map(|patch| &mut patch.ghosts) {
        *p = number[*p as usize];
    }
    (patches, border)
}

/// How many points patches have if they have as many each, at most `most`, and many patches are as many for each of up to
/// four cores.
fn patch_size(points: usize, most: usize) -> usize {
    let patches = points.div_ceil(most);
    let patches = if patches > CORES / 2 { patches.next_multiple_of(CORES) } else { patches.max(1) };
    points.div_ceil(patches).next_multiple_of(GROUP).max(GROUP)
}

/// The points of a patch.
fn range(patch: usize, size: usize, points: usize) -> Range<usize> {
    patch * size..((patch + 1) * size).min(points)
}

impl<T: Real> Stepper<T> for List<'_, T> {
    fn stride(&self) -> u32 {
        self.stride
    }

    fn advance(&mut self, step: u32, steps: u32, broken: &mut Vec<Broken>) -> Vec<Speed<T>> {
        let [now, mut next] = self.border.each_mut().map(|border| &mut border[..]);
        let (stride, idle) = (self.stride, &self.idle);
        let whole = if self.snapped { &self.whole[..] } else { &[] };
        let (motion, mass) = (&self.motion, self.mass);
        let mut published = Vec::with_capacity(self.patches.len());
        for patch in &self.patches {
            published.push(next.split_off_mut(..patch.published.len()).unwrap_or_default());
        }
        let advance = |(patch, published): (&mut Patch<T>, &mut [[T; 4]])| {
            Self::with_scratch(idle, |scratch| {
                patch.mend(whole);
                if stride > 1 {
                    patch.warm();
                }
                patch.collect(now, steps as usize, scratch);
                let report = patch.advance(motion, mass, steps as usize, scratch);
                patch.publish(published, scratch);
                report
            })
        };
        let reports: Vec<_> = self.patches.par_iter_mut().zip(published).map(advance).collect();
        self.border.swap(0, 1);
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
        let mut out = [0, 1].map(|_| vec![[T::default(); 2]; self.order.len()]);
        for (order, patch) in self.order.chunks(self.patch).zip(&self.patches) {
            for ((&to, x), v) in order.iter().zip(&patch.position).zip(&patch.velocity) {
                (out[0][to as usize], out[1][to as usize]) = (*x, *v);
            }
        }
        out
    }
}
