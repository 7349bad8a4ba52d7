//! The springs of a net, indexed by their end points.

use super::net::Net;
use super::owners::offset;
use crate::ground::real::Real;

/// A net with the springs of each point; points are numbered in the sorted order.
pub(super) struct Adjacency<'n, 'a, T> {
    pub(super) net: &'n Net<'a, T>,
    /// Owner and far end of each spring.
    pub(super) ends: Vec<[u32; 2]>,
    /// Springs by owner. Within a list, those without offset come first, sorted by far end; the others are sorted by
    /// index.
    pub(super) owned: Incidence,
    pub(super) incoming: Incidence,
}

/// Lists of the springs at each point, concatenated.
pub(super) struct Incidence {
    starts: Vec<u32>,
    springs: Vec<u32>,
}

impl Incidence {
    /// Lists springs by one of their ends; within a list, those for which `last` returns true come last.
    pub(super) fn new(points: usize, ends: &[[u32; 2]], end: usize, last: impl Fn(u32) -> bool) -> Self {
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

impl<T: Real> Adjacency<'_, '_, T> {
    /// Returns whether a spring has an offset.
    pub(super) fn wraps(&self, spring: u32) -> bool {
        offset(self.net, spring)
    }
}
