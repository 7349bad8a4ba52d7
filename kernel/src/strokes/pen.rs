//! Strokes in the pixel coordinates of a window: the touched pixels, and their values.
//!
//! A pixel's value is a function of its position relative to the stroke's middle and does not depend on other pixels.
//! Written with explicit vectors: automatic vectorisation of such loops depends on the code that they are inlined into.

use super::job::Groove;
use super::job::Job;
use super::style::{Draw, Profile, StrokeStyle, cut};
use crate::ground::math;
use crate::ground::number::narrow;
use crate::ground::window::Frame;
use glam::{DVec2, IVec2, Vec2};
use pulp::Simd;
use shibo_value::Window;

/// Largest number of pixels per block on any machine; rows have this much padding, so that a block may begin in any
/// column.
pub(super) const LANES: usize = 16;
/// Indices of the lanes.
const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];
/// Margin beyond the edge of a stroke in which pixels are computed, in pixels and as a share of its size: larger than
/// the rounding errors of positions, so that all skipped pixels are 0.
const MARGIN: [f32; 2] = [0.02, 1e-6];
/// Slopes of more columns per row than this count as horizontal.
const STEEP: f32 = 1e9;
/// 1.5·2^23: adding it to a number below 2^22 leaves the nearest integer in the low bits.
const SNAP: f32 = 12_582_912.0;

/// A stroke in the pixel coordinates of a window.
pub(super) struct Pen {
    pub(super) id: u32,
    /// Column of the middle, from the window's corner.
    column: i32,
    pub(super) row: i32,
    /// Touched rows, relative to the row of the middle.
    pub(super) rows: [i32; 2],
    /// The columns of a row between the ends of the stroke, and those between its sides: change of the first one per
    /// row, the first one in the row of the middle, and their number.
    edges: [[f32; 3]; 2],
    /// Maximum number of touched columns in a row.
    pub(super) wide: i32,
    /// Offset from the middle along and across the stroke: change by column, change by row, and value at the centre of
    /// the middle's pixel; along in mm, across in the units of the cross-section.
    along: [f32; 3],
    across: [f32; 3],
    half_length: f32,
    inverse_length: f32,
    /// Units of the cross-section per mm.
    unit: f32,
    depth: f32,
    taper: f32,
    tip: f32,
    /// Depth at a square end: change per mm inside (`gain`), and the value at the end.
    gain: f32,
    offset: f32,
    /// Coverage per half width inside the edge.
    sharp: f32,
}

/// Data shared by all pens of a window.
pub(super) struct Pens {
    window: Window,
    /// Size of a pixel in mm.
    step: Vec2,
    style: StrokeStyle,
    draw: Draw,
    /// Units of the cross-section per half width.
    unit: f32,
    /// Shift of each copy of the canvas: in mm, or in whole pixels.
    copies: Vec<(DVec2, DVec2)>,
    per: DVec2,
}

impl Pens {
    pub(super) fn new(frame: &Frame, job: &Job<'_>, unit: f32) -> Self {
        let (step, origin) = (DVec2::from_array(frame.step).as_vec2(), DVec2::from_array(frame.origin));
        let pitch = step.as_dvec2();
        let copy = |&copy: &IVec2| {
            let shift = job.period.as_dvec2() * copy.as_dvec2() - origin;
            // Shift a copy by a whole number of pixels if possible: then copies have the same bits.
            let pixels = shift / pitch;
            let whole = (pixels - pixels.round()).abs().max_element() < 1e-3;
            if whole { (DVec2::ZERO, pixels.round()) } else { (shift, DVec2::ZERO) }
        };
        let copies = job.copies.iter().map(copy).collect();
        let (window, style, draw) = (frame.window, job.style, job.draw);
        Self { window, step, style, draw, unit, copies, per: pitch.recip() }
    }

    /// Width of a pixel along and across the stroke.
    #[inline(always)]
    fn pixel(&self, along: Vec2) -> [f32; 2] {
        let step = self.step;
        if step.x == step.y { [step.x; 2] } else { [(along * step).length(), (along.perp() * step).length()] }
    }

    /// `None` if the stroke touches no pixel. Inlined into code with vector instructions, without which rounding is a
    /// function call.
    #[inline(always)]
    pub(super) fn pen(&self, groove: &Groove, copy: u32) -> Option<Pen> {
        let (style, step) = (&self.style, self.step);
        let (shift, pixels) = self.copies[copy as usize];
        let middle = groove.middle + shift;
        let corner = (middle * self.per).floor();
        let [tx, ty] = groove.along.to_array();
        let pixel = self.pixel(groove.along);
        let least = 0.5 * style.min_width * pixel[1];
        let fade = if style.fade && groove.half_width < least { groove.half_width / least } else { 1.0 };
        let half_width = groove.half_width.max(least);
        let depth = fade * if self.draw == Draw::Mask { 1.0 } else { groove.depth };
        let half_length = groove.half_length;
        let reach = cut(style.profile) * half_width;
        let end = if style.round_caps { reach } else { 0.0 };
        // Half a pixel more if edges are soft.
        let soft = if style.antialias { 0.5 } else { 0.0 };
        let edge = if matches!(style.profile, Profile::Flat | Profile::Brush) { soft } else { 0.0 };
        let margin = MARGIN[0] * pixel[0].max(pixel[1]) + MARGIN[1] * (half_length + reach);
        let reach = [half_length + end + soft * pixel[0].max(pixel[1]) + margin, reach + edge * pixel[1] + margin];
        let at = corner + pixels - DVec2::new(f64::from(self.window.x), f64::from(self.window.y));
        let size = Vec2::new(tx.abs() * reach[0] + ty.abs() * reach[1], tx.abs() * reach[1] + ty.abs() * reach[0]);
        let span = size / step + 1.0;
        let (low, high) = (at - span.as_dvec2(), at + span.as_dvec2());
        let size_px = DVec2::new(f64::from(self.window.width), f64::from(self.window.height));
        let inside = low.cmplt(size_px).all() && high.cmpge(DVec2::ZERO).all();
        if !inside || depth <= 0.0 || (half_length <= 0.0 && !style.round_caps) {
            return None;
        }
        // From the middle to the centre of its pixel.
        let rest = (corner * step.as_dvec2() - middle).as_vec2() + 0.5 * step;
        let unit = self.unit / half_width;
        let across = [-ty * unit, tx * unit];
        let (gain, offset) = if style.antialias { (pixel[0].recip(), 0.5) } else { (1e30, 1.0) };
        let brush = style.profile == Profile::Brush;
        let (edges, wide) = edges([tx, ty], reach, (narrow(at.x), rest), step);
        Some(Pen {
            id: groove.id,
            column: whole(at.x),
            row: whole(at.y),
            rows: [
                whole(f64::from((-size.y - rest.y) / step.y).ceil()),
                whole(f64::from((size.y - rest.y) / step.y).floor()),
            ],
            edges,
            wide,
            along: [tx * step.x, ty * step.y, tx * rest.x + ty * rest.y],
            across: [across[0] * step.x, across[1] * step.y, across[0] * rest.x + across[1] * rest.y],
            half_length,
            inverse_length: if half_length > 0.0 { half_length.recip() } else { 0.0 },
            unit,
            depth,
            taper: if brush { 1.0 } else { style.taper.clamp(0.0, 1.0) },
            tip: style.tip.clamp(0.0, 1.0),
            gain: gain * depth,
            offset: offset * depth,
            sharp: if style.antialias { half_width / pixel[1] } else { 1e30 },
        })
    }
}

/// The extent of rows within a stroke, see [`Pen::edges`], and their maximum number of columns. `rest` is the vector
/// from the middle to the centre of its pixel, which is in `column`.
#[inline(always)]
fn edges([tx, ty]: [f32; 2], reach: [f32; 2], (column, rest): (f32, Vec2), step: Vec2) -> ([[f32; 3]; 2], i32) {
    let per = step.x.recip();
    let edge = |t: f32, s: f32, reach: f32| {
        // A row at distance y is within reach for s y / t - reach / |t| ≤ x ≤ s y / t + reach / |t|.
        let (slope, half) = (s / t, reach / t.abs());
        let by_row = slope * step.y * per;
        let first = (slope * rest.y - half - rest.x) * per + column;
        if by_row.abs() < STEEP { [by_row, first, 2.0 * half * per] } else { [0.0, -STEEP, 2.0 * STEEP] }
    };
    let (ends, sides) = (edge(tx, -ty, reach[0]), edge(ty, tx, reach[1]));
    ([ends, sides], whole(f64::from(ends[2].min(sides[2]))).saturating_add(1))
}

/// A cross-section.
pub(super) trait Shape {
    /// Its value, from the square `s` of the distance in its units and the square of the factor by which the stroke is
    /// narrowed.
    fn value<S: Simd>(&self, simd: S, s: S::f32s, narrow: Option<S::f32s>) -> S::f32s;
}

/// Flat with a soft edge: coverage is `gain (1 - t) + offset`, t in half widths.
pub(super) struct Edge {
    gain: f32,
    offset: f32,
}
/// `1 - t`, t in half widths.
pub(super) struct Linear;
/// `(1 - t²)²`, t in half widths.
pub(super) struct Smooth;
/// `exp(-16 t²)` for `t² ≤ end ≤ 1`.
pub(super) struct Gaussian {
    pub(super) end: f32,
}

impl Edge {
    pub(super) fn new(pen: &Pen, style: &StrokeStyle) -> Self {
        Self { gain: pen.sharp, offset: if style.antialias { 0.5 } else { 1.0 } }
    }
}

impl Shape for Edge {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, narrow: Option<S::f32s>) -> S::f32s {
        let inside = simd.sub_f32s(simd.splat_f32s(1.0), simd.sqrt_f32s(s));
        let inside = narrow.map_or(inside, |narrow| simd.mul_f32s(inside, simd.sqrt_f32s(narrow)));
        ramp(simd, inside, [self.gain, self.offset, 1.0])
    }
}

impl Shape for Linear {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, _: Option<S::f32s>) -> S::f32s {
        simd.max_f32s(simd.sub_f32s(simd.splat_f32s(1.0), simd.sqrt_f32s(s)), simd.splat_f32s(0.0))
    }
}

impl Shape for Smooth {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, _: Option<S::f32s>) -> S::f32s {
        let t = simd.max_f32s(simd.sub_f32s(simd.splat_f32s(1.0), s), simd.splat_f32s(0.0));
        simd.mul_f32s(t, t)
    }
}

impl Shape for Gaussian {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, _: Option<S::f32s>) -> S::f32s {
        let inside = simd.less_than_or_equal_f32s(s, simd.splat_f32s(self.end));
        simd.select_f32s(inside, math::bell_simd(simd, s), simd.splat_f32s(0.0))
    }
}

/// `gain x + offset`, clamped to 0..`most`.
#[inline(always)]
fn ramp<S: Simd>(simd: S, x: S::f32s, [gain, offset, most]: [f32; 3]) -> S::f32s {
    let value = simd.add_f32s(simd.mul_f32s(x, simd.splat_f32s(gain)), simd.splat_f32s(offset));
    simd.min_f32s(simd.max_f32s(value, simd.splat_f32s(0.0)), simd.splat_f32s(most))
}

impl Pen {
    /// Depths of a block of pixels that starts at `column`, relative to the middle, in a row whose offsets along and
    /// across begin with `row`. `TAPER`: taper or tip is not 0. `ROUND`: ends are round.
    #[inline(always)]
    pub(super) fn values<S: Simd, const TAPER: bool, const ROUND: bool>(
        &self,
        simd: S,
        column: f32,
        row: [f32; 2],
        shape: &impl Shape,
    ) -> S::f32s {
        let splat = |v: f32| simd.splat_f32s(v);
        let place = simd.add_f32s(S::as_simd_f32s(&LANE).0[0], splat(column));
        let u = simd.abs_f32s(simd.add_f32s(simd.mul_f32s(place, splat(self.along[0])), splat(row[0])));
        let v = simd.add_f32s(simd.mul_f32s(place, splat(self.across[0])), splat(row[1]));
        let inside = simd.sub_f32s(splat(self.half_length), u);
        let mut across = simd.mul_f32s(v, v);
        let mut depth = splat(self.depth);
        if ROUND {
            let over = simd.mul_f32s(simd.min_f32s(inside, splat(0.0)), splat(self.unit));
            across = simd.add_f32s(across, simd.mul_f32s(over, over));
        } else {
            depth = ramp(simd, inside, [self.gain, self.offset, self.depth]);
        }
        if TAPER {
            let e = simd.min_f32s(simd.mul_f32s(u, splat(self.inverse_length)), splat(1.0));
            let e = simd.mul_f32s(e, e);
            let narrow = simd.sub_f32s(splat(1.0), simd.mul_f32s(e, splat(self.taper)));
            let narrow = simd.max_f32s(narrow, splat(1e-30));
            let tip = simd.sub_f32s(splat(1.0), simd.mul_f32s(simd.mul_f32s(e, e), splat(self.tip)));
            let value = shape.value(simd, simd.div_f32s(across, narrow), Some(narrow));
            simd.mul_f32s(simd.mul_f32s(value, depth), tip)
        } else {
            simd.mul_f32s(shape.value(simd, across, None), depth)
        }
    }
}

/// The extents of several rows within a stroke.
pub(super) struct Spans<S: Simd> {
    /// First column, and number of blocks.
    pub(super) from: S::u32s,
    pub(super) count: S::u32s,
    /// First column, relative to the middle of the stroke.
    pub(super) column: S::f32s,
    /// The offsets of the rows along and across, see [`Pen::values`].
    pub(super) along: S::f32s,
    pub(super) across: S::f32s,
}

impl Pen {
    /// The rows that start at `row`, within a window of `width` columns, `skip` columns into the stroke.
    #[inline(always)]
    pub(super) fn spans<S: Simd>(&self, simd: S, row: f32, width: f32, skip: f32) -> Spans<S> {
        let splat = |v: f32| simd.splat_f32s(v);
        let line = |y: S::f32s, [by_row, first]: [f32; 2]| simd.add_f32s(simd.mul_f32s(y, splat(by_row)), splat(first));
        let y = simd.add_f32s(S::as_simd_f32s(&LANE).0[0], splat(row));
        let [ends, sides] = self.edges;
        let (end, side) = (line(y, [ends[0], ends[1]]), line(y, [sides[0], sides[1]]));
        let from = simd.max_f32s(end, side);
        let to = simd.min_f32s(simd.add_f32s(end, splat(ends[2])), simd.add_f32s(side, splat(sides[2])));
        // Adding a half and rounding gives the next integer, subtracting a half the previous one.
        let snapped = |v: S::f32s, limit: [f32; 2]| {
            let limited = simd.min_f32s(simd.max_f32s(v, splat(limit[0])), splat(limit[1]));
            simd.add_f32s(limited, splat(SNAP))
        };
        let from = snapped(simd.add_f32s(from, splat(0.5 + skip)), [skip, width]);
        let to = snapped(simd.sub_f32s(to, splat(0.5)), [-1.0, width - 1.0]);
        let lanes = S::F32_LANES as f32;
        let blocks = simd.mul_f32s(simd.sub_f32s(to, from), splat(lanes.recip()));
        // (n + 1) / lanes rounded up, and 0 for n < 0.
        let blocks = snapped(simd.add_f32s(blocks, splat(0.5 + 0.5 / lanes)), [0.0, width]);
        let whole = |v: S::f32s| simd.sub_u32s(simd.transmute_u32s_f32s(v), simd.splat_u32s(SNAP.to_bits()));
        Spans {
            from: whole(from),
            count: whole(blocks),
            column: simd.sub_f32s(simd.sub_f32s(from, splat(SNAP)), splat(self.column as f32)),
            along: line(y, [self.along[1], self.along[2]]),
            across: line(y, [self.across[1], self.across[2]]),
        }
    }
}

/// Converts a whole number to an integer, clamped to the range of pixels.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "clamped before")]
fn whole(value: f64) -> i32 {
    value.clamp(-1e9, 1e9) as i32
}
