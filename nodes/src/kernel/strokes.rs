//! Strokes with a cross-section: wrinkle segments as grooves, bands as a scalar field.
//!
//! Source: JP4905282B2 §7, claims 17 to 19 (A49 to A56): each segment gets a width W and a cross-section. A
//! [`StrokeSet`] is built once, in mm, and fills any window at any resolution; a pixel's value depends on its place
//! alone, so windows fit together bit by bit. Strokes are combined in their order, so sums do not depend on the cut
//! either. What is drawn is depth, 0 where there is no stroke; heights are its negative.

use super::stroke_fill::{Canvas, Job};
use glam::{DVec2, IVec2, Vec2};
use rayon::prelude::*;

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
    strokes: Vec<Stroke>,
    style: StrokeStyle,
    /// Size of the canvas if it is periodic.
    period: Option<Vec2>,
    /// What the strokes cover, and its division into bins.
    low: Vec2,
    high: Vec2,
    bins: IVec2,
    start: Vec<u32>,
    members: Vec<u32>,
    deepest: f32,
}

/// Marks pixels without a stroke in the ids of [`StrokeSet::fill_with_ids`].
pub const NO_STROKE: u32 = u32::MAX;

impl StrokeSet {
    /// Sorts strokes into bins; those that are not finite are left out. With `period`, the size of the canvas in mm,
    /// they are repeated over the plane. O(n).
    pub fn new(strokes: &[Stroke], style: StrokeStyle, period: Option<Vec2>) -> Self {
        let mut strokes = strokes.to_vec();
        for s in &mut strokes {
            if !(s.ends[0].is_finite() && s.ends[1].is_finite() && s.half_width.is_finite() && s.depth.is_finite()) {
                // Keeps its number, draws nothing.
                *s = Stroke { ends: [Vec2::ZERO; 2], half_width: 0.0, depth: 0.0 };
            } else if let Some(size) = period {
                let home = ((s.ends[0] + s.ends[1]) * 0.5 / size).floor() * size;
                s.ends = s.ends.map(|e| e - home);
            }
        }
        let boxes: Vec<[Vec2; 2]> = strokes.par_iter().map(|s| bounds(s, &style)).collect();
        let low = boxes.iter().map(|b| b[0]).reduce(Vec2::min).unwrap_or_default();
        let high = boxes.iter().map(|b| b[1]).reduce(Vec2::max).unwrap_or_default();
        let mean = boxes.iter().map(|b| (b[1] - b[0]).as_dvec2()).sum::<DVec2>() / boxes.len().max(1) as f64;
        // Bins about twice as large as a stroke, and no more of them than strokes.
        let side = (2.0 * mean.max_element())
            .max(((high - low).as_dvec2().element_product() / boxes.len().max(1) as f64).sqrt());
        let bins = ((high - low) / narrow(side.max(1e-12))).ceil().clamp(Vec2::ONE, Vec2::splat(8192.0)).as_ivec2();
        let mut set =
            Self { style, period, low, high, bins, start: Vec::new(), members: Vec::new(), deepest: 0.0, strokes };
        set.deepest = set.strokes.iter().map(|s| s.depth).fold(0.0, f32::max);
        set.start = vec![0; bins.as_usizevec2().element_product() + 1];
        for b in &boxes {
            set.for_bins(*b).for_each(|bin| set.start[bin + 1] += 1);
        }
        for bin in 1..set.start.len() {
            set.start[bin] += set.start[bin - 1];
        }
        let mut next = set.start.clone();
        set.members = vec![0; set.start.last().copied().unwrap_or(0) as usize];
        for (id, b) in (0u32..).zip(&boxes) {
            for bin in set.for_bins(*b) {
                set.members[next[bin] as usize] = id;
                next[bin] += 1;
            }
        }
        set
    }

    /// The strokes, moved so that their middles lie on the canvas if it is periodic.
    pub fn strokes(&self) -> &[Stroke] {
        &self.strokes
    }

    /// The indices of the bins that a box touches.
    fn for_bins(&self, [low, high]: [Vec2; 2]) -> impl Iterator<Item = usize> + use<> {
        let bins = self.bins;
        let scale = bins.as_vec2() / (self.high - self.low).max(Vec2::splat(1e-12));
        let cell = |p: Vec2| ((p - self.low) * scale).floor().as_ivec2().clamp(IVec2::ZERO, bins - 1);
        let (from, to) = (cell(low).as_usizevec2(), cell(high).as_usizevec2());
        let columns = bins.as_usizevec2().x;
        (from.y..=to.y).flat_map(move |y| (from.x..=to.x).map(move |x| y * columns + x))
    }

    /// The strokes that may touch a window, in order, each with the copy of the canvas it lies in.
    fn near(&self, window: &Window) -> Vec<(u32, IVec2)> {
        // Thin strokes grow to the least width, and edges are half a pixel soft.
        let margin = window.step * (1.0 + 0.5 * self.style.min_width) + 1e-5 * (self.high - self.low).max_element();
        let corner = |x: i64, y: i64| narrow2(DVec2::new(x as f64, y as f64) * window.step.as_dvec2() + window.origin);
        let (x, y) = (i64::from(window.x), i64::from(window.y));
        let low = corner(x, y) - margin;
        let high = corner(x + window.width as i64, y + window.height as i64) + margin;
        let (first, last) = match self.period {
            Some(size) => (((low - self.high) / size).ceil().as_ivec2(), ((high - self.low) / size).floor().as_ivec2()),
            None => (IVec2::ZERO, IVec2::ZERO),
        };
        let mut found = Vec::new();
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let copy = IVec2::new(x, y);
                let shift = copy.as_vec2() * self.period.unwrap_or_default();
                for bin in self.for_bins([low - shift, high - shift]) {
                    let members = &self.members[self.start[bin] as usize..self.start[bin + 1] as usize];
                    found.extend(members.iter().map(|&id| (id, (copy.y, copy.x))));
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found.into_iter().map(|(id, (y, x))| (id, IVec2::new(x, y))).collect()
    }

    /// Fills a window by rows, whatever was in `out` before. O(strokes near + pixels + pixels of strokes).
    pub fn fill(&self, window: &Window, draw: Draw, out: &mut [f32]) {
        self.paint::<false>(window, draw, out, &mut []);
    }

    /// As [`Self::fill`], always by the deepest; `ids` receives the stroke that is deepest in each pixel, the first of
    /// equals, or [`NO_STROKE`].
    pub fn fill_with_ids(&self, window: &Window, draw: Draw, out: &mut [f32], ids: &mut [u32]) {
        self.paint::<true>(window, draw, out, ids);
    }

    fn paint<const IDS: bool>(&self, window: &Window, draw: Draw, out: &mut [f32], ids: &mut [u32]) {
        let mut canvas = Canvas::<IDS>::new(window);
        let near = self.near(window);
        let combine = if IDS { Combine::Max } else { self.style.combine };
        let most = if draw == Draw::Mask { 1.0 } else { self.deepest.max(f32::MIN_POSITIVE) };
        let period = self.period.unwrap_or_default();
        let style = StrokeStyle { combine, ..self.style };
        canvas.draw(Job { strokes: &self.strokes, near: &near, style, period, draw, most });
        canvas.copy_to(out, ids);
    }
}

/// The box around a stroke.
fn bounds(s: &Stroke, style: &StrokeStyle) -> [Vec2; 2] {
    let reach = s.half_width * cut(style.profile);
    let [a, b] = s.ends;
    let normal = (b - a).perp().normalize_or(Vec2::Y).abs();
    let grow = if style.round_caps { Vec2::splat(reach) } else { normal * reach };
    [a.min(b) - grow, a.max(b) + grow]
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
