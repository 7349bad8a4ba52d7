//! Stamps in bins, and the search for those that touch a window.
use crate::ground::number::index_u32;
use crate::ground::window::Frame;
use glam::{DVec2, Vec2};
use shibo_value::Tiling;

/// One stamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamp {
    /// Its middle, mm.
    pub center: DVec2,
    /// Half its width and height before rotation, mm, > 0.
    pub half: Vec2,
    /// Cosine and sine of its angle, from +x towards +y.
    pub turn: Vec2,
    /// Factor on its values.
    pub value: f32,
    /// Its number, from 1.
    pub id: u32,
    /// Index of its picture.
    pub picture: u32,
}

/// A stamp near a window: its index in the order of drawing, and its copy of the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Near {
    pub(super) stamp: u32,
    pub(super) copy: [i32; 2],
}

/// Stamps in the order of drawing.
#[derive(Clone, Debug)]
pub struct StampSet {
    stamps: Vec<Stamp>,
    /// Distance of two copies; 0 without copies.
    period: DVec2,
    low: DVec2,
    high: DVec2,
    /// Size of a bin, mm.
    side: DVec2,
    counts: [usize; 2],
    /// Offset of each bin's stamps in `order`.
    starts: Vec<u32>,
    order: Vec<u32>,
    /// Maximum reach of a stamp, mm.
    reach: f64,
}

/// Mean number of stamps per bin.
const IN_BIN: f64 = 6.0;

impl StampSet {
    /// Sorts stamps into bins; those that are not finite are skipped. Along the axes of `tiling` they repeat with a
    /// canvas of `size` mm. O(n).
    pub fn new(stamps: Vec<Stamp>, (size, tiling): (DVec2, Tiling)) -> Self {
        let period = DVec2::new(if tiling.x { size.x } else { 0.0 }, if tiling.y { size.y } else { 0.0 });
        let home = |p: DVec2| {
            let turns = DVec2::select(period.cmpgt(DVec2::ZERO), (p / size).floor(), DVec2::ZERO);
            p - turns * period
        };
        let sound = |s: &Stamp| {
            s.center.is_finite()
                && s.half.is_finite()
                && s.half.min_element() > 0.0
                && s.turn.is_finite()
                && s.value.is_finite()
        };
        let stamps: Vec<Stamp> =
            stamps.into_iter().filter(sound).map(|s| Stamp { center: home(s.center), ..s }).collect();
        let reach = stamps.iter().map(|s| f64::from(s.half.length())).fold(0.0, f64::max);
        let low = stamps.iter().map(|s| s.center).fold(DVec2::INFINITY, DVec2::min);
        let high = stamps.iter().map(|s| s.center).fold(DVec2::NEG_INFINITY, DVec2::max);
        let (low, high) = if stamps.is_empty() { (DVec2::ZERO, DVec2::ZERO) } else { (low, high) };
        let extent = (high - low).max(DVec2::splat(1e-9));
        let bins = (stamps.len() as f64 / IN_BIN).clamp(1.0, 1e6);
        let shape = (extent.x / extent.y).sqrt();
        let count = |n: f64| DVec2::splat(n.ceil().clamp(1.0, 1e6)).as_usizevec2().x;
        let counts = [count(bins.sqrt() * shape), count(bins.sqrt() / shape)];
        let mut set = Self {
            side: extent / DVec2::new(counts[0] as f64, counts[1] as f64),
            stamps,
            period,
            low,
            high,
            counts,
            starts: Vec::new(),
            order: Vec::new(),
            reach,
        };
        set.sort();
        set
    }

    fn sort(&mut self) {
        let mut starts = vec![0u32; self.counts[0] * self.counts[1] + 1];
        let bins: Vec<u32> = self.stamps.iter().map(|s| index_u32(self.bin(s.center))).collect();
        for bin in &bins {
            starts[*bin as usize + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0; self.stamps.len()];
        for (stamp, bin) in (0u32..).zip(bins) {
            let place = &mut next[bin as usize];
            order[*place as usize] = stamp;
            *place += 1;
        }
        (self.starts, self.order) = (starts, order);
    }

    fn cell(&self, p: DVec2) -> [usize; 2] {
        let cell = ((p - self.low) / self.side).max(DVec2::ZERO).as_usizevec2();
        [cell.x.min(self.counts[0] - 1), cell.y.min(self.counts[1] - 1)]
    }

    fn bin(&self, p: DVec2) -> usize {
        let [i, j] = self.cell(p);
        j * self.counts[0] + i
    }

    /// The stamps.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// Distance of two copies; 0 without copies.
    pub(super) fn period(&self) -> DVec2 {
        self.period
    }

    /// The stamps that may touch a window, in the order of drawing.
    pub(super) fn near(&self, frame: &Frame) -> Vec<Near> {
        let mut found = Vec::new();
        if self.stamps.is_empty() {
            return found;
        }
        let (rect, margin) = (frame.window, DVec2::splat(self.reach) + DVec2::from(frame.step));
        let first = DVec2::from(frame.center(rect.x, rect.y)) - margin;
        let last =
            DVec2::from(frame.center(rect.x + rect.width.cast_signed() - 1, rect.y + rect.height.cast_signed() - 1))
                + margin;
        let copies = |k: usize| {
            let period = self.period[k];
            if period > 0.0 {
                let from = ((first[k] - self.high[k]) / period).ceil();
                let to = ((last[k] - self.low[k]) / period).floor();
                [from, to].map(|n| DVec2::splat(n).as_ivec2().x)
            } else {
                [0, 0]
            }
        };
        let ([x0, x1], [y0, y1]) = (copies(0), copies(1));
        for y in y0..=y1 {
            for x in x0..=x1 {
                let shift = DVec2::new(f64::from(x), f64::from(y)) * self.period;
                let (low, high) = (first - shift, last - shift);
                if low.cmpgt(self.high).any() || high.cmplt(self.low).any() {
                    continue;
                }
                let ([i0, j0], [i1, j1]) = (self.cell(low), self.cell(high));
                for j in j0..=j1 {
                    let row = j * self.counts[0];
                    let (from, to) = (self.starts[row + i0] as usize, self.starts[row + i1 + 1] as usize);
                    let inside = |stamp: &&u32| {
                        let s = &self.stamps[**stamp as usize];
                        let reach = f64::from(s.half.length());
                        let slack = self.reach - reach;
                        (s.center - low).min_element() >= slack && (high - s.center).min_element() >= slack
                    };
                    let near = |stamp: &u32| Near { stamp: *stamp, copy: [x, y] };
                    found.extend(self.order[from..to].iter().filter(inside).map(near));
                }
            }
        }
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::ground::window::WindowExt as _;
    use shibo_value::Window;

    #[test]
    fn finds_all_stamps_that_touch_window() {
        let (hash, size) = (Hash::new(5), DVec2::new(30.0, 20.0));
        let stamp = |n: u32| {
            let draw = |k: u64| hash.with(n.into()).unit(k);
            let half = Vec2::new(0.1 + hash.with(n.into()).unit_f32(2), 0.2);
            Stamp {
                center: DVec2::new(draw(0), draw(1)) * size,
                half,
                turn: Vec2::X,
                value: 1.0,
                id: n + 1,
                picture: 0,
            }
        };
        for tiling in [Tiling::BOTH, Tiling { x: true, y: false }, Tiling::NONE] {
            let set = StampSet::new((0..500).map(stamp).collect(), (size, tiling));
            for (x, y) in [(0, 0), (-7, 95), (250, 190)] {
                let frame = Frame::new(Window::of(x, y, 40, 30), [0.1, 0.1]);
                let found = set.near(&frame);
                assert!(found.is_sorted());
                let (low, high) = (DVec2::from(frame.center(x, y)), DVec2::from(frame.center(x + 39, y + 29)));
                for (n, s) in (0u32..).zip(set.stamps()) {
                    for i in -2..=2 {
                        for j in -2..=2 {
                            let copy = [i, j];
                            let p = s.center + DVec2::new(i.into(), j.into()) * set.period();
                            let alone = (i != 0 && !tiling.x) || (j != 0 && !tiling.y);
                            let touches = (p.clamp(low, high) - p).abs().max_element() <= f64::from(s.half.length());
                            let has = found.contains(&Near { stamp: n, copy });
                            assert!(has || alone || !touches, "{n} {copy:?}");
                        }
                    }
                }
                assert!(found.len() < 200, "few others: {}", found.len());
            }
        }
    }
}
