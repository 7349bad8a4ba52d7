//! A spatial index of boxes of very different sizes: hierarchical grids.
//!
//! There is a grid of bins for each power of two of sizes. A box lies in the one bin of its level that contains its
//! middle. So memory is O(n) for any sizes, no box is found twice, and a search is extended only by the largest box of
//! a level.

use super::number::index_u32;
use glam::{IVec2, Vec2};
use std::ops::Range;

/// A box, by its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Its middle.
    pub(crate) middle: Vec2,
    /// Half its size, ≥ 0.
    pub(crate) half: Vec2,
}

/// Maximum number of levels; boxes that are too small for them share the last one.
const LEVELS: usize = 16;
/// Maximum number of bins along one side.
const SIDE: f32 = 8192.0;

/// The index.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bins {
    levels: Vec<Level>,
    /// Bounds of all boxes; 0 to 0 if there are none.
    pub(crate) low: Vec2,
    pub(crate) high: Vec2,
}

/// The boxes of one size class.
#[derive(Clone, Debug)]
struct Level {
    /// The bounds of their middles.
    low: Vec2,
    high: Vec2,
    /// Half the size of the largest box.
    reach: Vec2,
    count: usize,
    bins: IVec2,
    /// Bins per mm.
    scale: Vec2,
    /// Start of each bin in the order, and the end of the last one.
    start: Vec<u32>,
}

impl Bins {
    /// Sorts `count` boxes into bins; boxes that are `None` are left out. Also returns their indices in the order of
    /// the bins. O(n).
    pub(crate) fn new(count: usize, extent: impl Fn(usize) -> Option<Extent>) -> (Self, Vec<u32>) {
        let power = |e: &Extent| (e.half.max_element().to_bits() >> 23) as usize;
        let mut levels = vec![Level::EMPTY; 256];
        for extent in (0..count).filter_map(&extent) {
            levels[power(&extent)].add(&extent);
        }
        let top = levels.iter().rposition(|level| level.count > 0).unwrap_or(0);
        let bottom = (top + 1).saturating_sub(LEVELS);
        for n in 0..bottom {
            let (low, high) = levels.split_at_mut(bottom);
            high[0].join(&low[n]);
        }
        levels.truncate(top + 1);
        levels.drain(..bottom);
        let mut first = vec![0u32; levels.len()];
        let mut total = 0;
        for (n, level) in levels.iter_mut().enumerate() {
            first[n] = total;
            level.divide(f32::from_bits(index_u32(n + bottom).max(1) << 23));
            total += level.bins.element_product().cast_unsigned();
        }
        let bin = |e: Extent| {
            let n = power(&e).saturating_sub(bottom);
            let at = levels[n].bin(e.middle);
            first[n] + (at.y * levels[n].bins.x + at.x).cast_unsigned()
        };
        // A counting sort.
        let keys: Vec<u32> = (0..count).map(|n| extent(n).map_or(u32::MAX, bin)).collect();
        let mut next = vec![0u32; total as usize + 1];
        for &key in keys.iter().filter(|&&key| key != u32::MAX) {
            next[key as usize + 1] += 1;
        }
        for bin in 1..next.len() {
            next[bin] += next[bin - 1];
        }
        for (level, &first) in levels.iter_mut().zip(&first) {
            let last = first + level.bins.element_product().cast_unsigned();
            level.start = next[first as usize..=last as usize].to_vec();
        }
        let mut order = vec![0u32; next.last().copied().unwrap_or(0) as usize];
        for (number, &key) in (0u32..).zip(&keys).filter(|(_, key)| **key != u32::MAX) {
            let to = &mut next[key as usize];
            order[*to as usize] = number;
            *to += 1;
        }
        levels.retain(|level| level.count > 0);
        let low = levels.iter().map(|l| l.low - l.reach).reduce(Vec2::min).unwrap_or_default();
        let high = levels.iter().map(|l| l.high + l.reach).reduce(Vec2::max).unwrap_or_default();
        (Self { levels, low, high }, order)
    }

    /// Calls `hear` with ranges of the order that contain all boxes that touch the given one, and possibly others.
    pub(crate) fn find(&self, low: Vec2, high: Vec2, mut hear: impl FnMut(Range<usize>)) {
        for level in &self.levels {
            let (low, high) = (low - level.reach, high + level.reach);
            if !(low.cmple(level.high).all() && high.cmpge(level.low).all()) {
                continue;
            }
            let (from, to) = (level.bin(low).as_usizevec2(), level.bin(high).as_usizevec2());
            for y in from.y..=to.y {
                let row = y * level.bins.as_usizevec2().x;
                hear(level.start[row + from.x] as usize..level.start[row + to.x + 1] as usize);
            }
        }
    }
}

impl Level {
    const EMPTY: Self = Self {
        low: Vec2::MAX,
        high: Vec2::MIN,
        reach: Vec2::ZERO,
        count: 0,
        bins: IVec2::ZERO,
        scale: Vec2::ZERO,
        start: Vec::new(),
    };

    fn add(&mut self, extent: &Extent) {
        self.low = self.low.min(extent.middle);
        self.high = self.high.max(extent.middle);
        self.reach = self.reach.max(extent.half);
        self.count += 1;
    }

    fn join(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.reach = self.reach.max(other.reach);
        self.count += other.count;
    }

    /// Chooses bins of about half the size of a box, and at most as many bins as boxes.
    fn divide(&mut self, size: f32) {
        if self.count == 0 {
            return;
        }
        let area = self.high - self.low;
        let side = size.max((area.x * (area.y / self.count as f32)).sqrt());
        let bins = (area / side).ceil().clamp(Vec2::ONE, Vec2::splat(SIDE));
        self.bins = bins.as_ivec2();
        self.scale = bins / area.max(Vec2::splat(f32::MIN_POSITIVE));
    }

    /// The bin of a position, or the nearest bin.
    #[inline(always)]
    fn bin(&self, place: Vec2) -> IVec2 {
        ((place - self.low) * self.scale).as_ivec2().clamp(IVec2::ZERO, self.bins - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn finds_each_box_once(seed: u64, count in 0usize..200, x in -30f32..30.0, y in -30f32..30.0) {
            let hash = Hash::new(seed);
            let extent = |n: usize| {
                let r = |i: u64| hash.unit_f32(8 * n as u64 + i);
                let half = Vec2::new(r(2), r(3)) * (r(4) * 40.0 - 36.0).exp2();
                let middle = (Vec2::new(r(0), r(1)) - 0.5) * 40.0;
                (r(5) > 0.1).then_some(Extent { middle, half })
            };
            let extents: Vec<_> = (0..count).map(extent).collect();
            let (bins, order) = Bins::new(count, |n| extents[n]);
            let (low, high) = (Vec2::new(x, y), Vec2::new(x + 7.0, y + 5.0));
            let mut found = vec![0; count];
            bins.find(low, high, |range| order[range].iter().for_each(|&n| found[n as usize] += 1));
            for (extent, &found) in extents.iter().zip(&found) {
                let touches = |e: &Extent| (e.middle - e.half).cmple(high).all() && (e.middle + e.half).cmpge(low).all();
                prop_assert!(found <= 1 && (found == 1 || !extent.as_ref().is_some_and(touches)));
            }
            for e in extents.iter().flatten() {
                prop_assert!((e.middle - e.half).cmpge(bins.low).all() && (e.middle + e.half).cmple(bins.high).all());
            }
            prop_assert_eq!(order.len(), extents.iter().flatten().count());
        }
    }
}
