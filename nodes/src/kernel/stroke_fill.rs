//! The inner loops of [`super::strokes`]: one stroke into a window, some pixels of a row at a time.
//!
//! Written with explicit vectors: whether such loops vectorise by themselves depends on what they are inlined into. A
//! pixel's value does not depend on how many others are computed with it.

use super::math;
use super::strokes::{Combine, Draw, NO_STROKE, Profile, Stroke, StrokeStyle, Window, cut, narrow};
use glam::{DVec2, IVec2, Vec2};
use pulp::Simd;

/// The most pixels per block on any machine; rows are padded by as many so that a block may begin in any column.
const LANES: usize = 16;
/// The numbers of the lanes.
const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// A stroke as seen from a window.
pub(super) struct Pen {
    id: u32,
    /// Pixel of the middle, and the way from its corner to the middle in mm.
    column: i32,
    row: i32,
    corner: [f32; 2],
    /// Unit vector along.
    along: [f32; 2],
    half_length: f32,
    inverse_length: f32,
    half_width: f32,
    depth: f32,
    taper: f32,
    tip: f32,
    /// 1 for round caps.
    cap: f32,
    /// How far it is drawn along and across.
    reach: [f32; 2],
    /// Coverage of an edge at distance d inside: `d · gain + offset`, clamped to 0..1; across and along.
    gain: [f32; 2],
    offset: f32,
}

impl Pen {
    /// Nothing if the stroke leaves no trace. Inlined where there are vector instructions: without them rounding is
    /// a call of a function.
    #[inline(always)]
    pub(super) fn new(
        id: u32,
        stroke: &Stroke,
        style: &StrokeStyle,
        window: &Window,
        (draw, shift): (Draw, DVec2),
    ) -> Option<Self> {
        let [a, b] = stroke.ends.map(|e| e.as_dvec2());
        let along = (b - a).normalize_or(DVec2::X).as_vec2();
        let half_length = narrow((b - a).length() * 0.5);
        // Size of a pixel as seen along and across.
        let step = window.step;
        let pixel = [(along * step).length(), (along.perp() * step).length()];
        let least = 0.5 * style.min_width * pixel[1];
        let fade = if style.fade && stroke.half_width < least { stroke.half_width / least } else { 1.0 };
        let half_width = stroke.half_width.max(least);
        let depth = fade * if draw == Draw::Mask { 1.0 } else { stroke.depth };
        let nothing = depth <= 0.0 || half_width <= 0.0 || (half_length <= 0.0 && !style.round_caps);
        if nothing || stroke.depth <= 0.0 {
            return None;
        }
        let pitch = step.as_dvec2();
        // The copy of the canvas is a whole number of pixels away if possible: then copies have the same bits.
        let pixels = shift / pitch;
        let whole = (pixels - pixels.round()).abs().max_element() < 1e-3;
        let middle = (a + b) * 0.5 + if whole { DVec2::ZERO } else { shift };
        let corner = (middle / pitch).floor();
        let at = (corner + if whole { pixels.round() } else { DVec2::ZERO }).as_ivec2();
        let brush = style.profile == Profile::Brush;
        let end = if style.round_caps { cut(style.profile) * half_width } else { 0.0 };
        // Half a pixel more where edges are soft.
        let soft = if style.antialias { 0.5 } else { 0.0 };
        let edge = if matches!(style.profile, Profile::Flat | Profile::Brush) { soft } else { 0.0 };
        let (gain, offset) = if style.antialias { (pixel.map(f32::recip), 0.5) } else { ([1e30; 2], 1.0) };
        Some(Self {
            id,
            column: at.x,
            row: at.y,
            corner: (middle - corner * pitch).as_vec2().to_array(),
            along: along.to_array(),
            half_length,
            inverse_length: if half_length > 0.0 { half_length.recip() } else { 0.0 },
            half_width,
            depth,
            taper: if brush { 1.0 } else { style.taper.clamp(0.0, 1.0) },
            tip: style.tip.clamp(0.0, 1.0),
            cap: if style.round_caps { 1.0 } else { 0.0 },
            reach: [half_length + end + soft * pixel[0], cut(style.profile) * half_width + edge * pixel[1]],
            gain: [gain[1], gain[0]],
            offset,
        })
    }
}

/// The pixels of a window, with room for whole blocks.
pub(super) struct Canvas<const IDS: bool> {
    window: Window,
    stride: usize,
    values: Vec<f32>,
    ids: Vec<u32>,
}

impl<const IDS: bool> Canvas<IDS> {
    pub(super) fn new(window: &Window) -> Self {
        let stride = window.width + LANES;
        let count = stride * window.height;
        Self { window: *window, stride, values: vec![0.0; count], ids: vec![NO_STROKE; if IDS { count } else { 0 }] }
    }

    /// Draws strokes in their order.
    pub(super) fn draw(&mut self, job: Job<'_>) {
        pulp::Arch::new().dispatch(Call { canvas: self, job });
    }

    pub(super) fn copy_to(&self, out: &mut [f32], ids: &mut [u32]) {
        let width = self.window.width;
        if width == 0 {
            return;
        }
        for (to, from) in out.chunks_exact_mut(width).zip(self.values.chunks_exact(self.stride)) {
            to.copy_from_slice(&from[..width]);
        }
        if IDS {
            for (to, from) in ids.chunks_exact_mut(width).zip(self.ids.chunks_exact(self.stride)) {
                to.copy_from_slice(&from[..width]);
            }
        }
    }
}

/// What is to be drawn.
pub(super) struct Job<'s> {
    pub(super) strokes: &'s [Stroke],
    /// Indices of strokes and the copies of the canvas they lie in.
    pub(super) near: &'s [(u32, IVec2)],
    pub(super) style: StrokeStyle,
    pub(super) period: Vec2,
    pub(super) draw: Draw,
    /// The greatest depth.
    pub(super) most: f32,
}

/// A call for [`pulp::Arch::dispatch`]: a closure would not be inlined where the vector instructions are.
struct Call<'c, 's, const IDS: bool> {
    canvas: &'c mut Canvas<IDS>,
    job: Job<'s>,
}

impl<const IDS: bool> pulp::WithSimd for Call<'_, '_, IDS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Job { strokes, near, style, period, draw, most } = self.job;
        let blend = (style.combine, most.recip());
        for &(id, copy) in near {
            let shift = period.as_dvec2() * copy.as_dvec2() - self.canvas.window.origin;
            let stroke = &strokes[id as usize];
            let Some(pen) = Pen::new(id, stroke, &style, &self.canvas.window, (draw, shift)) else { continue };
            match style.profile {
                Profile::Flat | Profile::Brush => self.canvas.stroke(simd, &pen, blend, &Edge(&pen)),
                Profile::Linear => self.canvas.stroke(simd, &pen, blend, &Linear),
                Profile::Smooth => self.canvas.stroke(simd, &pen, blend, &Smooth),
                Profile::Gaussian { sigma, cutoff } => {
                    let bell = Bell { fall: -1.0 / (8.0 * sigma * sigma), end: 4.0 * cutoff * cutoff };
                    self.canvas.stroke(simd, &pen, blend, &bell);
                }
            }
        }
    }
}

/// A cross-section.
trait Shape {
    /// Its value from the square of the distance in half widths, and the square of the half width.
    fn value<S: Simd>(&self, simd: S, s: S::f32s, width: S::f32s) -> S::f32s;
}

/// Flat, with the soft edge of a pen.
struct Edge<'p>(&'p Pen);
/// `1 - t`.
struct Linear;
/// `(1 - t²)²`.
struct Smooth;
/// `exp(fall t²)` for `t² ≤ end`.
struct Bell {
    fall: f32,
    end: f32,
}

impl Shape for Edge<'_> {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, width: S::f32s) -> S::f32s {
        let inside = simd.sub_f32s(simd.splat_f32s(1.0), simd.sqrt_f32s(s));
        let inside = simd.mul_f32s(inside, simd.sqrt_f32s(width));
        self.0.cover(simd, inside, self.0.gain[0])
    }
}

impl Shape for Linear {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, _: S::f32s) -> S::f32s {
        simd.max_f32s(simd.sub_f32s(simd.splat_f32s(1.0), simd.sqrt_f32s(s)), simd.splat_f32s(0.0))
    }
}

impl Shape for Smooth {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, _: S::f32s) -> S::f32s {
        let t = simd.max_f32s(simd.sub_f32s(simd.splat_f32s(1.0), s), simd.splat_f32s(0.0));
        simd.mul_f32s(t, t)
    }
}

impl Shape for Bell {
    #[inline(always)]
    fn value<S: Simd>(&self, simd: S, s: S::f32s, _: S::f32s) -> S::f32s {
        let value = math::exp_simd(simd, simd.mul_f32s(s, simd.splat_f32s(self.fall)));
        let inside = simd.less_than_or_equal_f32s(s, simd.splat_f32s(self.end));
        simd.select_f32s(inside, value, simd.splat_f32s(0.0))
    }
}

impl Pen {
    /// How much of a pixel is covered when its centre is so many mm inside an edge.
    #[inline(always)]
    fn cover<S: Simd>(&self, simd: S, inside: S::f32s, gain: f32) -> S::f32s {
        let share = simd.add_f32s(simd.mul_f32s(inside, simd.splat_f32s(gain)), simd.splat_f32s(self.offset));
        simd.min_f32s(simd.max_f32s(share, simd.splat_f32s(0.0)), simd.splat_f32s(1.0))
    }

    /// Depths of pixels in row `y` mm below the stroke's middle, from a column on that counts from that of the middle.
    #[inline(always)]
    fn values<S: Simd>(&self, simd: S, column: i32, y: f32, step: f32, shape: &impl Shape) -> S::f32s {
        let splat = |v: f32| simd.splat_f32s(v);
        let [tx, ty] = self.along;
        let lane = S::as_simd_f32s(&LANE).0[0];
        let place = simd.add_f32s(lane, splat(column as f32 + 0.5));
        let x = simd.sub_f32s(simd.mul_f32s(place, splat(step)), splat(self.corner[0]));
        let u = simd.abs_f32s(simd.add_f32s(simd.mul_f32s(x, splat(tx)), splat(y * ty)));
        let v = simd.sub_f32s(splat(y * tx), simd.mul_f32s(x, splat(ty)));
        let inside = simd.sub_f32s(splat(self.half_length), u);
        let over = simd.mul_f32s(simd.min_f32s(inside, splat(0.0)), splat(self.cap));
        let e = simd.min_f32s(simd.mul_f32s(u, splat(self.inverse_length)), splat(1.0));
        let e = simd.mul_f32s(e, e);
        let narrow = simd.sub_f32s(splat(1.0), simd.mul_f32s(e, splat(self.taper)));
        let width = simd.max_f32s(simd.mul_f32s(narrow, splat(self.half_width * self.half_width)), splat(1e-30));
        let across = simd.add_f32s(simd.mul_f32s(v, v), simd.mul_f32s(over, over));
        let value = shape.value(simd, simd.div_f32s(across, width), width);
        let end = simd.max_f32s(self.cover(simd, inside, self.gain[1]), splat(self.cap));
        let tip = simd.sub_f32s(splat(1.0), simd.mul_f32s(simd.mul_f32s(e, e), splat(self.tip)));
        simd.mul_f32s(simd.mul_f32s(value, end), simd.mul_f32s(tip, splat(self.depth)))
    }
}

impl<const IDS: bool> Canvas<IDS> {
    /// Draws one stroke.
    #[inline(always)]
    fn stroke<S: Simd>(&mut self, simd: S, pen: &Pen, blend: (Combine, f32), shape: &impl Shape) {
        let step = self.window.step;
        let [tx, ty] = pen.along;
        let [reach_u, reach_v] = pen.reach;
        let tall = tx.abs() * reach_v + ty.abs() * reach_u;
        let height = i32::try_from(self.window.height).unwrap_or(i32::MAX);
        let width = i32::try_from(self.window.width).unwrap_or(i32::MAX);
        let lanes = i32::try_from(S::F32_LANES).unwrap_or(1);
        let per = step.recip();
        let (top, left) = (pen.row.saturating_sub(self.window.y), pen.column.saturating_sub(self.window.x));
        let (first, last) = centres(pen.corner[1] - tall, pen.corner[1] + tall, per.y);
        // Where a row at distance 1 from the middle cuts the stroke's length and width, and how much of it.
        let slanted = |t: f32, s: f32, reach: f32| if t.abs() > 1e-6 { (s / t, reach / t.abs()) } else { (0.0, 1e30) };
        let (shift_u, half_u) = slanted(tx, -ty, reach_u);
        let (shift_v, half_v) = slanted(ty, tx, reach_v);
        for row in first.max(top.saturating_neg())..=last.min((height - 1).saturating_sub(top)) {
            let y = (row as f32 + 0.5) * step.y - pen.corner[1];
            let from = (y * shift_u - half_u).max(y * shift_v - half_v);
            let to = (y * shift_u + half_u).min(y * shift_v + half_v);
            let (from, to) = centres(from + pen.corner[0], to + pen.corner[0], per.x);
            let (from, to) = (from.saturating_add(left).max(0), to.saturating_add(left).min(width - 1));
            let Ok(line) = usize::try_from(top + row) else { continue };
            let mut column = from;
            while column <= to {
                let at = line * self.stride + usize::try_from(column).unwrap_or(0);
                let values = pen.values(simd, column - left, y, step.x, shape);
                self.blend(simd, at, pen.id, blend, values);
                column += lanes;
            }
        }
    }

    /// Combines pixels with what is there.
    #[inline(always)]
    fn blend<S: Simd>(&mut self, simd: S, at: usize, id: u32, (combine, screen): (Combine, f32), new: S::f32s) {
        let out = &mut S::as_mut_simd_f32s(&mut self.values[at..at + S::F32_LANES]).0[0];
        if IDS {
            let ids = &mut S::as_mut_simd_u32s(&mut self.ids[at..at + S::F32_LANES]).0[0];
            *ids = simd.select_u32s(simd.less_than_f32s(*out, new), simd.splat_u32s(id), *ids);
        }
        *out = match combine {
            Combine::Max => simd.max_f32s(*out, new),
            Combine::Add => simd.add_f32s(*out, new),
            Combine::Screen => {
                let both = simd.mul_f32s(simd.mul_f32s(*out, new), simd.splat_f32s(screen));
                simd.sub_f32s(simd.add_f32s(*out, new), both)
            }
        };
    }
}

/// The first and the last pixel whose centre lies between two places in mm, or a hair beyond: pixels too many are 0 by
/// their own distance.
#[inline(always)]
fn centres(from: f32, to: f32, per: f32) -> (i32, i32) {
    /// In pixels; far above the rounding of places that matter.
    const HAIR: f32 = 0.02;
    (whole((from * per - 0.5 - HAIR).ceil()), whole((to * per - 0.5 + HAIR).floor()))
}

/// A whole number as such, kept within what pixels can be.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "clamped before")]
fn whole(value: f32) -> i32 {
    value.clamp(-1e9, 1e9) as i32
}
