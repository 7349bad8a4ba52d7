//! A patch of [`super::springs_list`]: some points, the rings of points round them, and the springs between, laid out so
//! that nothing is scattered.
//!
//! Springs lie side by side in spans: the first springs of points that follow each other, then their second ones and so
//! on. A span reads its near ends in order, fetches the far ends, and leaves the pulls in order in their slots. Then
//! every point takes the pulls of springs that end at it out of their slots. Points are sorted so that those with as
//! many springs of either kind follow each other.

use super::springs::{Mass, Motion, Real};
use super::springs_step::{Speed, pull, size};
use std::ops::Range;

/// What 16 bits can number.
pub(super) const LOCAL: usize = 1 << 16;
/// Points whose springs are taken side by side.
pub(super) const GROUP: usize = 8;
/// Points of a span, at most.
pub(super) const SPAN: usize = 256;

/// What a patch tells of a stride.
pub(super) struct Report<T> {
    /// The speeds of each step.
    pub(super) speeds: Vec<Speed<T>>,
    /// Springs that broke, with the step within the stride.
    pub(super) snapped: Vec<(u32, u32)>,
}

/// Springs that start at points that follow each other.
#[derive(Clone, Copy)]
pub(super) struct Span {
    /// The first point.
    pub(super) first: u16,
    /// How many; each has one spring.
    pub(super) count: u16,
    /// Where their offsets are, if any has one.
    pub(super) offsets: Option<u32>,
}

/// Springs in the order of the spans.
pub(super) struct Slots<T> {
    /// The far end by local index.
    pub(super) far: Vec<u16>,
    pub(super) stiffness: Vec<T>,
    pub(super) rest: Vec<T>,
    /// Force at which each breaks; empty if none can.
    pub(super) threshold: Vec<T>,
    /// Dampers; empty if there are none.
    pub(super) damping: Vec<T>,
    /// Springs that only push; empty if none do.
    pub(super) pushes: Vec<bool>,
    /// Offsets of far ends; only of spans that have some.
    pub(super) offsets: Vec<[T; 2]>,
    /// Index into the links.
    pub(super) ids: Vec<u32>,
}

/// A patch: local indices count its own points first, then ring by ring.
pub(super) struct Patch<T> {
    /// How many points there are up to each ring; the own ones are ring 0.
    pub(super) rings: Vec<usize>,
    /// Points of the rings, in the sorted order of all.
    pub(super) ghosts: Vec<u32>,
    pub(super) spans: Vec<Span>,
    /// How many spans and slots there are up to each ring.
    pub(super) spans_to: Vec<[usize; 2]>,
    pub(super) slots: Slots<T>,
    /// Points that follow each other and at which as many springs end.
    pub(super) runs: Vec<[u16; 2]>,
    /// How many runs there are up to each ring but the last.
    pub(super) runs_to: Vec<usize>,
    /// Slots of the springs that end at each point.
    pub(super) incoming: Vec<u16>,
    /// Velocities of points that move in a stride, or of all if there are dampers.
    pub(super) velocity: Vec<[T; 2]>,
    /// 1/m or 0, for x and for y, of points that move in a stride.
    pub(super) weight: Vec<[T; 2]>,
}

/// Memory of a worker.
pub(super) struct Scratch<T> {
    pub(super) position: Box<[[T; 2]; LOCAL]>,
    pub(super) force: Vec<[T; 2]>,
    /// The pull of each slot.
    pub(super) pulls: Box<[[T; 2]; LOCAL]>,
    size: [T; SPAN],
    apart: [[T; 2]; SPAN],
}

impl<T: Real> Default for Scratch<T> {
    fn default() -> Self {
        fn zeros<T: Real, const N: usize>() -> Box<[[T; 2]; N]> {
            vec![[T::default(); 2]; N].try_into().unwrap_or_else(|_| unreachable!("as many as asked for"))
        }
        Self {
            position: zeros(),
            force: Vec::new(),
            pulls: zeros(),
            size: [T::default(); SPAN],
            apart: [[T::default(); 2]; SPAN],
        }
    }
}

impl<T: Real> Patch<T> {
    /// Lets go of springs that broke elsewhere; `whole` says which are left, and is empty if none broke of late.
    pub(super) fn mend(&mut self, whole: &[bool]) {
        if whole.is_empty() {
            return;
        }
        for slot in self.spans_to[0][1]..self.slots.ids.len() {
            if !whole[self.slots.ids[slot] as usize] {
                self.slots.cut(slot);
            }
        }
    }

    /// Copies what the patch reads for so many steps, from all points in their order, to where local indices count.
    /// Velocities of other patches may be left out where none are read.
    pub(super) fn collect(
        &mut self,
        position: &[[T; 2]],
        velocity: &[[T; 2]],
        own: Range<usize>,
        steps: usize,
        scratch: &mut Scratch<T>,
    ) {
        let ghosts = &self.ghosts[..self.rings[steps] - own.len()];
        let (inside, outside) = scratch.position.split_at_mut(own.len());
        inside.copy_from_slice(&position[own.clone()]);
        for (to, &p) in outside.iter_mut().zip(ghosts) {
            *to = position[p as usize];
        }
        for (to, &p) in self.velocity[own.len()..].iter_mut().zip(ghosts) {
            *to = velocity[p as usize];
        }
    }

    /// The velocities of the own points.
    pub(super) fn velocity(&self) -> &[[T; 2]] {
        &self.velocity[..self.rings[0]]
    }

    /// Advances the points in the scratch memory; those of one ring less with every step.
    pub(super) fn advance(
        &mut self,
        motion: &Motion<T>,
        mass: Mass<'_, T>,
        steps: usize,
        scratch: &mut Scratch<T>,
    ) -> Report<T> {
        let mut report = Report { speeds: Vec::with_capacity(steps), snapped: Vec::new() };
        let all = (self, scratch, &mut report);
        super::simd::dispatch(
            #[inline(always)]
            move || {
                // Moved out, so that the closure can only be called by value and is compiled into its caller.
                let (patch, scratch, report) = all;
                for (step, rings) in (0..).zip((0..steps).rev()) {
                    scratch.force.clear();
                    scratch.force.resize(patch.rings[rings + 1], [T::default(); 2]);
                    let snapped = patch.pull(rings + 1, motion, scratch);
                    report.snapped.extend(snapped.into_iter().map(|id| (step, id)));
                    patch.take(rings, scratch);
                    report.speeds.push(patch.move_points(motion, mass, rings, scratch));
                }
            },
        );
        report
    }

    /// Puts the pulls of all springs up to a ring into their slots, and adds them at the points that own them. Returns
    /// the springs of own points that broke.
    #[inline(always)]
    fn pull(&mut self, ring: usize, motion: &Motion<T>, scratch: &mut Scratch<T>) -> Vec<u32> {
        let [spans, own, inner] = [self.spans_to[ring][0], self.spans_to[0][1], self.spans_to[ring - 1][1]];
        let plain = self.slots.damping.is_empty() && self.slots.pushes.is_empty();
        let mut snapped = Vec::new();
        let mut at = 0;
        for span in &self.spans[..spans] {
            let slots = at..at + usize::from(span.count);
            at = slots.end;
            if plain && super::springs_wide::pull(&self.slots, *span, slots.start, motion, scratch) == Some(true) {
                continue;
            }
            let broke = self.slots.pull(*span, slots.start, motion, &self.velocity, scratch);
            for slot in broke {
                // The far end of a spring from the last ring outwards is where it was before.
                if slot >= inner && usize::from(self.slots.far[slot]) >= self.rings[ring - 1] {
                    continue;
                }
                if slot < own {
                    snapped.push(self.slots.ids[slot]);
                }
                self.slots.cut(slot);
            }
        }
        snapped
    }

    /// Takes the pulls out of the slots at the far ends, of all points up to a ring.
    #[inline(always)]
    fn take(&self, ring: usize, scratch: &mut Scratch<T>) {
        let (mut at, mut from) = (0, 0);
        for &[points, each] in &self.runs[..self.runs_to[ring]] {
            let [points, each] = [points, each].map(usize::from);
            let incoming = &self.incoming[from..from + points * each];
            let force = &mut scratch.force[at..at + points];
            if each > 0 {
                take(incoming, each, &scratch.pulls, force);
            }
            at += points;
            from += points * each;
        }
    }

    /// Moves the points up to a ring; reports the speeds of the own ones.
    #[inline(always)]
    fn move_points(
        &mut self,
        motion: &Motion<T>,
        mass: Mass<'_, T>,
        ring: usize,
        scratch: &mut Scratch<T>,
    ) -> Speed<T> {
        let moving = self.rings[ring];
        let (x, v) = (&mut scratch.position[..moving], &mut self.velocity[..moving]);
        let (weight, force) = (&mut self.weight[..moving], &scratch.force[..moving]);
        if let Mass::Live(mass) = mass {
            for (weight, &x) in weight.iter_mut().zip(&*x).filter(|(weight, _)| weight[0] > T::default()) {
                *weight = [T::ONE / mass(x); 2];
            }
        }
        let numbers = x.as_flattened_mut().iter_mut().zip(v.as_flattened_mut());
        for ((x, v), (&force, &weight)) in numbers.zip(force.as_flattened().iter().zip(weight.as_flattened())) {
            motion.advance(force, weight, x, v);
        }
        let mut speed = Speed::default();
        speed.add_pairs(&v[..self.rings[0]]);
        speed
    }
}

/// A difference.
#[inline(always)]
fn less<T: Real>(a: [T; 2], b: [T; 2]) -> [T; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// Takes so many pulls each from the forces of points that follow each other.
#[inline(always)]
fn take<T: Real>(incoming: &[u16], each: usize, pulls: &[[T; 2]; LOCAL], force: &mut [[T; 2]]) {
    let grouped = force.len() / GROUP * GROUP;
    let (groups, rest) = incoming.split_at(grouped * each);
    let (force, force_rest) = force.split_at_mut(grouped);
    if !super::springs_wide::take(groups, each, pulls, force) {
        for (slots, force) in groups.chunks_exact(each * GROUP).zip(force.chunks_exact_mut(GROUP)) {
            for slots in slots.chunks_exact(GROUP) {
                for (force, &slot) in force.iter_mut().zip(slots) {
                    *force = less(*force, pulls[usize::from(slot)]);
                }
            }
        }
    }
    for (slots, force) in rest.chunks_exact(each).zip(force_rest) {
        for &slot in slots {
            *force = less(*force, pulls[usize::from(slot)]);
        }
    }
}

impl<T: Real> Slots<T> {
    /// Lets go of a spring.
    fn cut(&mut self, slot: usize) {
        self.stiffness[slot] = T::default();
        if let Some(damping) = self.damping.get_mut(slot) {
            *damping = T::default();
        }
    }

    /// The pulls of a span whose first slot is `at`; returns what breaks.
    #[inline(always)]
    fn pull(
        &self,
        span: Span,
        at: usize,
        motion: &Motion<T>,
        velocity: &[[T; 2]],
        scratch: &mut Scratch<T>,
    ) -> Vec<usize> {
        let (first, n) = (usize::from(span.first), usize::from(span.count));
        let near = first..first + n;
        let slots = at..at + n;
        let (far, k, rest) = (&self.far[slots.clone()], &self.stiffness[slots.clone()], &self.rest[slots.clone()]);
        let apart = &mut scratch.apart[..n];
        for ((apart, &far), &near) in apart.iter_mut().zip(far).zip(&scratch.position[near.clone()]) {
            *apart = less(scratch.position[usize::from(far)], near);
        }
        if let Some(from) = span.offsets {
            for (apart, offset) in apart.iter_mut().zip(&self.offsets[from as usize..]) {
                *apart = [apart[0] + offset[0], apart[1] + offset[1]];
            }
        }
        let (pulls, sizes) = (&mut scratch.pulls[slots.clone()], &mut scratch.size[..n]);
        let sign = motion.push_sign();
        for i in 0..n {
            let (f, force) = pull(apart[i], k[i], rest[i]);
            (pulls[i], sizes[i]) = (f, size(force, sign));
        }
        if !self.pushes.is_empty() {
            for i in (0..n).filter(|&i| self.pushes[at + i]) {
                let [dx, dy] = apart[i];
                if (dx * dx + dy * dy).sqrt() >= rest[i] {
                    pulls[i] = [T::default(); 2];
                }
            }
        }
        if !self.damping.is_empty() {
            for i in 0..n {
                let grow = less(velocity[usize::from(far[i])], velocity[first + i]);
                let [dx, dy] = apart[i];
                let square = dx * dx + dy * dy;
                let along = grow[0] * dx + grow[1] * dy;
                let s = if square > T::default() { self.damping[at + i] * along / square } else { T::default() };
                pulls[i] = [pulls[i][0] + s * dx, pulls[i][1] + s * dy];
            }
        }
        let mut broke = Vec::new();
        if !self.threshold.is_empty() {
            for i in (0..n).filter(|&i| sizes[i] > self.threshold[at + i] && k[i] != T::default()) {
                pulls[i] = [T::default(); 2];
                broke.push(at + i);
            }
        }
        for (force, pull) in scratch.force[near].as_flattened_mut().iter_mut().zip(pulls.as_flattened()) {
            *force += *pull;
        }
        broke
    }
}
