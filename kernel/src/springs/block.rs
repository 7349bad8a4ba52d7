//! A block of [`super::list`]: its own points, a halo of neighbours around them in layers, and the springs between, in
//! the order in which they are computed.
//!
//! Points come in groups of eight, and groups in parts. Springs are stored with the group of their owners: the first
//! springs of the eight points side by side, then their second ones and so on, each in a *slot*. Points with fewer
//! springs than others of their group are padded with springs of stiffness 0. The *pull* of a spring is its force on
//! its owner. A group reads its points in order, gathers the far ends, and writes the pull of each slot. As soon as all
//! springs that end in a part have been computed, the points of that part sum up their pulls and move. Parts are
//! processed across the block, so the data that they exchange is still in the cache.

use super::step::Speed;
use crate::ground::real::Real;
use std::ops::Range;

/// Number of local indices, which are `u16`.
pub(super) const LOCAL: usize = 1 << 16;
/// Points that are computed together, one per lane of a wide register.
pub(super) const GROUP: usize = 8;
/// Maximum number of points of a part.
pub(super) const PART: usize = 1024;
/// The order in which the spring constants of a group are stored: that of the lanes after a shuffle. It is its own
/// inverse.
pub(super) const LANE: [usize; GROUP] = [0, 1, 4, 5, 2, 3, 6, 7];

/// The result of a stride of a block.
pub(super) struct Report<T> {
    /// The speeds of each step.
    pub(super) speeds: Vec<Speed<T>>,
    /// Springs that broke, with the step within the stride.
    pub(super) snapped: Vec<(u32, u32)>,
}

/// Consecutive groups whose points have the same number of springs.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct GroupRun {
    pub(super) groups: u16,
    /// Springs of each point.
    pub(super) each: u32,
    /// True if any spring has an offset.
    pub(super) wraps: bool,
}

/// Groups of a run whose pulls are still to be computed.
#[derive(Clone, Copy)]
pub(super) struct Batch {
    pub(super) groups: usize,
    /// Springs that each point owns.
    pub(super) own: usize,
    /// The first point, the first slot, and the index of its pull.
    pub(super) point: usize,
    pub(super) slot: usize,
    pub(super) pull: usize,
    /// Index of their offsets, if any spring has one.
    pub(super) offset: Option<usize>,
}

impl Batch {
    /// Skips groups whose pulls are computed.
    pub(super) fn skip(&mut self, groups: usize) {
        let slots = groups * self.own * GROUP;
        self.groups -= groups;
        self.point += groups * GROUP;
        self.slot += slots;
        self.pull += slots;
        self.offset = self.offset.map(|offset| offset + slots);
    }

    /// Ranges of the slots, and of their pulls.
    pub(super) fn slots(&self) -> [Range<usize>; 2] {
        [self.slot, self.pull].map(|first| first..first + self.groups * self.own * GROUP)
    }
}

/// Consecutive points of one layer.
#[derive(Clone, Copy)]
pub(super) struct BlockPart {
    pub(super) layer: u16,
    /// The first point, and the number of points: a multiple of [`GROUP`].
    pub(super) first: u16,
    pub(super) points: u16,
    /// Its first slot.
    pub(super) slot: u32,
    /// Index of its pulls, which are stored until all points have read them.
    pub(super) pulls: u16,
    /// Indices of its first offset and its first incoming spring.
    pub(super) offset: u32,
    pub(super) incoming: u32,
    /// Ranges of its runs: of the springs that its points own (`owning`), and of those that end at its points
    /// (`arriving`).
    pub(super) owning: [u32; 2],
    pub(super) arriving: [u32; 2],
    /// The parts that can move once the pulls of this one are computed, as a range of [`SpringBlock::ready`].
    pub(super) ready: [u32; 2],
}

/// Springs by groups.
pub(super) struct Slots<T> {
    /// The far end by local index.
    pub(super) far: Vec<u16>,
    /// In the order of [`LANE`]; so are the next two.
    pub(super) stiffness: Vec<T>,
    pub(super) rest: Vec<T>,
    /// Force at which each spring breaks; empty if none can.
    pub(super) threshold: Vec<T>,
    /// Damping of each spring; empty if there are no dampers.
    pub(super) damping: Vec<T>,
    /// True for springs that only push; empty if there are none.
    pub(super) pushes: Vec<bool>,
    /// Offsets of far ends; stored only for runs that have some.
    pub(super) offsets: Vec<[T; 2]>,
    /// Index into the links; `u32::MAX` for padding.
    pub(super) ids: Vec<u32>,
}

/// A block: local indices count its own points first, then layer by layer, each padded to whole groups.
pub(super) struct SpringBlock<T> {
    /// Number of points up to and including each layer; layer 0 holds the block's own points, the others are the halo.
    pub(super) layers: Vec<usize>,
    /// Index of each halo point among the published points.
    pub(super) ghosts: Vec<u32>,
    /// Own points that other blocks read.
    pub(super) published: Vec<u16>,
    /// Positions of the own points, between strides. Has [`LOCAL`] entries if a stride works on it in place: this is
    /// faster than a copy, but for a small set the memory costs more than its steps.
    pub(super) position: Vec<[T; 2]>,
    /// In the order of computation: across the block, whatever their layers.
    pub(super) parts: Vec<BlockPart>,
    /// Indices of parts that can move; see [`BlockPart::ready`].
    pub(super) ready: Vec<u16>,
    /// Runs of groups by the number of springs that each point owns, and by the number of springs of other owners that
    /// end there.
    pub(super) owning: Vec<GroupRun>,
    pub(super) arriving: Vec<GroupRun>,
    pub(super) slots: Slots<T>,
    /// Indices of the pulls of the springs that end at each point, by groups.
    pub(super) incoming: Vec<u16>,
    /// Velocities of points that move in a stride; of all points if there are dampers.
    pub(super) velocity: Vec<[T; 2]>,
    /// 1/m or 0, for x and for y, of points that move in a stride; empty if [`SpringBlock::alike`] is set.
    pub(super) weight: Vec<[T; 2]>,
    /// The weight of all points, if it is the same.
    pub(super) alike: Option<T>,
}

/// Memory of a worker.
pub(super) struct Scratch<T> {
    /// Positions by local index, [`LOCAL`] of them.
    pub(super) position: Vec<[T; 2]>,
    /// The sum of the pulls at each point.
    pub(super) force: Vec<[T; 2]>,
    /// The pull of each slot.
    pub(super) pulls: Box<[[T; 2]; LOCAL]>,
}

impl<T: Real> Default for Scratch<T> {
    fn default() -> Self {
        Self { position: vec![[T::default(); 2]; LOCAL], force: Vec::new(), pulls: zeros() }
    }
}

/// Zeros for all 16-bit indices, so that no index needs a check.
fn zeros<T: Real>() -> Box<[[T; 2]; LOCAL]> {
    vec![[T::default(); 2]; LOCAL].try_into().unwrap_or_else(|_| unreachable!("as many as asked for"))
}

impl<T: Real> SpringBlock<T> {
    /// Removes springs that broke in other blocks. `whole` marks the springs left; it is empty if none broke in the
    /// last stride.
    pub(super) fn mend(&mut self, whole: &[bool]) {
        if whole.is_empty() {
            return;
        }
        for slot in 0..self.slots.ids.len() {
            if whole.get(self.slots.ids[slot] as usize) == Some(&false) {
                self.slots.cut(slot);
            }
        }
    }

    /// Reads one number of every cache line that a stride needs, array after array: memory delivers whole arrays twice
    /// as fast as small pieces of a dozen arrays for each part.
    pub(super) fn prefetch(&self) {
        /// Reads every cache line; `black_box` keeps the compiler from removing the reads.
        fn lines<V: Copy>(of: &[V]) {
            for value in of.chunks((64 / size_of::<V>()).max(1)) {
                std::hint::black_box(value[0]);
            }
        }
        let slots = &self.slots;
        lines(&slots.far);
        lines(&slots.stiffness);
        lines(&slots.rest);
        lines(&slots.threshold);
        lines(&self.incoming);
        lines(&self.weight);
        lines(&self.velocity);
        lines(&self.position[..self.layers[0]]);
    }

    /// Copies the halo that `steps` steps read from the published points. Skips velocities that are not read.
    pub(super) fn collect(&mut self, border: &[[T; 4]], steps: usize, scratch: &mut Scratch<T>) {
        let own = self.layers[0];
        let ghosts = &self.ghosts[..self.layers[steps] - own];
        if self.position.len() == LOCAL {
            std::mem::swap(&mut self.position, &mut scratch.position);
        } else {
            scratch.position[..own].copy_from_slice(&self.position);
        }
        let points = self.layers.last().copied().unwrap_or(own);
        scratch.force.resize(points.max(scratch.force.len()), [T::default(); 2]);
        let (reads, all) = (self.velocity.len() - own, &mut scratch.position[own..]);
        let (both, places) = ghosts.split_at(reads.min(ghosts.len()));
        for ((x, v), &p) in all.iter_mut().zip(&mut self.velocity[own..]).zip(both) {
            let [px, py, vx, vy] = border[p as usize];
            (*x, *v) = ([px, py], [vx, vy]);
        }
        for (x, &p) in all[both.len()..].iter_mut().zip(places) {
            let [px, py, ..] = border[p as usize];
            *x = [px, py];
        }
    }

    /// Stores the own points and publishes those that other blocks read.
    pub(super) fn publish(&mut self, border: &mut [[T; 4]], scratch: &mut Scratch<T>) {
        for (to, &p) in border.iter_mut().zip(&self.published) {
            let p = usize::from(p);
            let ([x, y], [vx, vy]) = (scratch.position[p], self.velocity[p]);
            *to = [x, y, vx, vy];
        }
        if self.position.len() == LOCAL {
            std::mem::swap(&mut self.position, &mut scratch.position);
        } else {
            self.position.copy_from_slice(&scratch.position[..self.layers[0]]);
        }
    }
}

/// Index of the constants of a slot.
pub(super) fn lane(slot: usize) -> usize {
    slot / GROUP * GROUP + LANE[slot % GROUP]
}

impl<T: Real> Slots<T> {
    /// Removes a spring.
    pub(super) fn cut(&mut self, slot: usize) {
        self.stiffness[lane(slot)] = T::default();
        if let Some(damping) = self.damping.get_mut(slot) {
            *damping = T::default();
        }
    }
}
