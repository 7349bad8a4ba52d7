//! A block of [`super::list`]: its own points, a halo of neighbours around them in layers, and the springs between, in
//! the order in which they are computed.
//!
//! Points come in groups of eight, and groups in parts. Springs are stored with the group of their owners: the first
//! springs of the eight points side by side, then their second ones and so on, a *slot* each; points with fewer springs
//! than others of their group are padded with springs of no stiffness. The *pull* of a spring is its force on its
//! owner. A group reads its points in order, gathers the far ends, and writes the pull of each slot. As soon as all
//! springs that end in a part have been computed, the points of that part sum up their pulls and move. Parts follow
//! each other across the block, so what they exchange is still in the cache.

use super::step::Speed;
use crate::ground::real::Real;
use std::ops::Range;

/// How many numbers 16 bits hold: local indices are `u16`.
pub(super) const LOCAL: usize = 1 << 16;
/// Points that are computed together, one per lane of a wide register.
pub(super) const GROUP: usize = 8;
/// Points of a part, at most.
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
pub(super) struct Run {
    pub(super) groups: u16,
    /// Springs of each point.
    pub(super) each: u32,
    /// Whether any has an offset.
    pub(super) wraps: bool,
}

/// Groups of a run whose pulls are still to be computed.
#[derive(Clone, Copy)]
pub(super) struct Batch {
    pub(super) groups: usize,
    /// Springs that each point owns.
    pub(super) own: usize,
    /// The first point, the first slot, and where its pull goes.
    pub(super) point: usize,
    pub(super) slot: usize,
    pub(super) pull: usize,
    /// Where their offsets are, if any has one.
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

    /// The slots, and where their pulls go.
    pub(super) fn slots(&self) -> [Range<usize>; 2] {
        [self.slot, self.pull].map(|first| first..first + self.groups * self.own * GROUP)
    }
}

/// Consecutive points of one layer.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub(super) layer: u16,
    /// The first point, and how many there are: a multiple of [`GROUP`].
    pub(super) first: u16,
    pub(super) points: u16,
    /// Its first slot.
    pub(super) slot: u32,
    /// Where its pulls are stored until all points have read them.
    pub(super) pulls: u16,
    /// Where its offsets and incoming springs start.
    pub(super) offset: u32,
    pub(super) incoming: u32,
    /// Its runs, by number: of springs that its points own, and of springs that end at them.
    pub(super) owning: [u32; 2],
    pub(super) arriving: [u32; 2],
    /// The parts that can move once the pulls of this one are computed, as a range of [`Block::ready`].
    pub(super) ready: [u32; 2],
}

/// Springs by groups.
pub(super) struct Slots<T> {
    /// The far end by local index.
    pub(super) far: Vec<u16>,
    /// In the order of [`LANE`]; so are the next two.
    pub(super) stiffness: Vec<T>,
    pub(super) rest: Vec<T>,
    /// Force at which each breaks; empty if none can.
    pub(super) threshold: Vec<T>,
    /// Dampers; empty if there are none.
    pub(super) damping: Vec<T>,
    /// Springs that only push; empty if none do.
    pub(super) pushes: Vec<bool>,
    /// Offsets of far ends; only of runs that have some.
    pub(super) offsets: Vec<[T; 2]>,
    /// Index into the links; `u32::MAX` for padding.
    pub(super) ids: Vec<u32>,
}

/// A block: local indices count its own points first, then layer by layer, each padded to whole groups.
pub(super) struct Block<T> {
    /// How many points there are up to and with each layer; layer 0 is the block's own points, the others are the halo.
    pub(super) layers: Vec<usize>,
    /// Index of each halo point among the points that blocks publish.
    pub(super) ghosts: Vec<u32>,
    /// Own points that other blocks read.
    pub(super) published: Vec<u16>,
    /// Positions of the own points, between strides. Has room for [`LOCAL`] where a stride works on it in place: that
    /// is quicker than a copy, but the room costs more than a small set's steps.
    pub(super) position: Vec<[T; 2]>,
    /// In the order in which they are computed: across the block, whatever their layers.
    pub(super) parts: Vec<Part>,
    /// Parts that can move, by number.
    pub(super) ready: Vec<u16>,
    /// Runs of groups by how many springs each point owns, and by how many springs of other owners end there.
    pub(super) owning: Vec<Run>,
    pub(super) arriving: Vec<Run>,
    pub(super) slots: Slots<T>,
    /// Where the pulls of the springs that end at each point are stored, by groups.
    pub(super) incoming: Vec<u16>,
    /// Velocities of points that move in a stride, or of all if there are dampers.
    pub(super) velocity: Vec<[T; 2]>,
    /// 1/m or 0, for x and for y, of points that move in a stride; empty if all have [`Block::alike`].
    pub(super) weight: Vec<[T; 2]>,
    /// The one weight of all points.
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

/// As many as 16 bits can index, so that no index needs a check.
fn zeros<T: Real>() -> Box<[[T; 2]; LOCAL]> {
    vec![[T::default(); 2]; LOCAL].try_into().unwrap_or_else(|_| unreachable!("as many as asked for"))
}

impl<T: Real> Block<T> {
    /// Removes springs that broke in other blocks; `whole` says which are left, and is empty if none broke in the last
    /// stride.
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
    /// as fast as the small pieces of a dozen arrays that each part reads.
    pub(super) fn prefetch(&self) {
        /// Touches every cache line; `black_box` keeps the compiler from leaving that out.
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

    /// Copies the halo that `steps` steps read from the published points. Velocities may be left out where none are
    /// read.
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

    /// Keeps the own points and publishes those that other blocks read.
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

/// Where the constants of a slot are stored.
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
