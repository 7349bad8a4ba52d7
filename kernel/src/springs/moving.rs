//! Moves the points of a block once all of their pulls are computed.

use super::block::{GROUP, LOCAL};
use super::net::Motion;
use crate::ground::real::Real;

/// The points of a run, ready to move.
pub(super) struct Moving<'p, T> {
    /// For each point, the sum of the pulls of the springs that it owns.
    pub(super) force: &'p mut [[T; 2]],
    /// 1/m of each point; `None` if all have the same.
    pub(super) weight: Option<&'p [[T; 2]]>,
    pub(super) alike: T,
    pub(super) x: &'p mut [[T; 2]],
    pub(super) v: &'p mut [[T; 2]],
}

impl<T: Real> Moving<'_, T> {
    /// Reborrows all slices.
    pub(super) fn borrow(&mut self) -> Moving<'_, T> {
        Moving { force: self.force, weight: self.weight, alike: self.alike, x: self.x, v: self.v }
    }

    /// Adds the pulls of the springs that end at the points, `each` per point, and moves the points.
    #[inline(always)]
    pub(super) fn settle(self, incoming: &[u16], each: usize, motion: &Motion<T>, pulls: &[[T; 2]; LOCAL]) {
        let groups = self.force.as_chunks_mut::<GROUP>().0.iter_mut();
        let groups = groups.zip(self.x.as_chunks_mut::<GROUP>().0).zip(self.v.as_chunks_mut::<GROUP>().0);
        for (i, ((force, x), v)) in groups.enumerate() {
            for slots in incoming[i * each * GROUP..(i + 1) * each * GROUP].chunks_exact(GROUP) {
                for (force, &slot) in force.iter_mut().zip(slots) {
                    *force = less(*force, pulls[usize::from(slot)]);
                }
            }
            let weight = self.weight.map_or([[self.alike; 2]; GROUP], |weight| weight.as_chunks::<GROUP>().0[i]);
            advance(motion, force, &weight, x, v);
        }
    }
}

/// Moves the points of a group by one step.
#[inline(always)]
fn advance<T: Real>(
    motion: &Motion<T>,
    force: &[[T; 2]; GROUP],
    weight: &[[T; 2]; GROUP],
    x: &mut [[T; 2]; GROUP],
    v: &mut [[T; 2]; GROUP],
) {
    let numbers = x.as_flattened_mut().iter_mut().zip(v.as_flattened_mut());
    for ((x, v), (&force, &weight)) in numbers.zip(force.as_flattened().iter().zip(weight.as_flattened())) {
        motion.advance(force, weight, x, v);
    }
}

/// a - b.
#[inline(always)]
pub(super) fn less<T: Real>(a: [T; 2], b: [T; 2]) -> [T; 2] {
    [a[0] - b[0], a[1] - b[1]]
}
