//! Strokes with a cross-section: wrinkle segments as grooves, bands as a scalar field.
//!
//! Source: JP4905282B2 §7, claims 17 to 19 (A49 to A56): each segment gets a width W and a cross-section. A
//! [`StrokeSet`] is built once, in mm, and fills any window at any resolution; a pixel's value depends on its place
//! alone, so windows fit together bit by bit. Strokes are combined in their order, so sums do not depend on the cut
//! either. What is drawn is depth, 0 where there is no stroke; heights are its negative.

use super::bins::{Bins, Extent};
use super::lattice::index as number;
use super::stroke_fill::{Canvas, Job, Rule};
use glam::{DVec2, IVec2, Vec2};

/// A straight stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its two ends in mm.
    pub ends: [Vec2; 2],
    /// Half its width W in mm, ≥ 0.
    pub half_width: f32,
    /// Its depth, ≥ 0.
    pub depth: f32,
}

/// The cross-section, as a function of the distance t from the middle line in half widths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// 1 inside, with a soft edge a pixel wide (A49).
    Flat,
    /// `1 - t` (A52).
    Linear,
    /// `(1 - t²)²`: level in the middle and at the edge (A52).
    Smooth,
    /// Gaussian (A53), across only (L-10).
    Gaussian {
        /// σ over W; the source's is 1/6, 1/4 reads better.
        sigma: f32,
        /// Distance over W beyond which it is 0; the source's is ½, 0.8 goes with σ = W/4.
        cutoff: f32,
    },
    /// Flat, in the shape of an ellipse with the stroke as its long axis (A54).
    Brush,
}

impl Default for Profile {
    fn default() -> Self {
        Self::Gaussian { sigma: 0.25, cutoff: 0.8 }
    }
}

/// How strokes that overlap are combined (L-9).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Combine {
    /// The deepest.
    #[default]
    Max,
    /// The sum.
    Add,
    /// `a + b - a b / D`, D the greatest depth of the set.
    Screen,
}

/// What all strokes of a set have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeStyle {
    /// Cross-section.
    pub profile: Profile,
    /// Half widths are multiplied by `√(1 - taper e²)`, e from -1 to 1 along the stroke; 0..1.
    pub taper: f32,
    /// Depths are multiplied by `1 - tip e⁴`; 0..1.
    pub tip: f32,
    /// Ends are rounded by the cross-section; otherwise they are cut square (the source's).
    pub round_caps: bool,
    /// Thinner strokes are drawn this wide, in output pixels, and fade instead; 0 draws them as they are.
    pub min_width: f32,
    /// Whether strokes below the least width fade; otherwise they keep their depth (A50).
    pub fade: bool,
    /// Edges of `Flat` and `Brush` and square ends are a pixel wide; otherwise a pixel is in or out by its centre.
    pub antialias: bool,
    /// How strokes are combined.
    pub combine: Combine,
}

impl Default for StrokeStyle {
    fn default() -> Self {
        Self {
            profile: Profile::default(),
            taper: 0.0,
            tip: 0.0,
            round_caps: false,
            min_width: 1.0,
            fade: true,
            antialias: true,
            combine: Combine::Max,
        }
    }
}

/// A part of a picture: pixel (i, j) has its centre at `origin + ((i + ½) step.x, (j + ½) step.y)` mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// First column; may be negative.
    pub x: i32,
    /// First row; may be negative.
    pub y: i32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Millimetres per pixel, > 0.
    pub step: Vec2,
    /// The corner of pixel (0, 0) in mm.
    pub origin: DVec2,
}

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Draw {
    /// Profile times depth.
    Depth,
    /// The profile alone, 0..1: a mask.
    Mask,
}

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

/// A stroke, ready to be drawn at any resolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Groove {
    pub(super) middle: DVec2,
    /// Unit vector from the first end to the second.
    pub(super) along: Vec2,
    pub(super) half_length: f32,
    pub(super) half_width: f32,
    pub(super) depth: f32,
    /// The stroke's number.
    pub(super) id: u32,
}

/// A stroke to be drawn: its number, its copy of the canvas, and where its groove is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Near {
    id: u32,
    pub(super) copy: u32,
    pub(super) groove: u32,
}

/// Marks pixels without a stroke in the ids of [`StrokeSet::fill_with_ids`].
pub const NO_STROKE: u32 = u32::MAX;

impl StrokeSet {
    /// Sorts strokes into bins; those that are not finite or draw nothing are left out. With `period`, the size of the
    /// canvas in mm, they are repeated over the plane. O(n), on one thread: tiles that wait for it may be under way.
    pub fn new(strokes: &[Stroke], style: StrokeStyle, period: Option<Vec2>) -> Self {
        let extent = |id: usize| {
            let s = &strokes[id];
            let e = extent(s, &style, period);
            let wide = s.half_width > 0.0 || (s.half_width == 0.0 && !style.fade && style.min_width > 0.0);
            let draws = s.depth > 0.0 && s.depth.is_finite() && wide;
            (draws && e.middle.is_finite() && e.half.is_finite()).then_some(e)
        };
        let (bins, order) = Bins::new(strokes.len(), extent);
        // Fetched some at a time, so that the memory fetches many at once.
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

    /// The strokes that may touch a window, and the copies of the canvas they lie in; in order if `sorted`.
    pub(super) fn near(&self, window: &Window, sorted: bool) -> (Vec<Near>, Vec<IVec2>) {
        // Thin strokes grow to the least width, and edges are half a pixel soft.
        let (all_low, all_high) = (self.bins.low, self.bins.high);
        let margin = window.step * (1.0 + 0.5 * self.style.min_width) + 1e-5 * (all_high - all_low).max_element();
        let corner = |x: i64, y: i64| narrow2(DVec2::new(x as f64, y as f64) * window.step.as_dvec2() + window.origin);
        let (x, y) = (i64::from(window.x), i64::from(window.y));
        let low = corner(x, y) - margin;
        let high = corner(x + window.width as i64, y + window.height as i64) + margin;
        let (first, last) = match self.period {
            Some(size) => (((low - all_high) / size).ceil().as_ivec2(), ((high - all_low) / size).floor().as_ivec2()),
            None => (IVec2::ZERO, IVec2::ZERO),
        };
        let (mut found, mut copies) = (Vec::new(), Vec::new());
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let shift = IVec2::new(x, y).as_vec2() * self.period.unwrap_or_default();
                let copy = number(copies.len());
                copies.push(IVec2::new(x, y));
                self.bins.find(low - shift, high - shift, |range| {
                    let near = |(groove, g): (u32, &Groove)| Near { id: g.id, copy, groove };
                    found.extend((number(range.start)..).zip(&self.grooves[range]).map(near));
                });
            }
        }
        if sorted {
            found.sort_unstable();
        }
        (found, copies)
    }

    /// Fills a window by rows, whatever was in `out` before. O(strokes near + pixels + pixels of strokes).
    pub fn fill(&self, window: &Window, draw: Draw, out: &mut [f32]) {
        self.fill_until(&|| false, window, draw, out);
    }

    /// As [`Self::fill`]; once `stop` is true, with whatever is drawn by then.
    pub fn fill_until(&self, stop: &dyn Fn() -> bool, window: &Window, draw: Draw, out: &mut [f32]) {
        let rule = match self.style.combine {
            Combine::Max => Rule::Max,
            Combine::Add => Rule::Add,
            Combine::Screen => {
                let most = if draw == Draw::Mask { 1.0 } else { self.deepest.max(f32::MIN_POSITIVE) };
                Rule::Screen(most.recip())
            }
        };
        self.paint(stop, window, (draw, rule), (out, &mut []));
    }

    /// As [`Self::fill_until`], of depths and always by the deepest; `ids` receives the stroke that is deepest in each
    /// pixel, the first of equals, or [`NO_STROKE`].
    pub fn fill_with_ids(&self, stop: &dyn Fn() -> bool, window: &Window, out: &mut [f32], ids: &mut [u32]) {
        self.paint(stop, window, (Draw::Depth, Rule::Ids), (out, ids));
    }

    fn paint(
        &self,
        stop: &dyn Fn() -> bool,
        window: &Window,
        (draw, rule): (Draw, Rule),
        (out, ids): (&mut [f32], &mut [u32]),
    ) {
        let mut canvas = Canvas::new(window, rule);
        // The deepest is the deepest in any order.
        let (near, copies) = self.near(window, rule != Rule::Max);
        let period = self.period.unwrap_or_default();
        for near in near.chunks(AT_ONCE) {
            if stop() {
                break;
            }
            canvas.draw(Job { grooves: &self.grooves, near, copies: &copies, style: self.style, period, draw });
        }
        canvas.copy_to(out, ids);
    }
}

/// How many strokes are drawn between two looks at whether to stop: 30 ms of those that cover a tile.
const AT_ONCE: usize = 512;

/// How many strokes lie over each other at a place of the canvas, on average: what drawing them costs per pixel.
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

/// The ends of a stroke, moved so that its middle lies on the canvas if that is periodic.
fn home(stroke: &Stroke, period: Option<Vec2>) -> [Vec2; 2] {
    let [a, b] = stroke.ends;
    let home = period.map_or(Vec2::ZERO, |size| ((a + b) * 0.5 / size).floor() * size);
    [a - home, b - home]
}

/// The box around a stroke, or a larger one.
fn extent(stroke: &Stroke, style: &StrokeStyle, period: Option<Vec2>) -> Extent {
    let [a, b] = home(stroke, period);
    Extent { middle: (a + b) * 0.5, half: (b - a).abs() * 0.5 + stroke.half_width * cut(style.profile) }
}

/// Where a cross-section ends, in half widths.
pub(super) fn cut(profile: Profile) -> f32 {
    if let Profile::Gaussian { cutoff, .. } = profile { 2.0 * cutoff } else { 1.0 }
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
pub(super) fn narrow(value: f64) -> f32 {
    value as f32
}

fn narrow2(value: DVec2) -> Vec2 {
    value.as_vec2()
}
