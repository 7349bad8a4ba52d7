//! A spatial index of boxes that repeat with the canvas.
use crate::ground::bins::{Bins, Extent};
use crate::ground::number::index_u32;
use crate::ground::window::{Frame, WindowExt as _, index};
use glam::DVec2;
use shibo_value::Tiling;

/// Boxes on a canvas.
#[derive(Clone, Debug)]
pub(crate) struct Index {
    bins: Bins,
    /// Indices of the boxes in the order of the bins.
    order: Vec<u32>,
    /// Shift that moves the middle of each box onto the canvas.
    home: Vec<DVec2>,
    /// Period; 0 in directions without repeats.
    period: DVec2,
}

/// One copy of a box: its index, and its shift in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    pub(crate) id: u32,
    pub(crate) shift: DVec2,
}

impl Index {
    /// Sorts boxes, each given by two corners, into bins. O(n).
    pub(crate) fn new(boxes: &[[DVec2; 2]], (size, tiling): (DVec2, Tiling)) -> Self {
        let period = DVec2::new(if tiling.x { size.x } else { 0.0 }, if tiling.y { size.y } else { 0.0 });
        let safe = DVec2::select(period.cmpgt(DVec2::ZERO), period, DVec2::splat(1.0));
        let home: Vec<DVec2> = boxes.iter().map(|[a, b]| -((0.5 * (*a + *b)) / safe).floor() * period).collect();
        let extent = |n: usize| {
            let [a, b] = boxes[n];
            let middle = 0.5 * (a + b) + home[n];
            // Rounding to single precision must not make it smaller.
            let half = 0.5 * (b - a).abs() + 1e-6 * (1.0 + middle.abs());
            (middle.is_finite() && half.is_finite())
                .then(|| Extent { middle: middle.as_vec2(), half: half.as_vec2() * (1.0 + 1e-6) })
        };
        let (bins, order) = Bins::new(boxes.len(), extent);
        Self { bins, order, home, period }
    }

    /// Period; 0 in directions without repeats.
    pub(super) fn period(&self) -> DVec2 {
        self.period
    }

    /// The copies of boxes that may touch the rectangle from `low` to `high`, sorted by index and then by shift.
    pub(super) fn near(&self, low: DVec2, high: DVec2) -> Vec<Near> {
        let mut found = Vec::new();
        self.visit(low, high, |near| found.push(near));
        let key = |near: &Near| (near.id, near.shift.y, near.shift.x);
        found.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
        });
        found
    }

    /// Visits the copies of boxes that may touch the rectangle from `low` to `high`, in the order of the bins.
    pub(super) fn visit(&self, low: DVec2, high: DVec2, mut put: impl FnMut(Near)) {
        let margin = DVec2::splat(1e-5) * (1.0 + low.abs().max(high.abs()));
        let (low, high) = (low - margin, high + margin);
        let (all_low, all_high) = (self.bins.low.as_dvec2(), self.bins.high.as_dvec2());
        let range = |axis: usize| {
            let period = self.period[axis];
            if period <= 0.0 {
                return (0.0, 0.0);
            }
            (((low[axis] - all_high[axis]) / period).ceil(), ((high[axis] - all_low[axis]) / period).floor())
        };
        let (x, y) = (range(0), range(1));
        let mut step = DVec2::new(x.0, y.0);
        while step.y <= y.1 {
            step.x = x.0;
            while step.x <= x.1 {
                let shift = step * self.period;
                let (low, high) = ((low - shift).as_vec2(), (high - shift).as_vec2());
                self.bins.find(low, high, |range| {
                    let near = |id: &u32| Near { id: *id, shift: shift + self.home[*id as usize] };
                    self.order[range].iter().map(near).for_each(&mut put);
                });
                step.x += 1.0;
            }
            step.y += 1.0;
        }
    }

    /// Like [`Self::near`], for the pixels of a window and a margin of `around` mm.
    pub(crate) fn near_window(&self, frame: &Frame, around: f64) -> Vec<Near> {
        let [low, high] = corners(frame);
        self.near(low - around, high + around)
    }
}

/// The centres of a window's first and last pixel.
pub(super) fn corners(frame: &Frame) -> [DVec2; 2] {
    let rect = frame.window;
    let last = |first: i32, count: usize| first + index_u32(count.max(1) - 1).cast_signed();
    [
        DVec2::from(frame.center(rect.x, rect.y)),
        DVec2::from(frame.center(last(rect.x, rect.columns()), last(rect.y, rect.rows()))),
    ]
}

/// Calls `put` for the pixels of a window whose centres lie in a rectangle, with their indices and positions.
#[inline(always)]
pub(crate) fn each(frame: &Frame, low: DVec2, high: DVec2, put: &mut impl FnMut(usize, DVec2)) {
    let rect = frame.window;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the window")]
    let range = |axis: usize, first: i32, count: usize| {
        let pixel = |mm: f64| (mm - frame.origin[axis]) / frame.step[axis] - 0.5 - f64::from(first);
        let from = pixel(low[axis]).ceil().clamp(0.0, count as f64) as usize;
        let to = (pixel(high[axis]).floor() + 1.0).clamp(0.0, count as f64) as usize;
        from..to
    };
    for j in range(1, rect.y, rect.rows()) {
        for i in range(0, rect.x, rect.columns()) {
            put(j * rect.columns() + i, DVec2::from(frame.center(rect.x + index(i), rect.y + index(j))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;

    #[test]
    fn all_copies_that_touch_are_found_once() {
        let hash = Hash::new(5);
        let unit = |n: u64| hash.unit(n);
        let boxes: Vec<[DVec2; 2]> = (0..200)
            .map(|n| {
                let a = DVec2::new(unit(4 * n) * 60.0 - 20.0, unit(4 * n + 1) * 40.0 - 10.0);
                [a, a + DVec2::new(unit(4 * n + 2) - 0.5, unit(4 * n + 3) - 0.5) * 12.0]
            })
            .collect();
        let size = DVec2::new(20.0, 15.0);
        for tiling in [Tiling::NONE, Tiling::BOTH, Tiling { x: false, y: true }] {
            let index = Index::new(&boxes, (size, tiling));
            let (low, high) = (DVec2::new(-7.0, 11.0), DVec2::new(4.0, 19.0));
            let found = index.near(low, high);
            let mut want = Vec::new();
            for (id, [a, b]) in boxes.iter().enumerate() {
                for (i, j) in (-9..=9).flat_map(|i| (-9..=9).map(move |j| (i, j))) {
                    let shift = DVec2::new(f64::from(i), f64::from(j)) * size;
                    let allowed = (i == 0 || tiling.x) && (j == 0 || tiling.y);
                    let (first, last) = (a.min(*b) + shift, a.max(*b) + shift);
                    if allowed && first.cmple(high).all() && last.cmpge(low).all() {
                        want.push((index_u32(id), shift));
                    }
                }
            }
            assert!(want.len() > 10, "{}", want.len());
            for (id, shift) in want {
                let count = found.iter().filter(|n| n.id == id && n.shift.distance(shift) < 1e-9).count();
                assert_eq!(count, 1, "{id} {shift}");
            }
        }
    }
}
