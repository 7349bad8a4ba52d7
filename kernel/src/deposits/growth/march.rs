//! Fast marching (J. Sethian, 1996): times of a front, |∇T| = slowness, in the order in which the front goes.
//!
//! Cells of equal time are taken in the order of their index, so the result has the same bits everywhere. O(n log n).
use super::Plan;
use crate::ground::number::{index_u32, narrow};
use crate::ground::stop::Until;
use glam::{DVec2, I64Vec2};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Radius, in cells, within which times from a seed are straight distances.
const NEAR: f64 = 1.6;

/// Cells between two checks for cancellation.
const CHECK: usize = 1 << 14;

/// The start of a colony.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seed {
    /// Its place in mm.
    pub place: DVec2,
    /// The moment at which it starts.
    pub start: f64,
    /// The number of its colony.
    pub owner: u32,
}

/// Times and colonies by cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// The moment at which the front comes; infinite where it does not.
    pub times: Vec<f32>,
    /// The number of the colony, 0 if none comes.
    pub owners: Vec<u32>,
}

struct March<'a> {
    plan: &'a Plan,
    slowness: &'a [f32],
    arrival: Arrival,
    done: Vec<bool>,
    heap: BinaryHeap<Reverse<u64>>,
}

impl March<'_> {
    /// Offers a cell a time; the bits of positive numbers have the order of the numbers.
    fn offer(&mut self, cell: usize, time: f32, owner: u32) {
        let (times, owners) = (&mut self.arrival.times[cell], &mut self.arrival.owners[cell]);
        if self.done[cell] || !time.is_finite() || time > *times || (time == *times && owner >= *owners) {
            return;
        }
        (*times, *owners) = (time, owner);
        self.heap.push(Reverse((u64::from(time.to_bits()) << 32) | u64::from(index_u32(cell))));
    }

    fn sow(&mut self, seed: &Seed) {
        let middle = (seed.place / self.plan.cell).floor().as_i64vec2();
        for (x, y) in (-2..=2).flat_map(|y| (-2..=2).map(move |x| (x, y))) {
            let at = middle + I64Vec2::new(x, y);
            let away = (at.as_dvec2() + 0.5) * self.plan.cell - seed.place;
            if (away / self.plan.cell).length() > NEAR {
                continue;
            }
            let Some(cell) = self.plan.index(at) else { continue };
            let time = narrow(seed.start + away.length() * f64::from(self.slowness[cell]));
            self.offer(cell, time, seed.owner);
        }
    }

    /// The earlier of two neighbours on a line through a cell that the front has reached: time and owner.
    fn first(&self, cell: usize, way: I64Vec2) -> Option<(f32, u32)> {
        let reached = |by: I64Vec2| {
            let beside = self.plan.beside(cell, by).filter(|beside| self.done[*beside])?;
            Some((self.arrival.times[beside], self.arrival.owners[beside]))
        };
        match (reached(-way), reached(way)) {
            (Some(a), Some(b)) => Some(if (b.0, b.1) < (a.0, a.1) { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// Time of a cell from its neighbours.
    fn update(&mut self, cell: usize) {
        let slowness = f64::from(self.slowness[cell]);
        if self.done[cell] || !slowness.is_finite() {
            return;
        }
        let (across, along) = (self.first(cell, I64Vec2::X), self.first(cell, I64Vec2::Y));
        let size = self.plan.cell;
        let alone =
            |side: Option<(f32, u32)>, h: f64| side.map(|(time, owner)| (f64::from(time) + h * slowness, owner));
        let mut best = match (alone(across, size.x), alone(along, size.y)) {
            (Some(a), Some(b)) => Some(if b.0 < a.0 { b } else { a }),
            (a, b) => a.or(b),
        };
        if let (Some((a, owner)), Some((b, other))) = (across, along) {
            let owner = if (b, other) < (a, owner) { other } else { owner };
            let (a, b) = (f64::from(a), f64::from(b));
            // ((T - a) / hx)² + ((T - b) / hy)² = s²
            let (p, q) = (1.0 / (size.x * size.x), 1.0 / (size.y * size.y));
            let mean = (p * a + q * b) / (p + q);
            let rest = mean * mean - (p * a * a + q * b * b - slowness * slowness) / (p + q);
            let time = mean + rest.max(0.0).sqrt();
            if rest >= 0.0 && time >= a.max(b) && best.is_none_or(|best| time < best.0) {
                best = Some((time, owner));
            }
        }
        if let Some((time, owner)) = best {
            self.offer(cell, narrow(time), owner);
        }
    }
}

/// Marches a front from the cells that have `started`, whose colony is number 1, and from seeds. `None` if stopped.
pub fn march(plan: &Plan, slowness: &[f32], (started, seeds): (&[bool], &[Seed]), until: Until<'_>) -> Option<Arrival> {
    let count = plan.len();
    let mut march = March {
        plan,
        slowness,
        arrival: Arrival { times: vec![f32::INFINITY; count], owners: vec![0; count] },
        done: vec![false; count],
        heap: BinaryHeap::new(),
    };
    (0..count).filter(|cell| started[*cell]).for_each(|cell| march.offer(cell, 0.0, 1));
    seeds.iter().for_each(|seed| march.sow(seed));
    let mut steps = 0;
    while let Some(Reverse(key)) = march.heap.pop() {
        steps += 1;
        if steps % CHECK == 0 && until() {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, reason = "the lower half is an index")]
        let cell = key as u32 as usize;
        if std::mem::replace(&mut march.done[cell], true) {
            continue;
        }
        for by in [I64Vec2::X, I64Vec2::Y, I64Vec2::NEG_X, I64Vec2::NEG_Y] {
            if let Some(beside) = plan.beside(cell, by) {
                march.update(beside);
            }
        }
    }
    Some(march.arrival)
}
