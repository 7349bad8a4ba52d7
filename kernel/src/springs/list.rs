//! Springs along any links.
//!
//! Domain decomposition: points are divided into blocks of equal numbers of points, by halving across the longer side;
//! see [`super::block`]. A block has a halo of as many layers of neighbours as there are steps in a stride, and
//! computes their motion too. So it takes a whole stride within its core's cache without the other blocks, and writes
//! only its own points. Every spring has one owner among its two ends ([`super::owners`]), the same in every block.
//! Every point first sums the pulls of the springs that it owns and then of the others, each by index. So all blocks
//! that compute a point get the same bits, and the result depends neither on blocks nor on threads.

use super::adjacency::{Adjacency, Incidence};
use super::block::{GROUP, PART, Scratch, SpringBlock};
use super::layout::{Locals, longer_axis};
use super::net::{Broken, Mass, Motion, Net, SpringError};
use super::owners::{Count, offset, share};
use super::step::{Speed, Stepper, weights};
use crate::ground::number::index_u32;
use crate::ground::real::Real;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Number of points from which several steps per stride are worth the halo; smaller sets stay in a cache.
const LARGE: usize = 1 << 18;
/// Maximum number of points per block.
const BLOCK: usize = 2048;
/// Points per block if very many springs meet.
const FEWEST: usize = 8;
/// Maximum number of points per block of large sets, for which the halo is relatively smaller.
const LARGE_BLOCK: usize = 32_768;
/// Steps per stride of large sets.
const STRIDE: u32 = 6;
/// The number of blocks is a multiple of this, so that up to this many cores get equal shares.
const CORES: usize = 4;
/// Number of springs per point from which halos become too large.
const DENSE: usize = 5;

/// Points along a Morton curve, which keeps neighbours together, with their springs.
pub(super) struct Sorted<T> {
    /// The points in order, and their positions.
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
    blocks: Vec<SpringBlock<T>>,
    /// Points per block.
    block: usize,
    stride: u32,
    /// True for springs that have not broken; empty if none can.
    whole: Vec<bool>,
    /// True if some springs broke in the last stride.
    snapped: bool,
    /// Positions and velocities of the points that other blocks read, by block: before the stride, and after it.
    border: [Vec<[T; 4]>; 2],
    scratch: Pool<Scratch<T>>,
}

/// Memory that workers take and give back.
struct Pool<M>(Mutex<Vec<M>>);

impl<M> Pool<M> {
    const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// Lends memory to `work`; `new` makes it if the pool is empty.
    fn with<R>(&self, new: impl FnOnce() -> M, work: impl FnOnce(&mut M) -> R) -> R {
        let take = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = take().pop();
        let mut memory = waiting.unwrap_or_else(new);
        let result = work(&mut memory);
        take().push(memory);
        result
    }
}

/// The rank of each point on a Morton curve through the bounding square of all points.
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

/// Divides points into blocks of `size`, each as square as possible: halves are cut across the longer side.
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
    /// Sorts points and assigns the owners of springs.
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

/// The rank of each point in an order.
fn ranks(order: &[u32]) -> Vec<u32> {
    let mut ranks = vec![0u32; order.len()];
    for (rank, &p) in (0..).zip(order) {
        ranks[p as usize] = rank;
    }
    ranks
}

impl<'a, T: Real> List<'a, T> {
    /// Sorts the points and distributes the springs; lengths of slices have been checked.
    pub(super) fn new(points: &[[T; 2]], net: &Net<'a, T>, motion: &Motion<T>) -> Result<Self, SpringError> {
        let sorted = Sorted::new(points, net);
        if points.len() >= LARGE && net.links.len() < points.len() * DENSE {
            for most in [LARGE_BLOCK, LARGE_BLOCK / 2] {
                if let Ok(list) = Self::cut(net, motion, &sorted, block_size(points.len(), most), STRIDE) {
                    return Ok(list);
                }
            }
        }
        // The more springs meet, the fewer points fit into a block.
        let mut block = block_size(points.len(), BLOCK);
        loop {
            match Self::cut(net, motion, &sorted, block, 1) {
                Err(SpringError::Crowded { .. }) if block > FEWEST => block = (block / 4).max(FEWEST),
                result => return result,
            }
        }
    }

    /// Divides sorted points into blocks that take `stride` steps at a time.
    pub(super) fn cut(
        net: &Net<'a, T>,
        motion: &Motion<T>,
        sorted: &Sorted<T>,
        block: usize,
        stride: u32,
    ) -> Result<Self, SpringError> {
        let mut order: Vec<u32> = (0..index_u32(sorted.order.len())).collect();
        divide(&sorted.places, &mut order, block);
        // Parts are sorted along the longer side of a block; within a part, points with the same number of springs are
        // adjacent.
        order.par_chunks_mut(block).for_each(|own| {
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
        let group = |end| Incidence::new(order.len(), &ends, end, |id| end == 0 && offset(net, id));
        let (owned, incoming) = rayon::join(|| group(0), || group(1));
        let adjacency = Adjacency { net, ends, owned, incoming };
        let weight: Vec<T> = order.iter().map(|&p| sorted.weight[p as usize]).collect();
        let places: Vec<[T; 2]> = order.iter().map(|&p| sorted.places[p as usize]).collect();
        let locals = Pool::new();
        let build = |p: usize| {
            let own = range(p, block, order.len());
            let build =
                |locals: &mut Locals| SpringBlock::new(own, stride as usize, &adjacency, &places, &weight, locals);
            locals.with(|| Locals::new(order.len()), build)
        };
        let blocks: Result<Vec<_>, u32> = (0..order.len().div_ceil(block)).into_par_iter().map(build).collect();
        let blocks =
            blocks.map_err(|at| SpringError::Crowded { point: sorted.order[order[at as usize] as usize] as usize })?;
        order.par_iter_mut().for_each(|p| *p = sorted.order[*p as usize]);
        let (blocks, border) = number_border(blocks, block, &places);
        Ok(Self {
            motion: *motion,
            mass: net.mass,
            order,
            blocks,
            block,
            stride,
            whole: if net.threshold.is_empty() { Vec::new() } else { vec![true; net.links.len()] },
            snapped: false,
            border: [border.clone(), border],
            scratch: Pool::new(),
        })
    }
}

/// Numbers the points that other blocks read. `ghosts` holds indices of points before, and indices into the published
/// points afterwards. Returns the published points as well.
fn number_border<T: Real>(
    mut blocks: Vec<SpringBlock<T>>,
    size: usize,
    places: &[[T; 2]],
) -> (Vec<SpringBlock<T>>, Vec<[T; 4]>) {
    const READ: u32 = 1;
    let mut number = vec![0; places.len()];
    for &p in blocks.iter().flat_map(|block| &block.ghosts) {
        number[p as usize] = READ;
    }
    let mut border = Vec::new();
    for (p, block) in blocks.iter_mut().enumerate() {
        for (local, p) in (0..).zip(range(p, size, places.len())) {
            if number[p] == READ {
                number[p] = index_u32(border.len());
                border.push([places[p][0], places[p][1], T::default(), T::default()]);
                block.published.push(local);
            }
        }
    }
    for p in blocks.iter_mut().flat_map(|block| &mut block.ghosts) {
        *p = number[*p as usize];
    }
    (blocks, border)
}

/// Points per block: at most `most`, the same number in each block, and the same number of blocks for each of up to
/// [`CORES`] cores.
fn block_size(points: usize, most: usize) -> usize {
    let blocks = points.div_ceil(most);
    let blocks = if blocks > CORES / 2 { blocks.next_multiple_of(CORES) } else { blocks.max(1) };
    points.div_ceil(blocks).next_multiple_of(GROUP).max(GROUP)
}

/// The points of a block.
fn range(block: usize, size: usize, points: usize) -> Range<usize> {
    block * size..((block + 1) * size).min(points)
}

impl<T: Real> Stepper<T> for List<'_, T> {
    fn stride(&self) -> u32 {
        self.stride
    }

    fn advance(&mut self, step: u32, steps: u32, broken: &mut Vec<Broken>) -> Vec<Speed<T>> {
        let [now, mut next] = self.border.each_mut().map(|border| &mut border[..]);
        let (stride, pool) = (self.stride, &self.scratch);
        let whole = if self.snapped { &self.whole[..] } else { &[] };
        let (motion, mass) = (&self.motion, self.mass);
        let mut published = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            published.push(next.split_off_mut(..block.published.len()).unwrap_or_default());
        }
        let advance = |(block, published): (&mut SpringBlock<T>, &mut [[T; 4]])| {
            pool.with(Scratch::default, |scratch| {
                block.mend(whole);
                if stride > 1 {
                    block.prefetch();
                }
                block.collect(now, steps as usize, scratch);
                let report = block.advance(motion, mass, steps as usize, scratch);
                block.publish(published, scratch);
                report
            })
        };
        let reports: Vec<_> = self.blocks.par_iter_mut().zip(published).map(advance).collect();
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
        for (order, block) in self.order.chunks(self.block).zip(&self.blocks) {
            for ((&to, x), v) in order.iter().zip(&block.position).zip(&block.velocity) {
                (out[0][to as usize], out[1][to as usize]) = (*x, *v);
            }
        }
        out
    }
}
