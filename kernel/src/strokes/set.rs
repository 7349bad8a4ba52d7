//! Strokes in bins, and the search for those near a window.

use super::fill::{CombineRule, Target};
use super::job::{Groove, Job, Near};
use super::style::{Combine, Draw, Stroke, StrokeStyle, cut};
use crate::ground::bins::{Bins, Extent};
use crate::ground::number::{index_u32, narrow};
use crate::ground::window::Frame;
use glam::{DVec2, IVec2, Vec2};

/// Strokes in bins.
#[derive(Clone, Debug)]
pub struct StrokeSet {
    /// In the order of the bins.
    grooves: Vec<Groove>,
    bins: Bins,
    style: StrokeStyle,
    /// Size of the canvas if it is periodic.
    period: Option<Vec2>,
    deepest: f32,
}

impl StrokeSet {
    /// Sorts strokes into bins; skips those that are not finite or draw nothing. With `period`, the size of the canvas
    /// in mm, they are repeated over the plane. O(n), on one thread, since tiles that wait for it may be in progress.
    pub fn new(strokes: &[Stroke], style: StrokeStyle, period: Option<Vec2>) -> Self {
        let extent = |id: usize| {
            let s = &strokes[id];
            let e = extent(s, &style, period);
            let wide = s.half_width > 0.0 || (s.half_width == 0.0 && !style.fade && style.min_width > 0.0);
            let draws = s.depth > 0.0 && s.depth.is_finite() && wide;
            (draws && e.middle.is_finite() && e.half.is_finite()).then_some(e)
        };
        let (bins, order) = Bins::new(strokes.len(), extent);
        // Read several at a time, so that many cache misses overlap.
        let mut grooves = Vec::with_capacity(order.len());
        let mut some = [Stroke { ends: [Vec2::ZERO; 2], half_width: 0.0, depth: 0.0 }; 64];
        for ids in order.chunks(some.len()) {
            some.iter_mut().zip(ids).for_each(|(stroke, &id)| *stroke = strokes[id as usize]);
            grooves.extend(some.iter().zip(ids).map(|(stroke, &id)| Groove::new(id, stroke, period)));
        }
        let deepest = grooves.iter().map(|g| g.depth).fold(0.0, f32::max);
        Self { grooves, bins, style, period, deepest }
    }

    #[cfg(test)]
    pub(super) fn grooves(&self) -> &[Groove] {
        &self.grooves
    }

    /// The strokes that may touch a window, and their copies of the canvas; in order if `sorted`.
    pub(super) fn near(&self, frame: &Frame, sorted: bool) -> (Vec<Near>, Vec<IVec2>) {
        // Thin strokes grow to the minimum width, and edges are half a pixel soft.
        let (all_low, all_high) = (self.bins.low, self.bins.high);
        let (step, origin) = (DVec2::from_array(frame.step).as_vec2(), DVec2::from_array(frame.origin));
        let margin = step * (1.0 + 0.5 * self.style.min_width) + 1e-5 * (all_high - all_low).max_element();
        let corner = |x: i64, y: i64| (DVec2::new(x as f64, y as f64) * step.as_dvec2() + origin).as_vec2();
        let window = frame.window;
        let (x, y) = (i64::from(window.x), i64::from(window.y));
        let low = corner(x, y) - margin;
        let high = corner(x + i64::from(window.width), y + i64::from(window.height)) + margin;
        let (first, last) = match self.period {
            Some(size) => (((low - all_high) / size).ceil().as_ivec2(), ((high - all_low) / size).floor().as_ivec2()),
            None => (IVec2::ZERO, IVec2::ZERO),
        };
        let (mut found, mut copies) = (Vec::new(), Vec::new());
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let shift = IVec2::new(x, y).as_vec2() * self.period.unwrap_or_default();
                let copy = index_u32(copies.len());
                copies.push(IVec2::new(x, y));
                self.bins.find(low - shift, high - shift, |range| {
                    let near = |(groove, g): (u32, &Groove)| Near { id: g.id, copy, groove };
                    found.extend((index_u32(range.start)..).zip(&self.grooves[range]).map(near));
                });
            }
        }
        if sorted {
            found.sort_unstable();
        }
        (found, copies)
    }

    /// Fills a window by rows; previous values of `out` are ignored. O(strokes near + pixels + pixels of strokes).
    pub fn fill(&self, frame: &Frame, draw: Draw, out: &mut [f32]) {
        self.fill_until(&|| false, frame, draw, out);
    }

    /// Like [`Self::fill`]; incomplete if `stop` returned true.
    pub fn fill_until(&self, stop: &dyn Fn() -> bool, frame: &Frame, draw: Draw, out: &mut [f32]) {
        let rule = match self.style.combine {
            Combine::Max => CombineRule::Max,
            Combine::Add => CombineRule::Add,
            Combine::Screen => {
                let most = if draw == Draw::Mask { 1.0 } else { self.deepest.max(f32::MIN_POSITIVE) };
                CombineRule::Screen(most.recip())
            }
        };
        self.paint(stop, frame, (draw, rule), (out, &mut []));
    }

    /// Like [`Self::fill_until`], with depths and always by the deepest; `ids` receives the deepest stroke of each
    /// pixel, the first of equals, or [`NO_STROKE`](crate::strokes::NO_STROKE).
    pub fn fill_with_ids(&self, stop: &dyn Fn() -> bool, frame: &Frame, out: &mut [f32], ids: &mut [u32]) {
        self.paint(stop, frame, (Draw::Depth, CombineRule::Ids), (out, ids));
    }

    fn paint(
        &self,
        stop: &dyn Fn() -> bool,
        frame: &Frame,
        (draw, rule): (Draw, CombineRule),
        (out, ids): (&mut [f32], &mut [u32]),
    ) {
        let mut target = Target::new(frame, rule);
        // A maximum does not depend on the order.
        let (near, copies) = self.near(frame, rule != CombineRule::Max);
        let period = self.period.unwrap_or_default();
        for near in near.chunks(AT_ONCE) {
            if stop() {
                break;
            }
            target.draw(Job { grooves: &self.grooves, near, copies: &copies, style: self.style, period, draw });
        }
        target.copy_to(out, ids);
    }
}

/// Number of strokes drawn between two checks of `stop`: 30 ms for strokes that cover a tile.
const AT_ONCE: usize = 512;

/// Mean number of strokes that overlap at a point of the canvas, the cost of drawing per pixel.
pub fn layers(strokes: impl Iterator<Item = Stroke>, style: &StrokeStyle, size: Vec2, periodic: bool) -> f64 {
    let canvas = size.as_dvec2().element_product();
    let area = |stroke: Stroke| {
        let width = f64::from(2.0 * stroke.half_width * cut(style.profile));
        let area = width * (width + f64::from((stroke.ends[1] - stroke.ends[0]).length()));
        if periodic { area } else { area.min(canvas) }
    };
    strokes.map(area).sum::<f64>() / canvas
}

impl Groove {
    fn new(id: u32, stroke: &Stroke, period: Option<Vec2>) -> Self {
        let [a, b] = home(stroke, period).map(|e| e.as_dvec2());
        let way = b - a;
        let length = way.length();
        let along = if length > 0.0 { way * length.recip() } else { DVec2::X };
        Self {
            middle: (a + b) * 0.5,
            along: along.as_vec2(),
            half_length: narrow(length * 0.5),
            half_width: stroke.half_width,
            depth: stroke.depth,
            id,
        }
    }
}

/// The ends of a stroke, shifted so that its middle is on the canvas if that is periodic.
fn home(stroke: &Stroke, period: Option<Vec2>) -> [Vec2; 2] {
    let [a, b] = stroke.ends;
    let home = period.map_or(Vec2::ZERO, |size| ((a + b) * 0.5 / size).floor() * size);
    [a - home, b - home]
}

/// A bounding box of a stroke.
fn extent(stroke: &Stroke, style: &StrokeStyle, period: Option<Vec2>) -> Extent {
    let [a, b] = home(stroke, period);
    Extent { middle: (a + b) * 0.5, half: (b - a).abs() * 0.5 + stroke.half_width * cut(style.profile) }
}
