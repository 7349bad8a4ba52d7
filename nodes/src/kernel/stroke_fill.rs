//! The inner loops of [`super::strokes`]: one stroke into a window, 8 pixels at a time.

use super::math;
use super::strokes::{Combine, Draw, NO_STROKE, Profile, Stroke, StrokeStyle, Window, cut, narrow};
use glam::DVec2;

/// Pixels per block; rows are padded so that a block may begin in any column.
const LANES: usize = 8;
/// The same, to count columns with.
const LANE_COLUMNS: i32 = 8;

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
    /// Nothing if the stroke leaves no trace.
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
        let fade = if stroke.half_width < least { stroke.half_width / least } else { 1.0 };
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
            reach: [half_length + end + pixel[0], cut(style.profile) * half_width + pixel[1]],
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
    pub(super) fn draw(&mut self, pens: impl Iterator<Item = Pen>, profile: Profile, combine: Combine, most: f32) {
        let job = Job { canvas: self, pens, profile, combine, most };
        pulp::Arch::new().dispatch(job);
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

/// A call for [`pulp::Arch::dispatch`].
struct Job<'c, P, const IDS: bool> {
    canvas: &'c mut Canvas<IDS>,
    pens: P,
    profile: Profile,
    combine: Combine,
    most: f32,
}

impl<P: Iterator<Item = Pen>, const IDS: bool> pulp::WithSimd for Job<'_, P, IDS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let end = cut(self.profile) * cut(self.profile);
        let screen = self.most.recip();
        for pen in self.pens {
            match self.profile {
                Profile::Flat | Profile::Brush => {
                    let edge =
                        |s: f32, width: f32| ((1.0 - s.sqrt()) * width * pen.gain[0] + pen.offset).clamp(0.0, 1.0);
                    self.canvas.stroke(&pen, self.combine, screen, edge);
                }
                Profile::Linear => self.canvas.stroke(&pen, self.combine, screen, |s, _| (1.0 - s.sqrt()).max(0.0)),
                Profile::Smooth => self.canvas.stroke(&pen, self.combine, screen, |s, _| {
                    let t = (1.0 - s).max(0.0);
                    t * t
                }),
                Profile::Gaussian { sigma, .. } => {
                    let fall = -1.0 / (8.0 * sigma * sigma);
                    let bell = |s: f32, _| if s <= end { math::exp(fall * s) } else { 0.0 };
                    self.canvas.stroke(&pen, self.combine, screen, bell);
                }
            }
        }
    }
}

impl<const IDS: bool> Canvas<IDS> {
    /// Draws one stroke; `profile` takes the square of the distance in half widths, and the half width.
    #[inline(always)]
    fn stroke(&mut self, pen: &Pen, combine: Combine, screen: f32, profile: impl Fn(f32, f32) -> f32) {
        let step = self.window.step;
        let [tx, ty] = pen.along;
        let [reach_u, reach_v] = pen.reach;
        let tall = tx.abs() * reach_v + ty.abs() * reach_u;
        let height = i32::try_from(self.window.height).unwrap_or(i32::MAX);
        let width = i32::try_from(self.window.width).unwrap_or(i32::MAX);
        let top = pen.row - self.window.y;
        let (first, last) = (whole((pen.corner[1] - tall) / step.y) - 1, whole((pen.corner[1] + tall) / step.y) + 1);
        // Where a row at distance 1 from the middle cuts the stroke's length and width, and how much of it.
        let slanted = |t: f32, s: f32, reach: f32| if t.abs() > 1e-6 { (s / t, reach / t.abs()) } else { (0.0, 1e30) };
        let (shift_u, half_u) = slanted(tx, -ty, reach_u);
        let (shift_v, half_v) = slanted(ty, tx, reach_v);
        let left = pen.column.saturating_sub(self.window.x);
        for row in first.max(top.saturating_neg())..=last.min(height - 1 - top) {
            let y = (row as f32 + 0.5) * step.y - pen.corner[1];
            let from = (y * shift_u - half_u).max(y * shift_v - half_v);
            let to = (y * shift_u + half_u).min(y * shift_v + half_v);
            // A column more on either side: what lies out there is 0 by its own distance.
            let from = (whole((from + pen.corner[0]) / step.x) - 1).saturating_add(left).max(0);
            let to = (whole((to + pen.corner[0]) / step.x) + 2).saturating_add(left).min(width);
            let Ok(line) = usize::try_from(top + row) else { continue };
            let mut column = from;
            while column < to {
                let at = line * self.stride + usize::try_from(column).unwrap_or(0);
                self.block(pen, at, (column - left, y), (combine, screen), &profile);
                column += LANE_COLUMNS;
            }
        }
    }

    /// Draws 8 pixels; `column` counts from the pixel of the stroke's middle.
    #[inline(always)]
    fn block(
        &mut self,
        pen: &Pen,
        at: usize,
        (column, y): (i32, f32),
        (combine, screen): (Combine, f32),
        profile: impl Fn(f32, f32) -> f32,
    ) {
        let [tx, ty] = pen.along;
        let width = pen.half_width * pen.half_width;
        let mut value = [0.0f32; LANES];
        for (lane, value) in (0i32..).zip(&mut value) {
            let x = ((column + lane) as f32 + 0.5) * self.window.step.x - pen.corner[0];
            let (u, v) = (x * tx + y * ty, y * tx - x * ty);
            let over = (u.abs() - pen.half_length).max(0.0) * pen.cap;
            let e = (u * pen.inverse_length).abs().min(1.0);
            let e = e * e;
            let width = (width * (1.0 - pen.taper * e)).max(1e-30);
            let inside = (pen.half_length - u.abs()) * pen.gain[1] + pen.offset;
            let end = (inside.max(pen.cap * 2.0)).clamp(0.0, 1.0);
            let shape = profile((v * v + over * over) / width, width.sqrt());
            *value = shape * end * pen.depth * (1.0 - pen.tip * e * e);
        }
        let out: &mut [f32; LANES] = self.values[at..].first_chunk_mut().expect("rows are padded");
        if IDS {
            let ids: &mut [u32; LANES] = self.ids[at..].first_chunk_mut().expect("rows are padded");
            for lane in 0..LANES {
                ids[lane] = if value[lane] > out[lane] { pen.id } else { ids[lane] };
            }
        }
        for lane in 0..LANES {
            let (a, b) = (out[lane], value[lane]);
            out[lane] = match combine {
                Combine::Max => {
                    if b > a {
                        b
                    } else {
                        a
                    }
                }
                Combine::Add => a + b,
                Combine::Screen => a + b - a * b * screen,
            };
        }
    }
}

/// The whole number at or below `value`, kept within what pixels can be.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "clamped before")]
fn whole(value: f32) -> i32 {
    value.floor().clamp(-1e9, 1e9) as i32
}
