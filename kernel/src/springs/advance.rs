//! Steps of a block of [`super::list`]: parts compute pulls, and a part moves as soon as all of its pulls are computed.

use super::block::{Batch, BlockPart, GROUP, Report, Scratch, Slots, SpringBlock, lane};
use super::moving::{Moving, less};
use super::net::{Mass, Motion};
use super::step::{Speed, pull, size};
use super::wide;
use crate::ground::real::Real;

impl<T: Real> SpringBlock<T> {
    /// Advances the points in the scratch memory; each step computes one layer of the halo less.
    pub(super) fn advance(
        &mut self,
        motion: &Motion<T>,
        mass: Mass<'_, T>,
        steps: usize,
        scratch: &mut Scratch<T>,
    ) -> Report<T> {
        let mut report = Report { speeds: Vec::with_capacity(steps), snapped: Vec::new() };
        let all = (self, scratch, &mut report);
        crate::ground::simd::dispatch(
            #[inline(always)]
            move || {
                // Moved out, so that the closure can only be called by value and is inlined into its caller.
                let (block, scratch, report) = all;
                for (step, layer) in (0..).zip((0..steps).rev()) {
                    let mut speed = Speed::default();
                    let snapped = block.step(layer, motion, mass, scratch, &mut speed);
                    report.snapped.extend(snapped.into_iter().map(|id| (step, id)));
                    report.speeds.push(speed);
                }
            },
        );
        report
    }

    /// Moves the points of the layers up to `layer`. Returns the springs of own points that broke.
    #[inline(always)]
    fn step(
        &mut self,
        layer: usize,
        motion: &Motion<T>,
        mass: Mass<'_, T>,
        scratch: &mut Scratch<T>,
        speed: &mut Speed<T>,
    ) -> Vec<u32> {
        let mut snapped = Vec::new();
        for p in 0..self.parts.len() {
            let part = self.parts[p];
            if usize::from(part.layer) > layer + 1 {
                continue;
            }
            for slot in self.pull(part, motion, scratch) {
                // A spring that leads outwards from the last layer has a far end that was not moved.
                if usize::from(part.layer) > layer && usize::from(self.slots.far[slot]) >= self.layers[layer] {
                    continue;
                }
                if part.layer == 0 {
                    snapped.push(self.slots.ids[slot]);
                }
                self.slots.cut(slot);
            }
            for r in part.ready[0]..part.ready[1] {
                let part = self.parts[usize::from(self.ready[r as usize])];
                if usize::from(part.layer) <= layer {
                    self.settle(part, motion, mass, scratch, speed);
                }
            }
        }
        snapped
    }

    /// Computes the pulls of a part's springs and their sums at the owners. Returns the slots whose springs break.
    #[inline(always)]
    fn pull(&self, part: BlockPart, motion: &Motion<T>, scratch: &mut Scratch<T>) -> Vec<usize> {
        let plain = self.slots.damping.is_empty() && self.slots.pushes.is_empty();
        let mut broke = Vec::new();
        let (mut point, mut slot, mut offset) = (usize::from(part.first), part.slot as usize, part.offset as usize);
        let mut pull = usize::from(part.pulls);
        for run in &self.owning[part.owning[0] as usize..part.owning[1] as usize] {
            let (groups, own) = (usize::from(run.groups), run.each as usize);
            let mut batch = Batch { groups, own, point, slot, pull, offset: run.wraps.then_some(offset) };
            while batch.groups > 0 {
                let done = if plain { wide::pull(&self.slots, batch, motion, scratch) } else { 0 };
                batch.skip(done);
                // The wide loops cannot compute this group, or springs in it break.
                if batch.groups > 0 {
                    self.slots.pull(batch, motion, &self.velocity, scratch, &mut broke);
                    batch.skip(1);
                }
            }
            let slots = groups * own * GROUP;
            (point, slot, pull) = (point + groups * GROUP, slot + slots, pull + slots);
            offset += if run.wraps { slots } else { 0 };
        }
        broke
    }

    /// Adds the pulls of the springs that end at a part's points, and moves the points. Records the speeds of own
    /// points.
    #[inline(always)]
    fn settle(
        &mut self,
        part: BlockPart,
        motion: &Motion<T>,
        mass: Mass<'_, T>,
        scratch: &mut Scratch<T>,
        speed: &mut Speed<T>,
    ) {
        let all = usize::from(part.first)..usize::from(part.first) + usize::from(part.points);
        if let Mass::Live(mass) = mass {
            let weights = self.weight[all.clone()].iter_mut().zip(&scratch.position[all.clone()]);
            for (weight, &x) in weights.filter(|(weight, _)| weight[0] > T::default()) {
                *weight = [T::ONE / mass(x); 2];
            }
        }
        let (mut at, mut from) = (all.start, part.incoming as usize);
        for run in &self.arriving[part.arriving[0] as usize..part.arriving[1] as usize] {
            let (points, each) = (usize::from(run.groups) * GROUP, run.each as usize);
            let incoming = &self.incoming[from..from + points * each];
            let mut moving = Moving {
                force: &mut scratch.force[at..at + points],
                alike: self.alike.unwrap_or_default(),
                weight: if self.alike.is_none() { Some(&self.weight[at..at + points]) } else { None },
                x: &mut scratch.position[at..at + points],
                v: &mut self.velocity[at..at + points],
            };
            if !wide::settle(incoming, each, moving.borrow(), motion, &scratch.pulls) {
                moving.settle(incoming, each, motion, &scratch.pulls);
            }
            at += points;
            from += points * each;
        }
        if part.layer == 0 {
            let velocities = &self.velocity[all];
            speed.add(velocities.as_flattened());
            if motion.settle > T::default() {
                speed.fastest(velocities.iter().copied());
            }
        }
    }
}

impl<T: Real> Slots<T> {
    /// Computes the pulls of the first group of a batch. Adds the slots whose springs break to `broke`.
    #[inline(always)]
    fn pull(
        &self,
        batch: Batch,
        motion: &Motion<T>,
        velocity: &[[T; 2]],
        scratch: &mut Scratch<T>,
        broke: &mut Vec<usize>,
    ) {
        let sign = motion.push_sign();
        let mut forces = [[T::default(); 2]; GROUP];
        for i in 0..batch.own * GROUP {
            let (slot, near) = (batch.slot + i, batch.point + i % GROUP);
            let (far, at) = (usize::from(self.far[slot]), lane(slot));
            let [mut dx, mut dy] = less(scratch.position[far], scratch.position[near]);
            if let Some(offset) = batch.offset {
                let offset = self.offsets[offset + i];
                (dx, dy) = (dx + offset[0], dy + offset[1]);
            }
            let (k, rest) = (self.stiffness[at], self.rest[at]);
            let ([mut fx, mut fy], f) = pull([dx, dy], k, rest);
            let square = dx * dx + dy * dy;
            if self.pushes.get(slot) == Some(&true) && square.sqrt() >= rest {
                (fx, fy) = (T::default(), T::default());
            }
            if let Some(&damping) = self.damping.get(slot) {
                let grow = less(velocity[far], velocity[near]);
                let along = grow[0] * dx + grow[1] * dy;
                let s = if square > T::default() { damping * along / square } else { T::default() };
                (fx, fy) = (fx + s * dx, fy + s * dy);
            }
            if self.threshold.get(at).is_some_and(|&most| size(f, sign) > most) && k != T::default() {
                (fx, fy) = (T::default(), T::default());
                broke.push(slot);
            }
            scratch.pulls[batch.pull + i] = [fx, fy];
            forces[i % GROUP] = [forces[i % GROUP][0] + fx, forces[i % GROUP][1] + fy];
        }
        scratch.force[batch.point..batch.point + GROUP].copy_from_slice(&forces);
    }
}
